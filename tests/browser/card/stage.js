// A crowd that an engine's graphics card decodes, held to what the CPU decodes: numbers are read back from the
// buffers that the engine draws from, and pictures are compared.
import { load, Motion } from "dynaskin";

/** Pixels of a picture. */
export const SIZE = [480, 320];
export const MODEL_URL = new URL("/models/female/", location.href).href;
const STEP_SECONDS = 1 / 60;
const SHAPES = [0, 1.5, -1].map((weight) => [0, weight, 0, 0, 0, 0, 0, 0, 0, 0]);

/** How far bodies stand apart, metres. */
export const APART_M = 0.9;

const largest = (a, b) => {
  let most = 0;
  for (let at = 0; at < a.length; at += 1) most = Math.max(most, Math.abs(a[at] - b[at]));
  return most;
};

const offsetM = ({ offsets }) => largest(offsets, new Float32Array(offsets.length));

const meanDifference = (a, b) =>
  a.reduce((sum, value, at) => sum + Math.abs(value - b[at]), 0) / a.length;

/**
 * @param start - takes avatars and gives `skins`, one a body; `draw()`, which draws and gives the pixels;
 *   `buffers(idx)`, the buffers of a body's positions and normals; `order(idx)`, the body's vertex for each of its mesh
 *   or null; `numbers(idx)`, positions as the engine's own functions read them, or null; `gl`; and `plain(idx)`,
 *   whether a disposed skin's mesh has its own positions back
 */
export async function playOnCard(start) {
  const model = await load({ model: MODEL_URL });
  const crowd = model.createCrowd();
  crowd.decoding = "card";
  const avatars = SHAPES.map((shape) => model.createAvatar({ shape }));
  for (const avatar of avatars) crowd.add(avatar);
  const { skins, draw, buffers, order, numbers, gl, plain } = await start(avatars);
  const motion = Motion.procedural("hop", avatars[0]);
  let frame = 0;
  const found = {
    positionM: 0,
    normal: 0,
    offsetM: 0,
    readM: 0,
    onCard: {},
    errors: {},
    restsExactly: [],
  };
  const isOnCard = (name) => {
    found.onCard[name] = skins.map((skin) => skin.isDecodedOnCard);
    found.errors[name] = gl.getError();
  };
  const step = async (count = 1) => {
    for (let idx = 0; idx < count; idx += 1) {
      frame += 1;
      for (const [number, skin] of skins.entries()) {
        skin.writePose(motion.poseAt((frame / 60 + 0.2 * number) % motion.durationSeconds));
      }
      crowd.stepAll(
        skins.map((skin) => skin.readPose()),
        STEP_SECONDS,
      );
      for (const skin of skins) skin.show();
    }
    return draw();
  };
  const read = (buffer, length) => {
    const values = new Float32Array(length);
    gl.bindBuffer(gl.COPY_READ_BUFFER, buffer);
    gl.getBufferSubData(gl.COPY_READ_BUFFER, 0, values);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    return values;
  };
  const ordered = (values, map) =>
    map
      ? Float32Array.from(
          { length: 3 * map.length },
          (_, at) => values[3 * map[Math.floor(at / 3)] + (at % 3)],
        )
      : values;
  const compare = () => {
    for (const [idx, avatar] of avatars.entries()) {
      const own = buffers(idx);
      if (!skins[idx].isDecodedOnCard) continue;
      const map = order(idx);
      const positions = ordered(avatar.positions, map);
      const normals = ordered(avatar.normals, map);
      found.positionM = Math.max(
        found.positionM,
        largest(read(own.positions, positions.length), positions),
      );
      found.normal = Math.max(found.normal, largest(read(own.normals, normals.length), normals));
      found.offsetM = Math.max(found.offsetM, offsetM(avatar));
      const engine = numbers(idx);
      if (engine) found.readM = Math.max(found.readM, largest(engine, positions));
    }
  };
  const isAtRest = () => {
    const still = model.body.createAvatar({ shape: SHAPES[0] }).positions;
    const values = read(buffers(0).positions, still.length);
    return values.every((value, at) => value === still[at]);
  };
  // Until the engine has drawn, its card may not be known.
  for (let shown = 0; shown < 2; shown += 1) {
    for (const skin of skins) skin.show();
    draw();
  }
  isOnCard("begin");
  found.restsExactly.push(isAtRest());
  isOnCard("rest");
  let pixels;
  // Until the picture is one of a landing.
  for (let station = 0; station < 20 && offsetM(avatars[0]) < 0.02; station += 1) {
    pixels = await step(4);
    compare();
  }
  isOnCard("motion");
  const pictures = { card: gl.canvas.toDataURL() };
  // The same moment without and with the CPU.
  for (const avatar of avatars) avatar.strength = 0;
  for (const skin of skins) skin.show();
  const without = draw();
  compare();
  isOnCard("without");
  for (const avatar of avatars) avatar.strength = 1;
  crowd.decoding = "cpu";
  for (const skin of skins) skin.show();
  const byCpu = draw();
  isOnCard("cpu");
  pictures.cpu = gl.canvas.toDataURL();
  found.tissueDifference = meanDifference(pixels, without);
  found.pictureDifference = meanDifference(pixels, byCpu);
  crowd.decoding = "card";
  await step();
  isOnCard("again");
  compare();
  for (const avatar of avatars)
    avatar.setControls({ strength: 2, regions: { chest: { gain: 0.7, limitCm: 2 } } });
  avatars[1].setShape([0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
  await step(20);
  compare();
  avatars[0].maxStrain = 0.5;
  await step();
  isOnCard("strain");
  avatars[0].maxStrain = null;
  avatars[0].skinning = "dual-quaternion";
  await step();
  compare();
  isOnCard("dualQuaternions");
  avatars[0].skinning = "linear";
  await step();
  isOnCard("linear");
  const context = gl.getExtension("WEBGL_lose_context");
  const restored = new Promise((resolve) =>
    gl.canvas.addEventListener("webglcontextrestored", () => setTimeout(resolve, 100), {
      once: true,
    }),
  );
  context.loseContext();
  await new Promise((resolve) => setTimeout(resolve, 50));
  await step();
  isOnCard("lost");
  context.restoreContext();
  await restored;
  await step();
  await step();
  isOnCard("restored");
  compare();
  avatars[0].detail = "asleep";
  await step(20);
  found.restsExactly.push(isAtRest());
  isOnCard("asleep");
  for (const skin of skins) skin.dispose();
  draw();
  return {
    ...found,
    isPlain: skins.every((_, idx) => plain(idx)),
    pictures,
  };
}
