// The recipe for a webcam, on what a camera sees of a body whose true pose is known.
import { type Avatar, JOINT_NAMES, type JointName, Motion, type Pose, restPose } from "dynaskin";
import { Quaternion, Vector3 } from "three";
import { afterAll, describe, expect, it } from "vitest";
import { degreesOff, jointAt, randomNumbers, recipe, Shaking, TICK } from "./recipe-support.js";
import { loadModel } from "./support.js";

const model = await loadModel();

afterAll(() => model.dispose());

describe("mediapipe", async () => {
  interface Point {
    x: number;
    y: number;
    z: number;
  }
  interface Result {
    worldLandmarks: Point[][];
    landmarks: Point[][];
  }
  const { mediapipePose } = await recipe<{
    mediapipePose(result: Result, first: Result, restJointsM: Float32Array, aspect: number): Pose;
  }>("mediapipe");
  const ASPECT = 4 / 3;
  const LANDMARKS = new Map<number, JointName>();
  for (const [left, part] of [
    [11, "shoulder"],
    [13, "elbow"],
    [15, "wrist"],
    [23, "hip"],
    [25, "knee"],
    [27, "ankle"],
  ] as const) {
    LANDMARKS.set(left, `left_${part}`).set(left + 1, `right_${part}`);
  }

  /** What a camera 3.4 m before a body in this pose sees, with `noise` on every number; legs without depth. */
  function seen(truth: Avatar, pose: Pose, noise: () => number = () => 0): Result {
    truth.step(pose, 0);
    const hips = jointAt(truth, "left_hip").lerp(jointAt(truth, "right_hip"), 0.5);
    const [world, picture]: Point[][] = [[], []];
    for (let landmark = 0; landmark < 33; landmark += 1) {
      const at = jointAt(truth, LANDMARKS.get(landmark) ?? "head");
      at.add(new Vector3(noise(), noise(), noise()));
      const enlarged = 1.3 / (3.4 - at.z);
      picture?.push({
        x: 0.5 + (at.x * enlarged) / ASPECT,
        y: 0.5 - (at.y - 0.9) * enlarged,
        z: 0,
      });
      const { x, y, z } = at.sub(hips);
      world?.push({ x, y: -y, z: landmark > 24 ? 0 : -z });
    }
    return { worldLandmarks: [world ?? []], landmarks: [picture ?? []] };
  }

  const turned = (turns: Partial<Record<JointName, [Vector3, number]>>) => {
    const pose = restPose();
    for (const [name, [axis, degrees]] of Object.entries(turns)) {
      const turn = new Quaternion().setFromAxisAngle(axis, (degrees * Math.PI) / 180);
      turn.toArray(pose, 3 + 4 * JOINT_NAMES.indexOf(name as JointName));
    }
    return pose;
  };
  const [X, Y, Z] = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];

  /** Degrees by which the worst of the limbs of two avatars differ. */
  function worstLimb(a: Avatar, b: Avatar, parts: readonly (readonly [string, string])[]): number {
    const sides = ["left", "right"].flatMap((side) =>
      parts.map(([from, to]) => [`${side}_${from}`, `${side}_${to}`] as [JointName, JointName]),
    );
    return Math.max(
      ...sides.map(([from, to]) =>
        degreesOff(a, from, to, jointAt(b, to).sub(jointAt(b, from)).toArray()),
      ),
    );
  }
  const ARMS = [
    ["shoulder", "elbow"],
    ["elbow", "wrist"],
  ] as const;
  const LEGS = [
    ["hip", "knee"],
    ["knee", "ankle"],
  ] as const;

  it("turns trunk and arms as the person has them", () => {
    const [truth, avatar] = [model.body.createAvatar(), model.createAvatar()];
    const first = seen(truth, restPose());
    const pose = turned({
      pelvis: [Y, 20],
      spine2: [Y, -35],
      left_shoulder: [Z, 80],
      left_elbow: [Y, -60],
      right_shoulder: [X, -70],
      right_elbow: [X, -40],
    });
    avatar.step(mediapipePose(seen(truth, pose), first, avatar.restJointsM(), ASPECT), 0);
    expect(worstLimb(avatar, truth, ARMS)).toBeLessThan(1);
    const across = jointAt(truth, "left_hip").sub(jointAt(truth, "right_hip"));
    // The line from hips to shoulders counts as the trunk's up; at rest it leans by two degrees.
    expect(degreesOff(avatar, "right_hip", "left_hip", across.toArray())).toBeLessThan(2);
  });

  it.each([0, 20, 45, 70])("finds thighs that bend by %f degrees towards the camera", (degrees) => {
    const [truth, avatar] = [model.body.createAvatar(), model.createAvatar()];
    const first = seen(truth, restPose());
    const pose = turned({
      left_hip: [X, -degrees],
      right_hip: [X, -degrees],
      left_knee: [X, 2 * degrees],
      right_knee: [X, 2 * degrees],
    });
    pose[1] = -0.77 * (1 - Math.cos((degrees * Math.PI) / 180));
    const result = seen(truth, pose);
    const found = mediapipePose(result, first, avatar.restJointsM(), ASPECT);
    avatar.step(found, 0);
    // The camera enlarges knees that come near, and 2 % of each length count as noise.
    expect(worstLimb(avatar, truth, LEGS)).toBeLessThan(15);
    expect(Math.abs((found[1] ?? Number.NaN) - pose[1])).toBeLessThan(0.02);
  });

  it("moves the tissue of somebody who hops, and hardly that of somebody who stands", () => {
    const shaking = (poseSource: "tracker" | "as-given", hops: boolean) => {
      const [truth, avatar] = [model.body.createAvatar(), model.createAvatar({ poseSource })];
      const motion = Motion.procedural("hop", truth);
      const random = randomNumbers(3);
      // As a tracker's own smoothing leaves it: 1.5 mm that wander slowly.
      const wandering = new Float64Array(99);
      let number = 0;
      const noise = () => {
        const idx = number++ % wandering.length;
        const fresh = 2 * (random() + random() + random() - 1.5);
        wandering[idx] = 0.97 * (wandering[idx] ?? 0) + 0.0015 * Math.sqrt(1 - 0.97 ** 2) * fresh;
        return wandering[idx] ?? 0;
      };
      const first = seen(truth, restPose());
      const shaken = new Shaking(avatar);
      let pose = restPose();
      for (let tick = 0; tick < 240; tick += 1) {
        const truePose = hops ? motion.poseAt(tick / 60) : restPose();
        if (tick % 2 === 0) {
          pose = mediapipePose(seen(truth, truePose, noise), first, avatar.restJointsM(), ASPECT);
        }
        avatar.step(pose, tick === 0 ? 0 : TICK);
        if (tick > 120) shaken.watch();
      }
      motion.dispose();
      return shaken;
    };
    const [hop, still, raw] = [
      shaking("tracker", true),
      shaking("tracker", false),
      shaking("as-given", false),
    ];
    expect(hop.largestM).toBeGreaterThan(0.01);
    expect(still.rmsM).toBeLessThan(0.2 * raw.rmsM);
    expect(still.largestM).toBeLessThan(0.003);
  });
});
