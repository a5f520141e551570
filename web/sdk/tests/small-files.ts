// Small motion files that ask for much: what is declared in them, and not their size, makes the work.
import { zipSync } from "fflate";

/** A name, the bytes when they are asked for, and whether such a file is refused or read. */
export interface SmallFile {
  name: string;
  bytes: () => Uint8Array;
  outcome: "refused" | "read";
}

/** `.npy` of zeros; `float` has 4 or 8 bytes. */
function zeros(shape: number[], float = 8): Uint8Array {
  const count = shape.reduce((product, length) => product * length, 1);
  return npy(shape, `<f${float}`, new Uint8Array(count * float));
}

function npy(shape: number[], type: string, data: Uint8Array): Uint8Array {
  const lengths = shape.length === 1 ? `${shape[0]},` : shape.join(", ");
  const text = `{'descr': '${type}', 'fortran_order': False, 'shape': (${lengths}), }`;
  const header = text.padEnd(117, " ").concat("\n");
  const bytes = new Uint8Array(10 + header.length + data.length);
  bytes.set([0x93, ...new TextEncoder().encode("NUMPY"), 1, 0, header.length, 0]);
  bytes.set(new TextEncoder().encode(header), 10);
  bytes.set(data, 10 + header.length);
  return bytes;
}

function rate(hz: number): Uint8Array {
  return npy([], "<f8", new Uint8Array(Float64Array.of(hz).buffer));
}

/** Poses as AMASS has them, all zero. */
function amass(frames: number, width: number, float: number, hz: number, more = {}): Uint8Array {
  return zipSync({
    "poses.npy": zeros([frames, width], float),
    "trans.npy": zeros([frames, 3], float),
    "mocap_framerate.npy": rate(hz),
    ...more,
  });
}

interface Limb {
  name: string;
  offset: [number, number, number];
  children?: Limb[];
}

const side = (name: string, x: number): Limb[] => [
  {
    name: `${name}UpLeg`,
    offset: [x, -5, 0],
    children: [
      {
        name: `${name}Leg`,
        offset: [0, -40, 0],
        children: [{ name: `${name}Foot`, offset: [0, -40, 0] }],
      },
    ],
  },
];

const arm = (name: string, x: number): Limb => ({
  name: `${name}Arm`,
  offset: [x, 10, 0],
  children: [
    {
      name: `${name}ForeArm`,
      offset: [x, 0, 0],
      children: [{ name: `${name}Hand`, offset: [x, 0, 0] }],
    },
  ],
});

/** A figure of centimetres; `between` joints stand between pelvis and chest, `beside` under the pelvis. */
function figure(between: number, beside: number, nameOf = (idx: number) => `x${idx}`): Limb {
  const chest: Limb = {
    name: "Chest",
    offset: [0, 20, 0],
    children: [
      arm("Left", 20),
      arm("Right", -20),
      { name: "Neck", offset: [0, 20, 0], children: [{ name: "Head", offset: [0, 10, 0] }] },
    ],
  };
  let trunk = chest;
  for (let idx = 0; idx < between; idx += 1) {
    trunk = { name: `between${idx}`, offset: [0, 0.1, 0], children: [trunk] };
  }
  const others = Array.from({ length: beside }, (_, idx): Limb => {
    return { name: nameOf(idx), offset: [0, 1, 0] };
  });
  return {
    name: "Hips",
    offset: [0, 90, 0],
    children: [...side("Left", 10), ...side("Right", -10), trunk, ...others],
  };
}

/** A BVH file whose root alone has a channel, so that a frame takes two bytes. */
function bvh(root: Limb, frames: number, seconds: string): Uint8Array {
  const lines = ["HIERARCHY"];
  const open: (Limb | "}")[] = [root];
  while (open.length > 0) {
    const limb = open.pop() as Limb | "}";
    if (limb === "}") {
      lines.push("}");
      continue;
    }
    lines.push(`${limb === root ? "ROOT" : "JOINT"} ${limb.name}`, "{");
    lines.push(`OFFSET ${limb.offset.join(" ")}`);
    if (limb === root) lines.push("CHANNELS 1 Xrotation");
    open.push("}", ...(limb.children ?? []));
  }
  const head = `${lines.join("\n")}\nMOTION\nFrames: ${frames}\nFrame Time: ${seconds}\n`;
  return new TextEncoder().encode(head + "0\n".repeat(frames));
}

/** Binary glTF of a document and floats. */
function glb(document: object, floats: number[]): Uint8Array {
  const binary = new Uint8Array(Float32Array.from(floats).buffer);
  const text = new TextEncoder().encode(
    JSON.stringify({
      asset: { version: "2.0" },
      buffers: [{ byteLength: binary.length }],
      bufferViews: [{ buffer: 0, byteLength: binary.length }],
      ...document,
    }),
  );
  const padded = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(32);
  padded.set(text);
  const bytes = new Uint8Array(28 + padded.length + binary.length);
  const view = new DataView(bytes.buffer);
  const numbers = [0x46546c67, 2, bytes.length, padded.length, 0x4e4f534a];
  for (const [idx, number] of numbers.entries()) view.setUint32(idx * 4, number, true);
  bytes.set(padded, 20);
  view.setUint32(20 + padded.length, binary.length, true);
  view.setUint32(24 + padded.length, 0x004e4942, true);
  bytes.set(binary, 28 + padded.length);
  return bytes;
}

/** The nodes of a figure, in metres. */
function nodesOf(root: Limb): object[] {
  const nodes: { name: string; translation: number[]; children?: number[] }[] = [];
  const open: { limb: Limb; parent: number | null }[] = [{ limb: root, parent: null }];
  while (open.length > 0) {
    const { limb, parent } = open.pop() as { limb: Limb; parent: number | null };
    const own = nodes.length;
    nodes.push({ name: limb.name, translation: limb.offset.map((cm) => cm / 100) });
    if (parent !== null) (nodes[parent] as { children?: number[] }).children ??= [];
    if (parent !== null) nodes[parent]?.children?.push(own);
    open.push(...(limb.children ?? []).map((child) => ({ limb: child, parent: own })));
  }
  return nodes;
}

/** An animation of `keys` keys over `seconds`, whose channels all name the same numbers. */
function animated(root: Limb, keys: number, seconds: number, channels: number, copies = 1) {
  const nodes = nodesOf(root);
  const times = Array.from({ length: keys }, (_, key) => (key / (keys - 1)) * seconds);
  const turns = Array.from({ length: keys }, (_, key) => [0, key % 2, 0, 1]).flat();
  const accessor = (byteOffset: number, type: string) => {
    return { bufferView: 0, byteOffset, componentType: 5126, count: keys, type };
  };
  const animation = {
    samplers: [{ input: 0, output: 1 }],
    channels: Array.from({ length: channels }, (_, idx) => {
      return { sampler: 0, target: { node: idx % nodes.length, path: "rotation" } };
    }),
  };
  const document = {
    nodes,
    accessors: [accessor(0, "SCALAR"), accessor(keys * 4, "VEC4")],
    animations: Array.from({ length: copies }, () => animation),
  };
  return glb(document, [...times, ...turns]);
}

const HOUR_NEARLY_SECONDS = 2_990;

/** Files of at most about a megabyte. */
export function smallFiles(): SmallFile[] {
  const read = (name: string, bytes: () => Uint8Array): SmallFile => {
    return { name, bytes, outcome: "read" };
  };
  const refused = (name: string, bytes: () => Uint8Array): SmallFile => {
    return { name, bytes, outcome: "refused" };
  };
  const glued = (idx: number) => `${"upper".repeat(5)}${"lower".repeat(2)}${idx.toString(26)}q`;
  return [
    refused("npz, 238 MB of zeros in 0.2 MB", () => amass(180_000, 165, 8, 60)),
    read("npz, 50 minutes of SMPL in single precision", () => amass(180_000, 72, 4, 60)),
    read("npz, 49 minutes that are resampled", () => amass(180_000, 66, 4, 61)),
    read("npz, columns that are not needed", () =>
      amass(1_000, 66, 8, 60, {
        "dmpls.npy": zeros([1_000, 100_000], 4).subarray(0, 2_000_000),
        "marker_data.npy": zeros([20_000_000], 4),
      }),
    ),
    refused("npz, a billion frames declared", () => amassOfHeader("(1000000000, 66)")),
    read("BVH, 50 minutes of one channel", () => bvh(figure(0, 900), 180_000, "0.0166667")),
    read("BVH, 49 minutes that are resampled", () => bvh(figure(0, 0), 180_000, "0.0164")),
    refused("BVH, a chain of 900 joints", () => bvh(figure(900, 0), 180_000, "0.0166667")),
    read("BVH, a name of 0.9 MB", () =>
      bvh(
        figure(0, 1, () => "left a ".repeat(130_000)),
        10,
        "0.02",
      ),
    ),
    read("glTF, two keys 50 minutes apart", () =>
      animated(figure(0, 4_000), 2, HOUR_NEARLY_SECONDS, 1),
    ),
    refused("glTF, two keys 50 minutes apart on a chain of 4,000", () =>
      animated(figure(4_000, 0), 2, HOUR_NEARLY_SECONDS, 1),
    ),
    refused("glTF, 7,000 channels of the same 20,000 keys", () =>
      animated(figure(0, 7_000), 20_000, 300, 7_000),
    ),
    refused("glTF, 10,000 animations of the same keys", () =>
      animated(figure(0, 0), 10_000, 300, 1, 10_000),
    ),
    refused("glTF, 330,000 empty materials", () =>
      glb({ materials: Array.from({ length: 330_000 }, () => ({})) }, [0]),
    ),
    read("glTF, 8,000 names of known words", () => animated(figure(0, 8_000, glued), 2, 1, 1)),
  ];
}

function amassOfHeader(shape: string): Uint8Array {
  const poses = zeros([10, 66]);
  const text = new TextDecoder("latin1").decode(poses).replace("(10, 66)        ", shape);
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  return zipSync({ "poses.npy": bytes, "trans.npy": zeros([10, 3]), "fps.npy": rate(60) });
}

/** Half an hour and more of glTF, in a small file: it takes a second or so to read. */
export function longFile(): Uint8Array {
  return animated(figure(0, 10), 2, HOUR_NEARLY_SECONDS, 1);
}
