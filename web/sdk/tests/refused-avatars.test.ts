// What is no avatar of an adult: each is refused with a sentence, and nothing changes.
import { type Model, restPose } from "dynaskin";
import { AvatarTissue, Binding, type BindOptions, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { makeInThree } from "../../../tests/avatars/made.js";
import { expectError, loadModel } from "./support.js";

let model: Model;
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

const ADULT: BindOptions = { depicts: "adult", worker: false };

function made() {
  const { root, meshes } = makeInThree(THREE, model);
  const mesh = meshes[0] as THREE.SkinnedMesh;
  const positions = mesh.geometry.getAttribute("position").array as Float32Array;
  return { root, mesh, positions };
}

/** Refused with this code and these words, with every mesh as it was. */
async function refusal(code: string, root: THREE.Object3D): Promise<string> {
  const geometries: unknown[] = [];
  root.traverse((object) => geometries.push((object as THREE.Mesh).geometry));
  const { message } = await expectError(code, () => bindAvatar(model, root, ADULT));
  const after: unknown[] = [];
  root.traverse((object) => after.push((object as THREE.Mesh).geometry));
  expect(after).toEqual(geometries);
  return message;
}

describe("bindAvatar refuses", () => {
  it("what has no skin", async () => {
    const plain = () => new THREE.Mesh(new THREE.BoxGeometry());
    expect(await refusal("avatar", new THREE.Group())).toContain("no mesh under the object");
    expect(await refusal("avatar", new THREE.Group().add(plain()))).toContain(
      "The one mesh under the object that was given is not skinned",
    );
    expect(await refusal("avatar", new THREE.Group().add(plain(), plain(), plain()))).toContain(
      "3 meshes under the object that was given and none of them is skinned",
    );
  });

  it("what is no person", async () => {
    const { root, mesh } = made();
    for (const [joint, bone] of mesh.skeleton.bones.entries()) {
      bone.userData.name = `link ${joint}`;
      bone.position.set(0, 0, 0.1);
    }
    root.updateMatrixWorld(true);
    mesh.bind(new THREE.Skeleton(mesh.skeleton.bones), new THREE.Matrix4());
    expect(await refusal("humanoid", root)).toContain("no person was found in the skeleton");
  });

  it("an animal, whose trunk lies", async () => {
    const { root } = made();
    root.rotation.x = Math.PI / 2;
    expect(await refusal("humanoid", new THREE.Group().add(root))).toMatch(
      /leans 9\d degrees from upright/,
    );
  });

  it("a child or a toon", async () => {
    const child = made().root;
    child.scale.setScalar(0.8);
    expect(await refusal("adult", new THREE.Group().add(child))).toMatch(/it is 1\.\d\d m tall/);
    const { root, positions } = made();
    // A head of twice the size.
    for (let at = 1; at < positions.length; at += 3) {
      const y = positions[at] ?? 0;
      if (y > 1.42) positions[at] = 1.42 + 2.2 * (y - 1.42);
    }
    const message = await refusal("adult", root);
    expect(message).toContain("crown to shoulder");
    expect(message).toContain("there is no way around this");
  });

  it("numbers that are none", async () => {
    const { root, positions } = made();
    positions[7] = Number.NaN;
    expect(await refusal("avatar", root)).toMatch(/position of vertex 2.*no usable number/);
  });

  it("triangles without area, unless others have one", async () => {
    const { root, mesh } = made();
    const index = mesh.geometry.index as THREE.BufferAttribute;
    const whole = index.array.slice();
    for (let at = 0; at < 3000; at += 1) index.setX(at, 5);
    await bindAvatar(model, root, ADULT);
    index.array.fill(5);
    expect(await refusal("avatar", root)).toContain("no surface to speak of");
    index.array.set(whole);
    const { root: point, positions } = made();
    positions.fill(0.5);
    expect(await refusal("avatar", point)).toContain("no surface to speak of");
  });

  it("a million vertices", async () => {
    const { root, mesh } = made();
    const count = 1_000_000;
    const { geometry } = mesh;
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * count), 3));
    geometry.setAttribute("skinIndex", new THREE.BufferAttribute(new Uint8Array(4 * count), 4));
    geometry.setAttribute("skinWeight", new THREE.BufferAttribute(new Float32Array(4 * count), 4));
    expect(await refusal("avatar", root)).toMatch(/1000000 vertices, at most 400000 are bound/);
  });
});

describe("AvatarTissue refuses", () => {
  it("a binding of another file, and one that is cut", async () => {
    const { root } = made();
    const binding = await bindAvatar(model, root, ADULT);
    const other = made();
    other.positions[0] = (other.positions[0] ?? 0) + 0.01;
    const { geometry } = other.mesh;
    const before = geometry.getAttribute("position").array.slice();
    const { message } = await expectError(
      "binding",
      () => new AvatarTissue(model, other.root, binding),
    );
    expect(message).toContain("Bind this avatar again, or exclude the mesh");
    expect(other.mesh.geometry).toBe(geometry);
    expect(geometry.getAttribute("position").array).toEqual(before);
    const bytes = binding.toBytes();
    for (const length of [0, 7, 40, bytes.length - 1]) {
      await expectError("binding", () => Binding.fromBytes(bytes.subarray(0, length), model));
    }
    // The first avatar is none the worse for it.
    const tissue = new AvatarTissue(model, root, binding);
    tissue.writePose(restPose());
    tissue.update(1 / 60);
    tissue.dispose();
  });
});
