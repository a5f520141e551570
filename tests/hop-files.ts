// The hop of hop-bvh.ts in other formats: binary glTF with a VRM animation's humanoid or without, and
// SMPL poses as AMASS stores them.
import { Document, type Node, NodeIO } from "@gltf-transform/core";
import { zipSync } from "fflate";
import {
  type Bone,
  FRAMES_PER_SECOND,
  HOP_FRAMES,
  hopAt,
  SKELETON,
  type Vector,
} from "./hop-bvh.js";

const RADIANS = Math.PI / 180;

type Quaternion = [number, number, number, number];

/** Rotation about one axis of the world. */
function about(axis: 0 | 1 | 2, degrees: number): Quaternion {
  const quaternion: Quaternion = [0, 0, 0, Math.cos((degrees * RADIANS) / 2)];
  quaternion[axis] = Math.sin((degrees * RADIANS) / 2);
  return quaternion;
}

/** The hop never turns a bone about more than one axis. */
function quaternionOf([z, x]: Vector): Quaternion {
  return z !== 0 ? about(2, z) : about(0, x);
}

/** VRM's names of the figure's bones. */
const VRM_NAMES: Record<string, string> = {
  Hips: "hips",
  Spine: "spine",
  Spine1: "chest",
  Neck: "neck",
  Head: "head",
  ...Object.fromEntries(
    (["Left", "Right"] as const).flatMap((side) =>
      Object.entries({
        Shoulder: "Shoulder",
        Arm: "UpperArm",
        ForeArm: "LowerArm",
        Hand: "Hand",
        UpLeg: "UpperLeg",
        Leg: "LowerLeg",
        Foot: "Foot",
      }).map(([bone, human]) => [`${side}${bone}`, `${side.toLowerCase()}${human}`]),
    ),
  ),
};

/** The hop as binary glTF, in metres; `vrma` calls the nodes by numbers and says who is who. */
export async function hopGlb(kind: "glb" | "vrma" = "glb"): Promise<Uint8Array> {
  const document = new Document();
  const buffer = document.createBuffer();
  const accessor = (type: "SCALAR" | "VEC3" | "VEC4", numbers: number[]) =>
    document.createAccessor().setType(type).setArray(new Float32Array(numbers)).setBuffer(buffer);
  const frames = Array.from({ length: HOP_FRAMES }, (_, frame) => frame);
  const times = accessor(
    "SCALAR",
    frames.map((frame) => frame / FRAMES_PER_SECOND),
  );
  const animation = document.createAnimation("hop");
  const animate = (node: Node, path: "rotation" | "translation", numbers: number[]) => {
    const output = accessor(path === "rotation" ? "VEC4" : "VEC3", numbers);
    const sampler = document.createAnimationSampler().setInput(times).setOutput(output);
    const channel = document.createAnimationChannel().setTargetNode(node).setTargetPath(path);
    animation.addSampler(sampler).addChannel(channel.setSampler(sampler));
  };
  const bones: string[] = [];
  const make = ({ name, offset, children = [] }: Bone): Node => {
    const node = document.createNode(kind === "glb" ? name : `node ${bones.length}`);
    bones.push(name);
    node.setTranslation(offset.map((cm) => cm / 100) as Vector);
    animate(
      node,
      "rotation",
      frames.flatMap((frame) => quaternionOf(hopAt(frame).degreesOf(name))),
    );
    for (const child of children) node.addChild(make(child));
    return node;
  };
  const hips = make(SKELETON);
  animate(
    hips,
    "translation",
    frames.flatMap((frame) => [0, hopAt(frame).hipCm / 100, 0]),
  );
  document.createScene().addChild(hips);
  const io = new NodeIO();
  const { json, resources } = await io.writeJSON(document, {});
  if (kind === "vrma") {
    const humanBones = Object.fromEntries(
      (json.nodes ?? []).map(({ name }, node) => {
        const bone = bones[Number(name?.slice("node ".length))] ?? "";
        return [VRM_NAMES[bone] ?? "", { node }];
      }),
    );
    const extension = { specVersion: "1.0", humanoid: { humanBones } };
    json.extensions = { VRMC_vrm_animation: extension };
    json.extensionsUsed = ["VRMC_vrm_animation"];
  }
  return binary(json, Object.values(resources)[0] ?? new Uint8Array());
}

/** The container of binary glTF: header, JSON chunk, BIN chunk. */
function binary(json: object & { buffers?: { uri?: string }[] }, data: Uint8Array): Uint8Array {
  for (const buffer of json.buffers ?? []) delete buffer.uri;
  const padded = (bytes: Uint8Array, fill: number) => {
    const whole = new Uint8Array(Math.ceil(bytes.length / 4) * 4).fill(fill);
    whole.set(bytes);
    return whole;
  };
  const text = padded(new TextEncoder().encode(JSON.stringify(json)), 0x20);
  const body = padded(data, 0);
  const file = new Uint8Array(12 + 8 + text.length + 8 + body.length);
  const view = new DataView(file.buffer);
  const words = [0x46546c67, 2, file.length, text.length, 0x4e4f534a];
  words.forEach((word, idx) => {
    view.setUint32(idx * 4, word, true);
  });
  file.set(text, 20);
  view.setUint32(20 + text.length, body.length, true);
  view.setUint32(24 + text.length, 0x004e4942, true);
  file.set(body, 28 + text.length);
  return file;
}

/** SMPL's joints that the hop turns. */
const SMPL_JOINTS: Record<string, number> = {
  LeftUpLeg: 1,
  RightUpLeg: 2,
  LeftLeg: 4,
  RightLeg: 5,
  LeftFoot: 7,
  RightFoot: 8,
  LeftArm: 16,
  RightArm: 17,
};

/** The hop as SMPL poses in AMASS's world, whose z points up. */
export function hopNpz(): Uint8Array {
  const poses: number[] = [];
  const trans: number[] = [];
  for (let frame = 0; frame < HOP_FRAMES; frame += 1) {
    const { hipCm, degreesOf } = hopAt(frame);
    const pose = new Array<number>(72).fill(0);
    pose[0] = Math.PI / 2;
    for (const [name, joint] of Object.entries(SMPL_JOINTS)) {
      const [z, x] = degreesOf(name);
      pose[3 * joint] = x * RADIANS;
      pose[3 * joint + 2] = z * RADIANS;
    }
    poses.push(...pose);
    trans.push(0, 0, hipCm / 100);
  }
  return zipSync({
    "poses.npy": npy([HOP_FRAMES, 72], poses),
    "trans.npy": npy([HOP_FRAMES, 3], trans),
    "betas.npy": npy([16], new Array<number>(16).fill(0)),
    "mocap_framerate.npy": npy([], [FRAMES_PER_SECOND]),
  });
}

/** NumPy's format, version 1: magic, length of the header, header, little-endian doubles. */
function npy(shape: number[], numbers: number[]): Uint8Array {
  const tuple = shape.length === 1 ? `(${shape[0]},)` : `(${shape.join(", ")})`;
  const described = `{'descr': '<f8', 'fortran_order': False, 'shape': ${tuple}, }`;
  const header = `${described.padEnd(117)}\n`;
  const file = new Uint8Array(10 + header.length + numbers.length * 8);
  file.set([0x93, ...new TextEncoder().encode("NUMPY"), 1, 0, header.length, 0]);
  file.set(new TextEncoder().encode(header), 10);
  const view = new DataView(file.buffer);
  numbers.forEach((number, idx) => {
    view.setFloat64(10 + header.length + idx * 8, number, true);
  });
  return file;
}
