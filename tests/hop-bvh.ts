// A motion capture file made by formula: a T-posed figure that stands, hops three times and stands
// still again. In centimetres, with the joint names of the CMU files.

export type Vector = [number, number, number];
/** A bone of the figure. */
export interface Bone {
  name: string;
  offset: Vector;
  children?: Bone[];
  end?: Vector;
}

function leg(side: "Left" | "Right", sign: number): Bone {
  return {
    name: `${side}UpLeg`,
    offset: [sign * 9, -4, 0],
    children: [
      {
        name: `${side}Leg`,
        offset: [0, -42, 0],
        children: [{ name: `${side}Foot`, offset: [0, -41, 0], end: [0, -6, 14] }],
      },
    ],
  };
}

function arm(side: "Left" | "Right", sign: number): Bone {
  return {
    name: `${side}Shoulder`,
    offset: [sign * 3, 20, 0],
    children: [
      {
        name: `${side}Arm`,
        offset: [sign * 14, 0, 0],
        children: [
          {
            name: `${side}ForeArm`,
            offset: [sign * 27, 0, 0],
            children: [{ name: `${side}Hand`, offset: [sign * 25, 0, 0], end: [sign * 9, 0, 0] }],
          },
        ],
      },
    ],
  };
}

/** The figure. */
export const SKELETON: Bone = {
  name: "Hips",
  offset: [0, 0, 0],
  children: [
    leg("Left", 1),
    leg("Right", -1),
    {
      name: "Spine",
      offset: [0, 10, 0],
      children: [
        {
          name: "Spine1",
          offset: [0, 16, 0],
          children: [
            {
              name: "Neck",
              offset: [0, 24, 0],
              children: [{ name: "Head", offset: [0, 9, 2], end: [0, 16, 0] }],
            },
            arm("Left", 1),
            arm("Right", -1),
          ],
        },
      ],
    },
  ],
};

export const FRAMES_PER_SECOND = 60;
const STAND_SECONDS = 0.8;
const HOPS = 3;
const HOP_SECONDS = 0.62;
const FLIGHT_SECONDS = 0.3;
const SETTLE_SECONDS = 2.4;
const GRAVITY_CM = 981;
const STANDING_HIP_CM = 93;

/** Length of the motion in seconds. */
export const HOP_FILE_SECONDS = STAND_SECONDS + HOPS * HOP_SECONDS + SETTLE_SECONDS;

/** Number of frames. */
export const HOP_FRAMES = Math.round(HOP_FILE_SECONDS * FRAMES_PER_SECOND) + 1;

/** Rise of the hips over standing at a time, in centimetres: a dip on the floor, a parabola above. */
function rise(time: number): number {
  const since = time - STAND_SECONDS;
  if (since < 0 || since >= HOPS * HOP_SECONDS) return 0;
  const contact = HOP_SECONDS - FLIGHT_SECONDS;
  const within = since % HOP_SECONDS;
  const takeOff = (GRAVITY_CM * FLIGHT_SECONDS) / 2;
  if (within >= contact) {
    const air = within - contact;
    return takeOff * air - (GRAVITY_CM * air * air) / 2;
  }
  // Meets the flight's speed at take-off and landing.
  return -((takeOff * contact) / Math.PI) * Math.sin((Math.PI * within) / contact);
}

/** Bend of the knee in degrees that shortens the legs by as much as the hips sink. */
function kneeDegrees(riseCm: number): number {
  const legCm = 83;
  const shorter = Math.min(0, riseCm);
  return (2 * Math.acos((legCm + shorter) / legCm) * 180) / Math.PI;
}

/** Angles of a bone about z, x and y in degrees. */
function rotation(name: string, riseCm: number): Vector {
  const knee = kneeDegrees(riseCm);
  if (name.endsWith("UpLeg")) return [0, -knee / 2, 0];
  if (name.endsWith("Leg")) return [0, knee, 0];
  if (name.endsWith("Foot")) return [0, -knee / 2, 0];
  if (name === "LeftArm") return [-65, 0, 0];
  if (name === "RightArm") return [65, 0, 0];
  return [0, 0, 0];
}

/** Height of the hips in centimetres and the angles of each bone at a frame. */
export function hopAt(frame: number): { hipCm: number; degreesOf: (name: string) => Vector } {
  const riseCm = rise(frame / FRAMES_PER_SECOND);
  return { hipCm: STANDING_HIP_CM + riseCm, degreesOf: (name) => rotation(name, riseCm) };
}

/** The file's text; the body faces so many degrees to its left of +Z. */
export function hopFile(turnDegrees = 0): string {
  const names: string[] = [];
  const joint = (bone: Bone, depth: number): string => {
    const tab = "\t".repeat(depth);
    const root = depth === 0;
    names.push(bone.name);
    const channels = root
      ? "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
      : "CHANNELS 3 Zrotation Xrotation Yrotation";
    const end = bone.end
      ? `${tab}\tEnd Site\n${tab}\t{\n${tab}\t\tOFFSET ${bone.end.join(" ")}\n${tab}\t}\n`
      : "";
    return (
      `${tab}${root ? "ROOT" : "JOINT"} ${bone.name}\n${tab}{\n` +
      `${tab}\tOFFSET ${bone.offset.join(" ")}\n${tab}\t${channels}\n` +
      (bone.children ?? []).map((child) => joint(child, depth + 1)).join("") +
      `${end}${tab}}\n`
    );
  };
  const hierarchy = joint(SKELETON, 0);
  const frames = Array.from({ length: HOP_FRAMES }, (_, frame) => {
    const { hipCm, degreesOf } = hopAt(frame);
    const turned = (name: string): Vector =>
      name === SKELETON.name ? [0, 0, turnDegrees] : degreesOf(name);
    return [0, hipCm, 0, ...names.flatMap(turned)].map((value) => +value.toFixed(4)).join(" ");
  });
  const time = (1 / FRAMES_PER_SECOND).toFixed(8);
  return `HIERARCHY\n${hierarchy}MOTION\nFrames: ${HOP_FRAMES}\nFrame Time: ${time}\n${frames.join("\n")}\n`;
}
