// What tests of decoding on the graphics card share: dynaskin/renderer on an empty page.
import { expect, type Page } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

/** What is asked of the renderer, in metres. */
const TOLERANCE_M = 1e-4;

/** What one run of {@link PLAY} found. */
interface Played {
  backend: string;
  /** The largest differences of positions (metres) and unit normals. */
  positionM: number;
  normal: number;
  /** The largest offset, metres. */
  offsetM: number;
  /** Whether the card decoded: in each of the stations. */
  onCard: Record<string, boolean>;
  /** Whether an avatar that was not stepped, and one that sleeps, are exactly at rest. */
  restsExactly: boolean[];
  /** Mean difference of the pictures, of 255. */
  pictureDifference: number;
  codes: string[];
}

const PLAY = `
  import { load, Motion } from "/web/sdk/dist/index.js";
  import { createRenderer } from "/web/sdk/dist/renderer.js";
  const SIZE = [240, 320];
  const largest = (a, b) => {
    let most = 0;
    for (let at = 0; at < a.length; at += 1) most = Math.max(most, Math.abs(a[at] - b[at]));
    return most;
  };
  const codeOf = async (call) => {
    try {
      await call();
      return "none";
    } catch (error) {
      return error.code ?? String(error);
    }
  };
  window.playDecoding = async (backend) => {
    const model = await load({ model: "/models/female/" });
    const canvas = document.createElement("canvas");
    document.body.append(canvas);
    const renderer = await createRenderer(canvas, { backend });
    renderer.resize(...SIZE);
    renderer.setCamera({ eyeWorldM: [1.2, 1.1, 3.4], targetWorldM: [0, 0.9, 0], fovYRadians: 0.6 });
    const crowd = model.createCrowd();
    crowd.decoding = "card";
    const shapes = [0, 1.5, -1, 2].map((weight) => [0, weight, 0, 0, 0, 0, 0, 0, 0, 0]);
    const bodies = shapes.map((shape, idx) => {
      const avatar = model.createAvatar({ shape });
      crowd.add(avatar);
      const body = renderer.addBody(model.body);
      body.setVisible(idx === 0);
      return { avatar, body };
    });
    const [{ avatar, body }] = bodies;
    const still = model.body.createAvatar({ shape: shapes[0] });
    const isAtRest = async () => {
      body.update(avatar);
      const { positions } = await body.readDecoded();
      return positions.every((value, at) => value === still.positions[at]);
    };
    const restsExactly = [await isAtRest()];
    const motion = Motion.procedural("hop", avatar);
    let frame = 0;
    const step = (count = 1) => {
      for (let idx = 0; idx < count; idx += 1) {
        frame += 1;
        const poses = bodies.map((_, number) => motion.poseAt((frame / 60 + 0.2 * number) % motion.durationSeconds));
        crowd.stepAll(poses, 1 / 60);
        for (const { avatar, body } of bodies) body.update(avatar);
      }
    };
    let positionM = 0;
    let normal = 0;
    let offsetM = 0;
    const compare = async () => {
      for (const { avatar, body } of bodies) {
        const decoded = await body.readDecoded();
        positionM = Math.max(positionM, largest(decoded.positions, avatar.positions));
        normal = Math.max(normal, largest(decoded.normals, avatar.normals));
        offsetM = Math.max(offsetM, largest(avatar.offsets, new Float32Array(avatar.offsets.length)));
      }
    };
    const onCard = {};
    for (let station = 0; station < 6; station += 1) {
      step(7);
      await compare();
    }
    onCard.motion = bodies.every(({ body }) => body.isDecodedOnCard);
    for (const { avatar } of bodies) {
      avatar.setControls({ strength: 2, regions: { chest: { gain: 0.7, limitCm: 2 } } });
    }
    bodies[1].avatar.setShape([0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    step(3);
    await compare();
    const pixels = () => {
      renderer.render();
      const copy = new OffscreenCanvas(...SIZE).getContext("2d");
      copy.drawImage(canvas, 0, 0);
      return copy.getImageData(0, 0, ...SIZE).data.slice();
    };
    const meanDifference = (a, b) => a.reduce((sum, value, at) => sum + Math.abs(value - b[at]), 0) / a.length;
    const decodedPicture = pixels();
    if (meanDifference(decodedPicture, decodedPicture.map(() => 128)) < 5) throw new Error("an empty picture");
    const { positions, normals, offsets, skinMatrices } = avatar;
    body.update({ positions, normals, offsets, skinMatrices });
    onCard.ownSurface = body.isDecodedOnCard;
    const pictureDifference = meanDifference(decodedPicture, pixels());
    const codes = [await codeOf(() => body.readDecoded())];
    step();
    onCard.again = body.isDecodedOnCard;
    body.setLook({ draped: true });
    step();
    onCard.draped = body.isDecodedOnCard;
    body.setLook({});
    avatar.maxStrain = 0.5;
    step();
    onCard.strain = body.isDecodedOnCard;
    avatar.maxStrain = null;
    step();
    onCard.noStrain = body.isDecodedOnCard;
    avatar.setControls({ regions: { chest: { stiffness: 10 } } });
    step();
    onCard.notLearned = body.isDecodedOnCard;
    avatar.setControls("as-predicted");
    step(20);
    onCard.learned = body.isDecodedOnCard;
    await compare();
    avatar.decoding = "cpu";
    step();
    onCard.cpu = body.isDecodedOnCard;
    avatar.decoding = "card";
    step();
    await compare();
    avatar.detail = "half";
    step(4);
    await compare();
    // A body less, another in its place, and a device that comes back.
    bodies[2].body.remove();
    bodies[2].body = renderer.addBody(model.body);
    bodies[2].body.setVisible(false);
    step();
    await compare();
    if (backend === "webgl2") {
      const context = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
      const { lost } = renderer;
      context.loseContext();
      await lost;
      step(2);
      codes.push(await codeOf(() => body.readDecoded()));
      // A context can be given back only after the event of its loss.
      setTimeout(() => context.restoreContext(), 50);
      await renderer.recover();
      await compare();
      onCard.recovered = bodies.every(({ body }) => body.isDecodedOnCard);
    }
    avatar.detail = "asleep";
    step(20);
    restsExactly.push(await isAtRest());
    codes.push(await codeOf(() => { avatar.decoding = "gpu"; }));
    codes.push(await codeOf(() => model.createAvatar({ decoding: "gpu" })));
    renderer.dispose();
    codes.push(await codeOf(() => body.update(avatar)));
    return { backend: renderer.backend, positionM, normal, offsetM, onCard, restsExactly, pictureDifference, codes };
  };
`;

/** Plays avatars that the card decodes, and holds what it made to the CPU's. */
export async function expectDecoding(page: Page, backend: "webgl2" | "webgpu"): Promise<void> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.goto(`${REPOSITORY_URL}/blank`);
  await page.addScriptTag({ type: "module", content: PLAY });
  await page.waitForFunction(() => "playDecoding" in window);
  const played = (await page.evaluate(`window.playDecoding("${backend}")`)) as Played;
  console.log(JSON.stringify(played));
  expect(played.backend).toBe(backend);
  expect(played.positionM).toBeLessThanOrEqual(TOLERANCE_M);
  expect(played.normal).toBeLessThanOrEqual(1e-3);
  expect(played.offsetM).toBeGreaterThan(0.01);
  expect(played.restsExactly).toEqual([true, true]);
  expect(played.pictureDifference).toBeLessThan(0.1);
  expect(played.onCard).toEqual({
    ...{ motion: true, ownSurface: false, again: true, draped: false, strain: false },
    ...{ noStrain: true, notLearned: false, learned: true, cpu: false },
    ...(backend === "webgl2" ? { recovered: true } : {}),
  });
  const lost = backend === "webgl2" ? ["lost"] : [];
  expect(played.codes).toEqual(["no-read-back", ...lost, "argument", "argument", "disposed"]);
  expect(problems).toEqual([]);
}
