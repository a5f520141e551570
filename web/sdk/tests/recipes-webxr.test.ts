// The recipe for a headset and two controllers.
import type { Avatar, Pose } from "dynaskin";
import { Quaternion, Vector3 } from "three";
import { afterAll, expect, it } from "vitest";
import { degreesOff, jointAt, recipe, Shaking, TICK } from "./recipe-support.js";
import { loadModel } from "./support.js";

const model = await loadModel();

afterAll(() => model.dispose());

interface Transform {
  position: Vector3;
  orientation: Quaternion;
}
const { webxrPose } = await recipe<{
  webxrPose(head: Transform, hands: Vector3[], restJointsM: Float32Array): Pose;
}>("webxr");
const UP = new Vector3(0, 1, 0);
const restAt = (avatar: Avatar, joint: number) =>
  new Vector3().fromArray(avatar.restJointsM(), 3 * joint);

/** A headset that looks along +z, turned by `yawDegrees`, on somebody whose head is there. */
function headset(headAt: Vector3, yawDegrees = 0): Transform {
  const turn = new Quaternion().setFromAxisAngle(UP, (yawDegrees * Math.PI) / 180);
  const eyes = new Vector3(0, 0.07, 0.09).applyQuaternion(turn).add(headAt);
  const orientation = turn.clone().multiply(new Quaternion(0, 1, 0, 0));
  return { position: eyes, orientation };
}

it.each([0, 90, -150])("puts head and wrists where they are, turned by %f degrees", (degrees) => {
  const avatar = model.createAvatar();
  const turn = new Quaternion().setFromAxisAngle(UP, (degrees * Math.PI) / 180);
  const headAt = restAt(avatar, 15).add(new Vector3(1, 0, 2));
  const hands = [new Vector3(0.25, 1.2, 0.3), new Vector3(-0.4, 1.0, 0.1)].map((hand) =>
    hand.applyQuaternion(turn).add(new Vector3(1, 0, 2)),
  );
  avatar.step(webxrPose(headset(headAt, degrees), hands, avatar.restJointsM()), 0);
  expect(jointAt(avatar, "head").distanceTo(headAt)).toBeLessThan(0.001);
  for (const [idx, side] of (["left", "right"] as const).entries()) {
    expect(jointAt(avatar, `${side}_wrist`).distanceTo(hands[idx] ?? headAt)).toBeLessThan(0.001);
  }
  const across = new Vector3(1, 0, 0).applyQuaternion(turn).toArray();
  expect(degreesOff(avatar, "right_hip", "left_hip", across)).toBeLessThan(0.1);
});

it("bends the knees ahead and keeps the feet on the floor where somebody crouches", () => {
  const avatar = model.createAvatar();
  const hands = [new Vector3(0.4, 0.9, 0.2), new Vector3(-0.4, 0.9, 0.2)];
  const headAt = restAt(avatar, 15).add(new Vector3(0, -0.3, 0));
  avatar.step(webxrPose(headset(headAt), hands, avatar.restJointsM()), 0);
  expect(jointAt(avatar, "left_ankle").y).toBeCloseTo(restAt(avatar, 7).y, 3);
  expect(jointAt(avatar, "right_ankle").y).toBeCloseTo(restAt(avatar, 8).y, 3);
  expect(jointAt(avatar, "left_knee").z - restAt(avatar, 4).z).toBeGreaterThan(0.15);
  expect(jointAt(avatar, "pelvis").y).toBeCloseTo(restAt(avatar, 0).y - 0.3, 3);
});

it("reaches for what is too far without breaking the arm", () => {
  const avatar = model.createAvatar();
  const far = [new Vector3(5, 1.3, 0), new Vector3(0, 1.3, 5)];
  avatar.step(webxrPose(headset(restAt(avatar, 15)), far, avatar.restJointsM()), 0);
  expect(degreesOff(avatar, "left_shoulder", "left_wrist", [1, 0, 0])).toBeLessThan(1);
});

it("moves the tissue of somebody who bounces, and lets it rest after", () => {
  const avatar = model.createAvatar();
  const [moving, still] = [new Shaking(avatar), new Shaking(avatar)];
  const hands = [new Vector3(0.4, 0.9, 0.2), new Vector3(-0.4, 0.9, 0.2)];
  for (let tick = 0; tick < 300; tick += 1) {
    const dropM = tick < 150 ? 0.08 * Math.sin((tick / 60) * Math.PI * 2.5) ** 2 : 0;
    const headAt = restAt(avatar, 15).add(new Vector3(0, -dropM, 0));
    avatar.step(webxrPose(headset(headAt), hands, avatar.restJointsM()), tick === 0 ? 0 : TICK);
    if (tick < 150) moving.watch();
    if (tick > 270) still.watch();
  }
  expect(moving.largestM).toBeGreaterThan(0.005);
  expect(still.rmsM).toBeLessThan(1e-5);
});
