/** The examples that ship with the page: made from the package's own bodies by `dynaskin avatars`. */
const EXAMPLES = {
  runner: {
    name: "runner.vrm",
    sex: "female",
    address: new URL("../../avatars/runner.vrm", import.meta.url),
  },
  lifter: {
    name: "lifter.glb",
    sex: "male",
    address: new URL("../../avatars/lifter.glb", import.meta.url),
  },
} as const;

/** Fetches an example, as a file that a visitor might have. */
export async function fetchExample(
  example: keyof typeof EXAMPLES,
): Promise<{ file: File; sex: "female" | "male" }> {
  const { name, sex, address } = EXAMPLES[example];
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${name}: the server answered ${response.status}.`);
  return { file: new File([await response.blob()], name), sex };
}
