// A crowd that an engine's graphics card decodes, held to what the CPU decodes: numbers are read back from the
// buffers that the engine draws from, and pictures are compared. `gpu` says how a graphics API does what is asked for
// here.
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
 *   or null; `numbers(idx)`, positions as the engine's own functions read them, or null; `gpu`; and `plain(idx)`,
 *   whether a disposed skin's mesh has its own positions back
 */
export async function playOnCard(start) {
  const model = await load({ model: MODEL_URL });
  const crowd = model.createCrowd();
  crowd.decoding = "card";
  const avatars = SHAPES.map((shape) => model.createAvatar({ shape }));
  for (const avatar of avatars) crowd.add(avatar);
  const { skins, draw, buffers, order, numbers, gpu, plain } = await start(avatars);
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
  const isOnCard = async (name) => {
    found.onCard[name] = skins.map((skin) => skin.isDecodedOnCard);
    found.errors[name] = await gpu.error();
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
  const ordered = (values, map) =>
    map
      ? Float32Array.from(
          { length: 3 * map.length },
          (_, at) => values[3 * map[Math.floor(at / 3)] + (at % 3)],
        )
      : values;
  const compare = async () => {
    for (const [idx, avatar] of avatars.entries()) {
      const own = buffers(idx);
      if (!skins[idx].isDecodedOnCard) continue;
      const map = order(idx);
      const positions = ordered(avatar.positions, map);
      const normals = ordered(avatar.normals, map);
      found.positionM = Math.max(
        found.positionM,
        largest(await gpu.read(own.positions, positions.length), positions),
      );
      found.normal = Math.max(
        found.normal,
        largest(await gpu.read(own.normals, normals.length), normals),
      );
      found.offsetM = Math.max(found.offsetM, offsetM(avatar));
      const engine = numbers(idx);
      if (engine) found.readM = Math.max(found.readM, largest(engine, positions));
    }
  };
  const isAtRest = async () => {
    const still = model.body.createAvatar({ shape: SHAPES[0] }).positions.slice();
    const values = await gpu.read(buffers(0).positions, still.length);
    return values.every((value, at) => value === still[at]);
  };
  // Until the engine has drawn, its card may not be known.
  for (let shown = 0; shown < 2; shown += 1) {
    for (const skin of skins) skin.show();
    await draw();
  }
  await isOnCard("begin");
  found.restsExactly.push(await isAtRest());
  await isOnCard("rest");
  let pixels;
  // Until the picture is one of a landing.
  for (let station = 0; station < 20 && offsetM(avatars[0]) < 0.02; station += 1) {
    pixels = await step(4);
    await compare();
  }
  await isOnCard("motion");
  const pictures = { card: gpu.picture() };
  // The same moment without and with the CPU.
  for (const avatar of avatars) avatar.strength = 0;
  for (const skin of skins) skin.show();
  const without = await draw();
  await compare();
  await isOnCard("without");
  for (const avatar of avatars) avatar.strength = 1;
  crowd.decoding = "cpu";
  for (const skin of skins) skin.show();
  const byCpu = await draw();
  await isOnCard("cpu");
  pictures.cpu = gpu.picture();
  found.tissueDifference = meanDifference(pixels, without);
  found.pictureDifference = meanDifference(pixels, byCpu);
  crowd.decoding = "card";
  await step();
  await isOnCard("again");
  await compare();
  for (const avatar of avatars)
    avatar.setControls({ strength: 2, regions: { chest: { gain: 0.7, limitCm: 2 } } });
  avatars[1].setShape([0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
  await step(20);
  await compare();
  avatars[0].maxStrain = 0.5;
  await step();
  await isOnCard("strain");
  avatars[0].maxStrain = null;
  await step();
  if (gpu.hasDualQuaternions) {
    avatars[0].skinning = "dual-quaternion";
    await step();
    await compare();
    await isOnCard("dualQuaternions");
    avatars[0].skinning = "linear";
    await step();
    await isOnCard("linear");
  }
  if (gpu.lose) {
    await gpu.lose();
    await step();
    await isOnCard("lost");
    await gpu.restore();
    await step();
    await step();
    await isOnCard("restored");
    await compare();
  }
  avatars[0].detail = "asleep";
  await step(20);
  found.restsExactly.push(await isAtRest());
  await isOnCard("asleep");
  for (const skin of skins) skin.dispose();
  await draw();
  return {
    ...found,
    isPlain: skins.every((_, idx) => plain(idx)),
    pictures,
  };
}

/** `gpu` of a WebGL context. */
export function webGl(gl) {
  const context = gl.getExtension("WEBGL_lose_context");
  return {
    hasDualQuaternions: true,
    error: () => gl.getError(),
    read(buffer, length) {
      const values = new Float32Array(length);
      gl.bindBuffer(gl.COPY_READ_BUFFER, buffer);
      gl.getBufferSubData(gl.COPY_READ_BUFFER, 0, values);
      gl.bindBuffer(gl.COPY_READ_BUFFER, null);
      return values;
    },
    picture: () => gl.canvas.toDataURL(),
    async lose() {
      context.loseContext();
      await new Promise((resolve) => setTimeout(resolve, 50));
    },
    async restore() {
      const restored = new Promise((resolve) =>
        gl.canvas.addEventListener("webglcontextrestored", () => setTimeout(resolve, 100), {
          once: true,
        }),
      );
      context.restoreContext();
      await restored;
    },
  };
}

/** `gpu` of a WebGPU device; `error` counts what was not valid since the last call. */
export function webGpu(device, canvas) {
  let errors = 0;
  device.addEventListener("uncapturederror", ({ error }) => {
    errors += 1;
    console.error(error.message);
  });
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = SIZE;
  const shown = copy.getContext("2d", { willReadFrequently: true });
  return {
    hasDualQuaternions: false,
    async error() {
      await device.queue.onSubmittedWorkDone();
      const count = errors;
      errors = 0;
      return count;
    },
    read: (buffer, length) => readStorage(device, buffer, length),
    /** Before the canvas is handed to the page. */
    pixels() {
      shown.drawImage(canvas, 0, 0, ...SIZE);
      return shown.getImageData(0, 0, ...SIZE).data;
    },
    picture: () => copy.toDataURL(),
  };
}

const COPY = `
@group(0) @binding(0) var<storage, read> source: array<f32>;
@group(0) @binding(1) var<storage, read_write> target_numbers: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&target_numbers) { target_numbers[id.x] = source[id.x]; }
}`;

/** The numbers of a buffer; Babylon's have no usage to be copied from, but shaders may read them. */
async function readStorage(device, buffer, length) {
  const { COPY_SRC, COPY_DST, MAP_READ, STORAGE } = GPUBufferUsage;
  const size = 4 * length;
  const mapped = device.createBuffer({ size, usage: COPY_DST | MAP_READ });
  const encoder = device.createCommandEncoder();
  let source = buffer;
  if (!(buffer.usage & COPY_SRC)) {
    source = device.createBuffer({ size, usage: COPY_SRC | STORAGE });
    const module = device.createShaderModule({ code: COPY });
    const pipeline = device.createComputePipeline({ layout: "auto", compute: { module } });
    const pass = encoder.beginComputePass();
    pass.setPipeline(pipeline);
    const entries = [buffer, source].map((one, binding) => ({
      binding,
      resource: { buffer: one },
    }));
    const layout = pipeline.getBindGroupLayout(0);
    pass.setBindGroup(0, device.createBindGroup({ layout, entries }));
    pass.dispatchWorkgroups(Math.ceil(length / 64));
    pass.end();
  }
  encoder.copyBufferToBuffer(source, 0, mapped, 0, size);
  device.queue.submit([encoder.finish()]);
  await mapped.mapAsync(GPUMapMode.READ);
  const values = new Float32Array(mapped.getMappedRange().slice(0));
  mapped.destroy();
  return values;
}
