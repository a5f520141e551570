/** How much of a file is looked at, in bytes: joints stand at its beginning. */
const HEAD_BYTES = 4e6;
/** Beginning of a binary glTF: `glTF`, version, length, then the length and type of the JSON chunk. */
const GLB_HEADER_BYTES = 20;

/** What of a glTF's JSON tells its joints. */
interface GltfNodes {
  nodes?: { name?: string }[];
  skins?: { joints?: number[] }[];
}

/**
 * The names of the joints in a motion file that could not be played, to see why none matched; none for a
 * file without names, or one that is broken.
 */
export async function jointNames(file: File): Promise<string[]> {
  const bytes = await file.slice(0, HEAD_BYTES).arrayBuffer();
  const start = new TextDecoder().decode(bytes.slice(0, 4));
  return start === "glTF" ? namesInGlb(bytes) : namesInBvh(new TextDecoder().decode(bytes));
}

function namesInBvh(text: string): string[] {
  return [...text.matchAll(/^\s*(?:ROOT|JOINT)\s+(.+?)\s*$/gm)].map(([, name = ""]) => name);
}

function namesInGlb(bytes: ArrayBuffer): string[] {
  if (bytes.byteLength < GLB_HEADER_BYTES) return [];
  const length = new DataView(bytes).getUint32(12, true);
  try {
    const json = new TextDecoder().decode(bytes.slice(GLB_HEADER_BYTES, GLB_HEADER_BYTES + length));
    const { nodes = [], skins = [] } = JSON.parse(json) as GltfNodes;
    const joints = new Set(skins.flatMap(({ joints: of = [] }) => of));
    return nodes.flatMap(({ name }, idx) =>
      name && (joints.size === 0 || joints.has(idx)) ? [name] : [],
    );
  } catch {
    return [];
  }
}
