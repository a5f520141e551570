// Makes GLB files with three's GLTFExporter, for scripts/exporters.mjs: what a page does that plays a
// BVH file and saves what it shows.
//
//     node three.mjs FOLDER PLAN.json
//
// FOLDER holds three under node_modules. The plan is a list of `{ out, source, scale, current }`.
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [folder, plan] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(join(folder, "node_modules", "three", path)).href);
// The file that the exporter's own `import "three"` finds: classes of another would not be its own.
const THREE = await load("build/three.module.js");
const { BVHLoader } = await load("examples/jsm/loaders/BVHLoader.js");
const { GLTFExporter } = await load("examples/jsm/exporters/GLTFExporter.js");

/** What the exporter wants of a browser's FileReader. */
globalThis.FileReader = class {
  readAsArrayBuffer(blob) {
    blob.arrayBuffer().then((buffer) => {
      this.result = buffer;
      this.onloadend();
    });
  }
};

const M_PER_CM = 0.01;

async function make({ out, source, scale = 1, current = 0 }) {
  const { skeleton, clip } = new BVHLoader().parse(readFileSync(source, "utf8"));
  const toScene = M_PER_CM / scale;
  for (const bone of skeleton.bones) bone.position.multiplyScalar(toScene);
  for (const track of clip.tracks) {
    if (track.name.endsWith(".position")) track.values = track.values.map((v) => v * toScene);
  }
  clip.name = "known";
  const [root] = skeleton.bones;
  const armature = new THREE.Group();
  armature.name = "Armature";
  armature.scale.setScalar(scale);
  armature.add(root);
  armature.updateMatrixWorld(true);
  const mesh = skinned(skeleton, armature);
  if (current > 0) {
    const mixer = new THREE.AnimationMixer(armature);
    mixer.clipAction(clip).play();
    mixer.setTime(current * clip.duration);
    mesh.skeleton.update();
  }
  const glb = await new GLTFExporter().parseAsync(armature, { binary: true, animations: [clip] });
  writeFileSync(out, new Uint8Array(glb));
}

/** A small triangle at each bone, held by it alone. */
function skinned(skeleton, armature) {
  const corners = skeleton.bones.flatMap((bone) => {
    const { x, y, z } = bone.getWorldPosition(new THREE.Vector3());
    return [x, y, z, x + 0.02, y, z, x, y + 0.02, z];
  });
  const holders = skeleton.bones.flatMap((_, bone) => [bone, bone, bone]);
  const geometry = new THREE.BufferGeometry();
  const set = (name, values, size) =>
    geometry.setAttribute(
      name,
      new THREE.BufferAttribute(
        name === "skinIndex" ? new Uint16Array(values) : new Float32Array(values),
        size,
      ),
    );
  set("position", corners, 3);
  set(
    "skinIndex",
    holders.flatMap((bone) => [bone, 0, 0, 0]),
    4,
  );
  set(
    "skinWeight",
    holders.flatMap(() => [1, 0, 0, 0]),
    4,
  );
  const mesh = new THREE.SkinnedMesh(geometry, new THREE.MeshStandardMaterial());
  mesh.name = "Skin";
  // The corners stand in the scene's metres, whatever the armature's scale.
  mesh.scale.setScalar(1 / armature.scale.x);
  armature.add(mesh);
  armature.updateMatrixWorld(true);
  mesh.bind(new THREE.Skeleton(skeleton.bones));
  return mesh;
}

for (const variant of JSON.parse(readFileSync(plan, "utf8"))) {
  try {
    await make(variant);
    console.log(`VARIANT\t${variant.out}\tok`);
  } catch (error) {
    console.log(`VARIANT\t${variant.out}\tfailed\t${error.message}`);
  }
}
