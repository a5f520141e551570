// Motion files dropped on the page.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import type { RegionName } from "dynaskin";
import type {} from "../../web/demo/src/hook.js";
import { hopFile } from "../hop-bvh.js";
import { hopGlb, hopNpz } from "../hop-files.js";
import { SHARED } from "./places.js";
import { differing, dropFile, openDemo, picture, test } from "./support.js";

const REGIONS: RegionName[] = ["chest", "belly", "buttocks", "thighs", "calves", "upper-arms"];

/** What happened to the skin while a file was played to its end. */
interface Played {
  /** Largest offset of each tick, in metres. */
  largestM: number[];
  /** Per region, the largest offset of its vertices (weights over 0.5) in the whole motion. */
  regionsM: Record<RegionName, number>;
  /** Largest offset of the skull over the whole motion. */
  skullM: number;
  /** Largest offset three seconds after the motion stood still. */
  settledM: number;
  /** Largest change of an offset during the last of these seconds. */
  driftM: number;
  /** Largest offset after five seconds in the rest pose. */
  restM: number;
}

/**
 * Steps through the whole motion, then holds its last pose for three seconds and stands in the
 * rest pose for five.
 */
function playToTheEnd(page: Page): Promise<Played> {
  return page.evaluate((regionNames) => {
    const demo = window.dynaskinDemo;
    const body = demo?.model?.body;
    const avatar = demo?.avatar;
    if (!demo || !body || !avatar) throw new Error("the demo is not ready");
    const head = 15;
    const skull = [...Array(body.vertexCount).keys()].filter((vertex) =>
      [0, 1, 2, 3].some(
        (slot) =>
          body.skinJoints[vertex * 4 + slot] === head &&
          (body.skinWeights[vertex * 4 + slot] ?? 0) > 0.99,
      ),
    );
    if (skull.length < 50) throw new Error(`only ${skull.length} vertices on the skull`);
    const sizeAt = (vertex: number) => {
      const [x = 0, y = 0, z = 0] = avatar.offsets.subarray(vertex * 3, vertex * 3 + 3);
      return Math.hypot(x, y, z);
    };
    const largest = (vertices: Iterable<number>) => {
      let size = 0;
      for (const vertex of vertices) size = Math.max(size, sizeAt(vertex));
      return size;
    };
    const all = [...Array(body.vertexCount).keys()];
    const regions = regionNames.map((name) => {
      const weights = body.regionWeights(name);
      return { name, vertices: all.filter((vertex) => (weights[vertex] ?? 0) > 0.5), sizeM: 0 };
    });
    demo.seek(0);
    const largestM: number[] = [];
    let skullM = 0;
    const ticks = Math.floor(demo.durationSeconds * 60) - 1;
    for (let tick = 0; tick < ticks; tick += 1) {
      demo.step();
      largestM.push(largest(all));
      skullM = Math.max(skullM, largest(skull));
      for (const region of regions) {
        region.sizeM = Math.max(region.sizeM, largest(region.vertices));
      }
    }
    if (demo.rounds !== 0) throw new Error("the motion started again too early");
    for (let tick = 0; tick < 120; tick += 1) demo.hold();
    const before = avatar.offsets.slice();
    for (let tick = 0; tick < 60; tick += 1) demo.hold();
    let driftM = 0;
    avatar.offsets.forEach((value, idx) => {
      driftM = Math.max(driftM, Math.abs(value - (before[idx] ?? Number.NaN)));
    });
    const settledM = largest(all);
    demo.standAtRest(5);
    const regionsM = Object.fromEntries(regions.map(({ name, sizeM }) => [name, sizeM]));
    return {
      ...{ largestM, skullM, settledM, driftM, restM: largest(all) },
      regionsM: regionsM as Record<RegionName, number>,
    };
  }, REGIONS);
}

/** Pictures with dynamics off and on at the tick with the largest offset. */
async function compareAtPeak(page: Page, largestM: number[], name: string): Promise<number> {
  const peak = largestM.indexOf(Math.max(...largestM));
  const show = async (dynamics: boolean) => {
    await page.evaluate(
      ([time, on]) => {
        const demo = window.dynaskinDemo;
        if (demo?.avatar) demo.avatar.strength = on ? 1 : 0;
        demo?.seek(time);
      },
      [(peak + 1) / 60, dynamics] as const,
    );
    return picture(page, `${name}-${dynamics ? "on" : "off"}`);
  };
  const off = await show(false);
  const on = await show(true);
  return differing(off, on, 10);
}

type Ranges = Partial<Record<RegionName, [min: number, max: number]>>;

/** `rangesM`: between which sizes a region's largest offset must lie, in metres. */
async function expectRealTissue(page: Page, name: string, rangesM: Ranges): Promise<void> {
  const { largestM, regionsM, skullM, settledM, driftM, restM } = await playToTheEnd(page);
  const peakM = Math.max(...largestM);
  const millimetres = (metres: number) => `${(metres * 1000).toFixed(2)} mm`;
  console.log(
    `${name}: peak ${millimetres(peakM)}, settled at ${millimetres(settledM)}, ` +
      `drift ${millimetres(driftM)}, in the rest pose ${(restM * 1000).toExponential(1)} mm; ` +
      REGIONS.map((region) => `${region} ${millimetres(regionsM[region])}`).join(", "),
  );
  for (const [region, [min, max]] of Object.entries(rangesM)) {
    expect(regionsM[region as RegionName], region).toBeGreaterThan(min);
    expect(regionsM[region as RegionName], region).toBeLessThan(max);
  }
  expect(peakM).toBeGreaterThan(0.01);
  expect(peakM).toBeLessThan(0.15);
  expect(skullM).toBe(0);
  // Zero is the rest pose's; in the file's last pose gravity pulls limbs and trunk another way: the
  // simulator ends the captured jump with 8 to 16 mm at the arm pits.
  expect(driftM).toBeLessThan(1e-4);
  expect(settledM).toBeLessThan(0.016);
  expect(restM).toBeLessThanOrEqual(1e-5);
  expect(await compareAtPeak(page, largestM, name)).toBeGreaterThan(0.002);
}

test("a BVH file plays, moves soft tissue and leaves the skull alone", async ({ page }) => {
  await openDemo(page, "?backend=webgl2");
  await dropFile(page, "three hops.bvh", hopFile());
  await expect(page.locator("#now-playing")).toContainText("three hops.bvh");
  await expect(page.locator("#file-report")).toContainText("centimetres");
  await expect(page.locator("#file-report")).toContainText("LeftUpLeg");
  await expectRealTissue(page, "own-hop", { chest: [0.01, 0.15] });
});

test("a link to a file plays the motion that is nearest to it", async ({ page }) => {
  await openDemo(page, "?motion=twist&tempo=1.4");
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await dropFile(page, "three hops.bvh", hopFile());
  await expect(page.locator("#now-playing")).toContainText("three hops.bvh");
  await page.locator("#link-copy").click();
  await expect(page.locator("#toasts")).toContainText(/three hops.bvh stays .* plays Hop instead/);
  const link = new URL(await page.evaluate(() => navigator.clipboard.readText()));
  expect(link.searchParams.get("motion")).toBe("hop");
  expect(link.searchParams.get("tempo")).toBeNull();
});

test("a captured jump plays, moves soft tissue and leaves the skull alone", async ({ page }) => {
  const file = join(SHARED, "mocap", "train", "16_04.bvh");
  test.skip(!existsSync(file), "needs ../shared/mocap/train/16_04.bvh");
  await openDemo(page, "?backend=webgl2");
  await dropFile(page, "16_04.bvh", readFileSync(file, "utf8"));
  await expect(page.locator("#now-playing")).toContainText("16_04.bvh");
  await expectRealTissue(page, "captured-jump", {
    chest: [0.01, 0.15],
    belly: [0.005, 0.15],
    buttocks: [0.01, 0.15],
    thighs: [0.002, 0.04],
    calves: [0, 0.015],
    "upper-arms": [0, 0.15],
  });
});

test("files of other kinds play the same hop: GLB, VRMA and AMASS npz", async ({
  reused: page,
}) => {
  const problems = await openDemo(page);
  const report = page.locator("#file-report");
  /** Heights of the pelvis over its rest pose, at moments of the hop, in metres. */
  const heights = () =>
    page.evaluate(() => {
      const demo = window.dynaskinDemo;
      return [0, 0.5, 1, 1.5, 2].map((time) => {
        demo?.seek(time);
        return demo?.avatar?.skinMatrices[13] ?? Number.NaN; // up, of the pelvis
      });
    });
  await dropFile(page, "hop.bvh", hopFile());
  await expect(page.locator("#now-playing")).toContainText("hop.bvh");
  const expected = await heights();
  expect(Math.max(...expected) - Math.min(...expected)).toBeGreaterThan(0.05);
  const files: [string, Uint8Array, RegExp, string | null][] = [
    ["hop.glb", await hopGlb("glb"), /Animation “hop”, 5\.1 s at 60 Hz, in metres/, "LeftLeg"],
    ["hop.vrma", await hopGlb("vrma"), /21 of 24|2\d of 24 joints/, "leftLowerLeg"],
    ["hop.npz", hopNpz(), /5\.1 s of SMPL poses/, null],
  ];
  for (const [name, bytes, says, joint] of files) {
    await dropFile(page, name, bytes);
    await expect(page.locator("#now-playing")).toContainText(name);
    await expect(report).toContainText(says);
    if (joint) await expect(report).toContainText(joint);
    const got = await heights();
    got.forEach((height, idx) => {
      expect(Math.abs(height - (expected[idx] ?? Number.NaN)), `${name} ${idx}`).toBeLessThan(0.02);
    });
  }
  expect(problems).toEqual([]);
});

test("a file chosen with the button plays", async ({ reused: page }) => {
  await openDemo(page, "?view=side&motion=twist&caption=1");
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Open a motion file" }).click();
  await (await chooser).setFiles({
    name: "chosen.bvh",
    mimeType: "text/plain",
    buffer: Buffer.from(hopFile()),
  });
  await expect(page.locator("#now-playing")).toContainText("chosen.bvh");
  // Of a file it is not known whether feet land in it.
  await expect(page.locator("#caption")).toContainText("as the body turns back or stops");
});

/** A file whose first frame is another file's, as one of a calibration is. */
function beginningAs(other: string, text: string): string {
  const frames = (file: string) => file.slice(file.indexOf("\n", file.indexOf("Frame Time:")) + 1);
  const [own, first] = [frames(text), frames(other)];
  return text.replace(own, first.slice(0, first.indexOf("\n")) + own.slice(own.indexOf("\n")));
}

for (const [what, text] of [
  ["180° away", hopFile(180)],
  ["90° away", hopFile(90)],
  ["180° away after a frame of calibration", beginningAs(hopFile(), hopFile(180))],
] as const) {
  test(`a file whose body faces ${what} is seen from the front, in a row from left to right`, async ({
    reused: page,
  }) => {
    await openDemo(page, "?view=side&motion=twist");
    await dropFile(page, "turned.bvh", text);
    await expect(page.locator("#now-playing")).toContainText("turned.bvh");
    // 1: the camera looks into the face; -1: at the back.
    const seen = () =>
      page.evaluate(() => {
        const demo = window.dynaskinDemo;
        if (!demo?.avatar) throw new Error("the demo is not ready");
        demo.seek(0.6);
        const [faceX = 0, , faceZ = 0] = demo.avatar.skinMatrices.subarray(8, 11);
        const [awayX, , awayZ] = demo.view.camera.awayM;
        const middles = demo.bodiesPx.map(({ left, right }) => (left + right) / 2);
        return { front: -(faceX * awayX + faceZ * awayZ), middles };
      });
    const turned = await seen();
    await picture(page, `turned-${what}`);
    expect(turned.front).toBeGreaterThan(0.8);
    expect((turned.middles[1] ?? 0) - (turned.middles[0] ?? 0)).toBeGreaterThan(80);
    await page.getByRole("combobox", { name: "Motion" }).selectOption("jump");
    await expect(page.locator("#now-playing")).toContainText("Jump");
    const after = await seen();
    expect(after.front).toBeGreaterThan(0.8);
    expect((after.middles[1] ?? 0) - (after.middles[0] ?? 0)).toBeGreaterThan(80);
  });
}

/** The hop with the body 9,000 km away at one frame, further than a pose may be. */
function farAway(frame: number): string {
  const lines = hopFile().split("\n");
  const first = lines.findIndex((line) => line.startsWith("Frame Time:")) + 1;
  const line = lines[first + frame] ?? "";
  lines[first + frame] = line.replace(/^\S+/, "9e8");
  return lines.join("\n");
}

const BAD_FILES: [string, string | Uint8Array, RegExp][] = [
  ["letter.bvh", "Dear reader, this is no motion.", /Neither BVH.*Dear reader/],
  ["walk.fbx", "Kaydara FBX Binary  \0", /This is an FBX file.*convert it to GLB/],
  ["scene.dae", "<?xml version='1.0'?><COLLADA></COLLADA>", /a COLLADA file.*convert it to GLB/],
  ["scene.gltf", '{"asset": {"version": "2.0"}}', /glTF of several files.*GLB/],
  ["page.bvh", "<!DOCTYPE html><title>404</title>", /a web page.*download the file itself/],
  ["film.mp4", "\0\0\0\x20ftypisom", /a video.*pose estimator/],
  ["nothing.bvh", "", /The file is empty/],
  ["cut.glb", (await hopGlb()).slice(0, 3000), /GLB, container.*the file is cut off/],
  ["cut.npz", hopNpz().slice(0, 3000), /Motion \.npz: it is an archive that is cut off/],
  ["truncated.bvh", hopFile().slice(0, hopFile().indexOf("Frame Time:") + 40), /truncated/],
  ["nobody.bvh", hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box"), /joint/i],
  ["far-at-once.bvh", farAway(0), /Frame \d+: the body is .* m from where it starts/],
  ["far-later.bvh", farAway(20), /Frame \d+: the body is .* m from where it starts/],
];
for (const [name, text, expected] of BAD_FILES) {
  test(`${name} is refused with a reason, and the avatar goes on`, async ({ reused: page }) => {
    const problems = await openDemo(page);
    await dropFile(page, name, text);
    await expect(page.getByRole("alert")).toContainText(`${name} cannot be played`);
    await expect(page.getByRole("alert")).toContainText(expected);
    await expect(page.locator("#file-report")).toContainText(expected);
    await expect(page.locator("#now-playing")).toContainText("Hop");
    const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
    const before = await time();
    await expect.poll(time).not.toBe(before);
    expect(problems).toEqual([]);
  });
}

/** Makes the avatar refuse the next pose, whatever the core has let through. */
function refuseNextPose(page: Page): Promise<void> {
  return page.evaluate(() => {
    const avatar = window.dynaskinDemo?.avatar;
    if (!avatar) throw new Error("the demo is not ready");
    const step = avatar.step;
    avatar.step = () => {
      avatar.step = step;
      throw new Error("This pose is out of reach.");
    };
  });
}

test("a pose that is refused brings back what played before", async ({ reused: page }) => {
  const problems = await openDemo(page, "?paused=1");
  const playing = page.locator("#now-playing");
  const list = page.getByRole("combobox", { name: "Motion" });
  const alert = page.getByRole("alert");
  const nextFrame = page.getByRole("button", { name: "Next frame" });
  await dropFile(page, "first.bvh", hopFile());
  await expect(playing).toContainText("first.bvh");

  await test.step("in its first frame", async () => {
    await refuseNextPose(page);
    await dropFile(page, "second.bvh", hopFile());
    await expect(alert).toContainText("second.bvh cannot be played");
    await expect(alert).toContainText("out of reach");
    await expect(playing).toContainText("first.bvh");
  });

  await test.step("in a later frame: the file before", async () => {
    await dropFile(page, "third.bvh", hopFile());
    await expect(playing).toContainText("third.bvh");
    await refuseNextPose(page);
    await nextFrame.click();
    await expect(alert).toContainText("third.bvh cannot be played to its end");
    await expect(playing).toContainText("first.bvh");
    await expect(list).toContainText("first.bvh");
  });

  await test.step("once more, while it plays: the motion of the list", async () => {
    await refuseNextPose(page);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await expect(alert).toContainText("first.bvh cannot be played to its end");
    await expect(playing).toContainText("Hop");
    await expect(list).toHaveValue("hop");
    const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
    const before = await time();
    await expect.poll(time).not.toBe(before);
  });
  expect(problems).toEqual([]);
});
