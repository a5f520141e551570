/** Kinds of files that people have and that hold motion, but are not read here. */
const FOREIGN: readonly (readonly [extension: RegExp, start: string, name: string])[] = [
  [/\.fbx$/i, "Kaydara FBX", "an FBX file"],
  [/\.(dae)$/i, "", "a COLLADA file"],
  [/\.(blend)$/i, "BLENDER", "a Blender file"],
  [/\.(usdz?|usd[ac])$/i, "PXR-USDC", "a USD file"],
  [/\.(mp4|mov|webm)$/i, "", "a film"],
];

/**
 * Says in a visitor's words why a file cannot hold a motion that is read here, before its reader says it
 * in its own.
 *
 * @throws Error for an empty file, and for those of other programs
 */
export function checkKind(name: string, bytes: Uint8Array): void {
  if (bytes.length === 0) throw new Error("The file is empty: nothing was saved into it.");
  const begin = String.fromCharCode(...bytes.subarray(0, 24));
  const foreign = FOREIGN.find(
    ([extension, start]) => extension.test(name) || (start !== "" && begin.startsWith(start)),
  );
  if (!foreign) return;
  throw new Error(
    `This is ${foreign[2]}, which the page cannot read: convert it to GLB or BVH. Blender and most other ` +
      "programs export both.",
  );
}
