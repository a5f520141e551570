// body.glb as earlier versions wrote it, and as packers write avatars: whole numbers that the inverse bind matrices
// scale to metres.

/** Steps of a metre. */
const PER_M = 10_000;
/** The whole number that stands for a metre in morph targets. */
const NORMALISED = 32_767;
const I16 = 5122;

/**
 * The same body, whose positions and morph targets are 16-bit integers in steps of a tenth of a millimetre.
 *
 * @param {Uint8Array} glb a body.glb of today
 */
export function quantised(glb) {
  const view = new DataView(glb.buffer, glb.byteOffset, glb.byteLength);
  const jsonLength = view.getUint32(12, true);
  const file = JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + jsonLength)));
  const binary = glb.slice(28 + jsonLength);
  const numbers = new DataView(binary.buffer);
  const [{ attributes, targets }] = file.meshes[0].primitives;
  for (const { POSITION } of [attributes, ...targets]) {
    const accessor = file.accessors[POSITION];
    const { [accessor.bufferView]: bytes } = file.bufferViews;
    const [size, stride] = accessor.normalized ? [2, 8] : [4, 12];
    const steps = (/** @type {number} */ at) =>
      accessor.normalized
        ? (numbers.getInt16(at, true) / NORMALISED) * PER_M
        : numbers.getFloat32(at, true) * PER_M;
    for (let vertex = 0; vertex < accessor.count; vertex += 1) {
      const start = bytes.byteOffset + stride * vertex;
      for (let axis = 0; axis < 3; axis += 1) {
        numbers.setInt16(start + 2 * axis, Math.round(steps(start + size * axis)), true);
      }
    }
    const toSteps = (/** @type {number} */ at) =>
      Math.round((at * PER_M) / (accessor.normalized ? NORMALISED : 1));
    accessor.min = accessor.min.map(toSteps);
    accessor.max = accessor.max.map(toSteps);
    delete accessor.normalized;
    accessor.componentType = I16;
    bytes.byteStride = stride;
  }
  const { bufferView, count } = file.accessors[file.skins[0].inverseBindMatrices];
  const { byteOffset } = file.bufferViews[bufferView];
  for (let joint = 0; joint < count; joint += 1) {
    for (const diagonal of [0, 20, 40]) {
      numbers.setFloat32(byteOffset + 64 * joint + diagonal, 1 / PER_M, true);
    }
  }
  return assembled(new TextEncoder().encode(JSON.stringify(file)), binary);
}

/**
 * A binary glTF file of its two chunks.
 *
 * @param {Uint8Array} json
 * @param {Uint8Array} binary its length is a multiple of four
 */
export function assembled(json, binary) {
  const padded = Math.ceil(json.length / 4) * 4;
  const bytes = new Uint8Array(28 + padded + binary.length).fill(32, 20, 20 + padded);
  const view = new DataView(bytes.buffer);
  const words = [0x46546c67, 2, bytes.length, padded, 0x4e4f534a];
  for (const [idx, word] of words.entries()) view.setUint32(4 * idx, word, true);
  bytes.set(json, 20);
  view.setUint32(20 + padded, binary.length, true);
  view.setUint32(24 + padded, 0x004e4942, true);
  bytes.set(binary, 28 + padded);
  return bytes;
}
