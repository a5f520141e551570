// One measurement, the same code in Node and in a page.

const WARM_UP_FRAMES = 120;
const FRAMES = 600;

/**
 * Steps an avatar through a hop and times its stages, then runs the same two ONNX files in
 * onnxruntime-web on one thread. All times are medians in milliseconds.
 *
 * @param {{ sdk: string, ort: string, ortFolder: string, model: string }} places addresses
 */
export async function measure({ sdk, ort, ortFolder, model }) {
  const { load, Motion } = await import(sdk);
  const loaded = await load({ model });
  const avatar = loaded.createAvatar();
  const stages = timeStages(avatar, Motion.procedural("hop", avatar));
  const onnxruntimeMs = await timeOnnxruntime(ort, ortFolder, model, loaded.bundle);
  avatar.dispose();
  loaded.dispose();
  return { ...stages, networksMs: stages.predictMs + stages.decodeMs, onnxruntimeMs };
}

/**
 * Medians in milliseconds of the stages of one avatar-frame of a model in four files.
 *
 * @param {{ sdk: string, files: import("dynaskin").ModelFiles }} places addresses
 */
export async function measureFiles({ sdk, files }) {
  const { load, Motion } = await import(sdk);
  const loaded = await load({ model: files });
  const avatar = loaded.createAvatar();
  const stages = timeStages(avatar, Motion.procedural("hop", avatar));
  avatar.dispose();
  loaded.dispose();
  return stages;
}

function timeStages(avatar, motion) {
  const rows = [];
  const pose = new Float64Array(99);
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    motion.poseAt((frame / 60) % motion.durationSeconds, pose);
    const start = performance.now();
    avatar.step(pose, 1 / 60);
    const stepped = performance.now();
    avatar.skinned();
    const skinned = performance.now();
    if (frame < WARM_UP_FRAMES || avatar.timings.ticks !== 1) continue;
    rows.push({ ...avatar.timings, tissueMs: stepped - start, skinMs: skinned - stepped });
  }
  const keys = ["featuresMs", "predictMs", "decodeMs", "applyMs", "tissueMs", "skinMs"];
  return Object.fromEntries(keys.map((key) => [key, median(rows.map((row) => row[key]))]));
}

async function timeOnnxruntime(module, folder, model, bundle) {
  const ort = await import(module);
  ort.env.wasm.numThreads = 1;
  ort.env.wasm.wasmPaths = folder;
  ort.env.logLevel = "error";
  const open = async (file) =>
    ort.InferenceSession.create(await readFile(new URL(file, model)), {
      executionProviders: ["wasm"],
      graphOptimizationLevel: "all",
    });
  const predictor = await open(bundle.predictor.file);
  const decoder = await open(bundle.decoder.file);
  const tensor = (values, dims) => new ort.Tensor("float32", values, dims);
  const feeds = {
    features: tensor(new Float32Array(bundle.feature_count), [1, bundle.feature_count]),
  };
  for (const { name, shape } of predictor.inputMetadata) {
    if (name.startsWith("state_")) feeds[name] = tensor(new Float32Array(shape[1]), [1, shape[1]]);
  }
  const times = [];
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    fillFeatures(feeds.features.data, frame);
    const start = performance.now();
    const out = await predictor.run(feeds);
    await decoder.run({ latent: out.latent });
    if (frame >= WARM_UP_FRAMES) times.push(performance.now() - start);
    for (const name of Object.keys(feeds)) {
      if (name !== "features") feeds[name] = out[`${name}_out`];
    }
  }
  return median(times);
}

/** Changing numbers of the size of features, so that nothing can be cached. */
function fillFeatures(features, frame) {
  for (let idx = 0; idx < features.length; idx += 1) features[idx] = Math.sin(frame * 0.1 + idx);
}

async function readFile(address) {
  if (address.protocol !== "file:")
    return new Uint8Array(await (await fetch(address)).arrayBuffer());
  const { readFile: read } = await import("node:fs/promises");
  return new Uint8Array(await read(address));
}

function median(values) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}
