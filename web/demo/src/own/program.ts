/** What the program is about. */
export interface ProgramOptions {
  fileName: string;
  sex: "female" | "male";
  isSportswear: boolean;
  /** Names of meshes that stay as plain skinning has them. */
  excluded: readonly string[];
}

/** The program that does what the page shows. */
export function programFor({ fileName, sex, isSportswear, excluded }: ProgramOptions): string {
  const names = JSON.stringify(excluded);
  const options =
    excluded.length > 0 ? `, {\n  exclude: (mesh) => ${names}.includes(mesh.name),\n}` : "";
  return `import { load } from "dynaskin";
import { AvatarTissue, bindAvatar } from "dynaskin/three";

const model = await load({ model: "/models/${sex}/" });
const { scene, userData: { vrm } } = await loader.loadAsync(${JSON.stringify(`/${fileName}`)});
const binding = await bindAvatar(model, scene, { depicts: "adult", vrm });
// Or the file downloaded here: Binding.fromBytes(bytes, model)
const tissue = new AvatarTissue(model, scene, binding${options});
${isSportswear ? 'tissue.avatar.setControls("sportswear");\n' : ""}
function frame(deltaSeconds) {
  mixer.update(deltaSeconds);
  tissue.update(deltaSeconds); // after everything that moves bones
  renderer.render(view, camera);
}
`;
}
