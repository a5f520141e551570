import { type Avatar, type Model, Motion, POSE_LENGTH, PROCEDURAL_MOTIONS } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { HOP_FILE_SECONDS, hopFile } from "../../../tests/hop-bvh.js";
import { hopGlb, hopNpz } from "../../../tests/hop-files.js";
import { expectError, loadModel } from "./support.js";

let model: Model;
let avatar: Avatar;

beforeAll(async () => {
  model = await loadModel();
  avatar = model.createAvatar();
});
afterAll(() => {
  avatar.dispose();
  model.dispose();
});

const bytes = (text: string) => new TextEncoder().encode(text);

describe("procedural motions", () => {
  it.each(PROCEDURAL_MOTIONS)("%s gives unit rotations throughout", (name) => {
    const motion = Motion.procedural(name, avatar);
    expect(motion.name).toBe(name);
    expect(motion.durationSeconds).toBeCloseTo(8, 1);
    expect(motion.jointReport).toBeNull();
    const pose = new Float64Array(POSE_LENGTH);
    for (let time = 0; time < motion.durationSeconds; time += 0.37) {
      motion.poseAt(time, pose);
      for (let idx = 3; idx < POSE_LENGTH; idx += 4) {
        expect(Math.hypot(...pose.subarray(idx, idx + 4))).toBeCloseTo(1, 6);
      }
    }
    motion.dispose();
  });

  it("take a tempo, a height and a length", () => {
    const rise = (heightM: number) => {
      const motion = Motion.procedural("hop", avatar, {
        tempoHz: 1.5,
        heightM,
        durationSeconds: 5,
      });
      expect(motion.durationSeconds).toBeCloseTo(5, 1);
      let highest = Number.NEGATIVE_INFINITY;
      for (let time = 0; time < 5; time += 1 / 60) {
        highest = Math.max(highest, motion.poseAt(time)[1] ?? 0);
      }
      return highest;
    };
    expect(rise(0.1) - rise(0.05)).toBeCloseTo(0.05, 2);
  });

  it("refuse to write poses into anything but a Float64Array, and can still be freed", async () => {
    const motion = Motion.procedural("jump", avatar);
    const single = new Float32Array(POSE_LENGTH) as unknown as Float64Array;
    await expectError("argument", () => motion.poseAt(0, single));
    motion.dispose();
    motion.dispose();
  });

  it("refuse what cannot be made", async () => {
    await expectError("argument", () => Motion.procedural("fly" as "hop", avatar));
    await expectError("motion", () => Motion.procedural("hop", avatar, { tempoHz: Number.NaN }));
    await expectError("motion", () => Motion.procedural("hop", avatar, { heightM: 5 }));
    await expectError("motion", () =>
      Motion.procedural("hop", avatar, { tempoHz: 4, heightM: 0.3 }),
    );
  });
});

describe("BVH files", () => {
  it("are carried over to the body, with a report of the joints", () => {
    const motion = Motion.fromBvh(bytes(hopFile()), avatar);
    expect(motion.durationSeconds).toBeCloseTo(HOP_FILE_SECONDS, 1);
    const report = motion.jointReport;
    expect(report?.unit).toBe("centimetres");
    expect(report?.frameSeconds).toBeCloseTo(1 / 60, 5);
    expect(report?.mapped).toContainEqual({ joint: "left_knee", source: "LeftLeg" });
    expect(Math.abs(motion.poseAt(0)[0] ?? 1)).toBeLessThan(0.01);
  });

  const cases: [string, string][] = [
    ["nothing at all", ""],
    ["another text", "Dear reader, this is a letter and no motion."],
    ["a file without a whole frame", hopFile().slice(0, hopFile().indexOf("Frame Time:") + 40)],
    ["a file cut in its skeleton", hopFile().slice(0, 700)],
    ["a number that is none", hopFile().replace("OFFSET 9 -4 0", "OFFSET 9 four 0")],
    ["names that show no person", hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box")],
    ["a frame count without end", hopFile().replace(/Frames: \d+/, "Frames: 99999999999")],
  ];
  it.each(cases)("refuses %s", async (_name, text) => {
    await expectError("motion", () => Motion.fromBvh(bytes(text), avatar));
  });

  it("refuses bytes that are no text", () =>
    expectError("motion", () => Motion.fromBvh(new Uint8Array(5000).fill(0xfe), avatar)));
});

describe("files of any kind", () => {
  /** Largest difference of any joint's height from the BVH file's over the motion, in metres. */
  function fromBvh(motion: Motion): number {
    const expected = Motion.fromBvh(bytes(hopFile()), avatar);
    expect(motion.durationSeconds).toBeCloseTo(expected.durationSeconds, 1);
    let worst = 0;
    for (let time = 0; time < expected.durationSeconds; time += 0.05) {
      const [, got = Number.NaN] = motion.poseAt(time);
      worst = Math.max(worst, Math.abs(got - (expected.poseAt(time)[1] ?? Number.NaN)));
    }
    return worst;
  }

  it("take BVH as fromBvh does", () => {
    expect(fromBvh(Motion.fromFile(bytes(hopFile()), avatar))).toBe(0);
  });

  it.each(["glb", "vrma"] as const)("play the animation of a %s file", async (kind) => {
    const motion = Motion.fromFile(await hopGlb(kind), avatar);
    expect(motion.name).toBe("hop");
    const report = motion.jointReport;
    expect(report?.unit).toBe("metres");
    const knee = kind === "glb" ? "LeftLeg" : "leftLowerLeg";
    expect(report?.mapped).toContainEqual({ joint: "left_knee", source: knee });
    expect(fromBvh(motion)).toBeLessThan(0.001);
  });

  it("play SMPL poses of an npz file", () => {
    const motion = Motion.fromFile(hopNpz(), avatar);
    expect(motion.jointReport).toBeNull();
    // The heights are the file's own there, not scaled to the body's legs.
    expect(fromBvh(motion)).toBeLessThan(0.02);
    // So is the left knee's bend, which fromBvh measures from the body's own, not quite straight knee.
    const expected = Motion.fromBvh(bytes(hopFile()), avatar);
    const knee = 3 + 4 * 4;
    const bent = (from: Motion) => from.poseAt(1)[knee] ?? Number.NaN;
    expect(Math.abs(bent(motion) - bent(expected))).toBeLessThan(0.1);
  });

  it("take joints by the caller's names", async () => {
    const odd = hopFile().replaceAll("LeftUpLeg", "Bone_17");
    await expectError("motion", () => Motion.fromFile(bytes(odd), avatar));
    const joints = { left_hip: "Bone_17" } as const;
    const motion = Motion.fromFile(bytes(odd), avatar, { joints });
    expect(motion.jointReport?.mapped).toContainEqual({ joint: "left_hip", source: "Bone_17" });
    expect(fromBvh(motion)).toBe(0);
    expect(fromBvh(Motion.fromBvh(bytes(odd), avatar, { joints }))).toBe(0);
    const error = await expectError("motion", () =>
      Motion.fromFile(bytes(odd), avatar, { joints: { left_hip: "Bone_18" } }),
    );
    expect(error.message).toContain("Bone_17");
  });

  it("take a rate and an up axis", () => {
    const seconds = Motion.fromFile(bytes(hopFile()), avatar).durationSeconds;
    const slower = Motion.fromFile(bytes(hopFile()), avatar, { rateHz: 30 });
    expect(slower.durationSeconds).toBeCloseTo(2 * seconds, 1);
    const lying = Motion.fromFile(hopNpz(), avatar, { up: "y" });
    const standing = Motion.fromFile(hopNpz(), avatar, { up: "z" });
    expect(lying.poseAt(0)).not.toEqual(standing.poseAt(0));
  });

  it("list and choose animations", async () => {
    const glb = await hopGlb();
    expect(Motion.animations(glb, avatar)).toEqual([
      { name: "hop", seconds: expect.any(Number), movingJoints: expect.any(Number) },
    ]);
    for (const animation of ["hop", 0]) {
      expect(Motion.fromFile(glb, avatar, { animation }).name).toBe("hop");
    }
    for (const animation of ["skip", 1]) {
      const choose = () => Motion.fromFile(glb, avatar, { animation });
      expect((await expectError("motion", choose)).message).toContain("`hop`");
    }
    await expectError("motion", () => Motion.animations(bytes(hopFile()), avatar));
  });

  it("say what was found other than usual", () => {
    expect(Motion.procedural("hop", avatar).notes).toEqual([]);
    const half = hopFile().slice(0, Math.round(hopFile().length * 0.6));
    const motion = Motion.fromFile(bytes(half), avatar);
    expect(motion.notes).toContainEqual(expect.stringContaining("breaks off"));
    expect(motion.jointReport?.notes).toEqual(motion.notes);
  });

  const wrongOptions: [string, "argument" | "motion", unknown][] = [
    ["no object", "argument", 30],
    ["a misspelt option", "argument", { rate: 30 }],
    ["a rate that is no number", "argument", { rateHz: "30" }],
    ["a rate of nothing", "motion", { rateHz: 0 }],
    ["a joint that the body has not", "argument", { joints: { left_wing: "LeftArm" } }],
    ["a joint's name that is no text", "argument", { joints: { left_hip: 3 } }],
    ["joints that are no object", "argument", { joints: "left_hip" }],
    ["an animation between two", "argument", { animation: 0.5 }],
    ["an axis that there is not", "argument", { up: "x" }],
    ["an animation of a BVH file", "motion", { animation: "hop" }],
    ["an up axis of a BVH file", "motion", { up: "y" }],
  ];
  it.each(wrongOptions)("refuse %s", async (_name, code, options) => {
    await expectError(code, () => Motion.fromFile(bytes(hopFile()), avatar, options as object));
  });

  const noMotion: [string, () => Promise<Uint8Array>][] = [
    ["a picture", async () => Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10)],
    ["nothing", async () => new Uint8Array()],
    ["a truncated GLB", async () => (await hopGlb()).slice(0, 2000)],
    ["a truncated npz", async () => hopNpz().slice(0, 2000)],
  ];
  it.each(noMotion)("refuse %s", async (_name, make) => {
    const file = await make();
    await expectError("motion", () => Motion.fromFile(file, avatar));
  });
});

describe("what is too large", () => {
  it("is refused by its size, before it is copied", async () => {
    const poses = new Float64Array(200_001 * POSE_LENGTH);
    const many = await expectError("motion", () => Motion.fromPoses(poses, 60, avatar));
    expect(many.message).toBe("There are 200001 poses; at most 162000 are taken.");
    const file = new Uint8Array(257 * 2 ** 20);
    const large = await expectError("motion", () => Motion.fromFile(file, avatar));
    expect(large.message).toBe("The file has 257 MiB; at most 256 MiB are read.");
  });
});

describe("poseAt", () => {
  it("holds the first and the last pose outside the motion", () => {
    const motion = Motion.procedural("walk", avatar);
    expect(motion.poseAt(-1)).toEqual(motion.poseAt(0));
    expect(motion.poseAt(99)).toEqual(motion.poseAt(motion.durationSeconds));
  });

  it("turns to the front, in place and as a whole", () => {
    const facing = Motion.procedural("walk", avatar);
    const frames = Math.floor(facing.durationSeconds * 60) + 1;
    const [sin, cos] = [Math.sin(2), Math.cos(2)];
    const turnedPoses = new Float64Array(frames * POSE_LENGTH);
    for (let frame = 0; frame < frames; frame += 1) {
      const pose = facing.poseAt(frame / 60);
      const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = pose;
      const [half, rest] = [Math.sin(1), Math.cos(1)];
      pose.set([cos * x + sin * z, y, cos * z - sin * x]);
      pose.set(
        [
          rest * qx + half * qz,
          rest * qy + half * qw,
          rest * qz - half * qx,
          rest * qw - half * qy,
        ],
        3,
      );
      turnedPoses.set(pose, frame * POSE_LENGTH);
    }
    const away = Motion.fromPoses(turnedPoses, 60, avatar, "away");
    expect(away.poseAt(1)).not.toEqual(facing.poseAt(1));
    expect(away.turnToFront()).toBe(away);
    for (const seconds of [0, 0.5, 1.234, 7]) {
      const [got, wanted] = [away.poseAt(seconds), facing.turnToFront().poseAt(seconds)];
      for (const [idx, value] of wanted.entries()) expect(got[idx]).toBeCloseTo(value, 6);
    }
    facing.dispose();
    expect(() => facing.turnToFront()).toThrow("after dispose()");
  });

  it("tells which procedural motion poses resemble", () => {
    for (const name of ["jump", "walk", "twist"] as const) {
      const made = Motion.procedural(name, avatar, { tempoHz: name === "jump" ? 0.4 : 1.5 });
      const poses = new Float64Array(7 * 60 * POSE_LENGTH);
      for (let frame = 0; frame < 7 * 60; frame += 1) {
        poses.set(made.poseAt(0.6 + frame / 60), frame * POSE_LENGTH);
      }
      const motion = Motion.fromPoses(poses, 60, avatar, "unnamed");
      expect(motion.nearestProcedural(avatar)).toBe(name);
      motion.dispose();
      expect(() => motion.nearestProcedural(avatar)).toThrow("after dispose()");
      expect(() => made.nearestProcedural({} as Avatar)).toThrow("avatar");
    }
  });

  it("refuses an array of the wrong length, and use after dispose", async () => {
    const motion = Motion.procedural("walk", avatar);
    await expectError("argument", () => motion.poseAt(0, new Float64Array(3)));
    motion.dispose();
    motion.dispose();
    await expectError("disposed", () => motion.poseAt(0));
  });
});
