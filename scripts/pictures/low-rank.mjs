// A table of many numbers a frame as a few shapes that are mixed.

/**
 * The shapes whose mixtures are nearest to the frames, the strongest first, as many as it takes to be within `tolerance`
 * of them (root mean square), and how much of each there is in each frame (root mean square 1: where shapes are rounded,
 * each is then as far off as the others).
 *
 * @param {Float32Array[]} frames the same count of numbers each
 * @param {number} tolerance
 * @returns {{ still: Float32Array, shapes: Float32Array[], shares: number[][] }}
 */
export function lowRank(frames, tolerance) {
  const count = frames.length;
  const size = frames[0].length;
  const still = new Float32Array(size);
  for (const frame of frames) for (let at = 0; at < size; at += 1) still[at] += frame[at] / count;
  const moved = frames.map((frame) => frame.map((value, at) => value - still[at]));
  const products = moved.map((a) =>
    moved.map((b) => a.reduce((sum, value, at) => sum + value * b[at], 0)),
  );
  const { values, vectors } = eigen(products);
  const order = values.map((_, idx) => idx).sort((a, b) => values[b] - values[a]);
  let left = values.reduce((sum, value) => sum + Math.max(0, value), 0);
  const kept = [];
  for (const idx of order) {
    if (Math.sqrt(left / (size * count)) <= tolerance) break;
    kept.push(idx);
    left -= Math.max(0, values[idx]);
  }
  const columns = kept.map((idx) => vectors.map((row) => row[idx]));
  // Eigenvectors have the length 1.
  const usual = Math.sqrt(1 / count);
  const shapes = columns.map((column) => {
    const shape = new Float32Array(size);
    for (const [frame, share] of column.entries()) {
      for (let at = 0; at < size; at += 1) shape[at] += share * moved[frame][at] * usual;
    }
    return shape;
  });
  const shares = frames.map((_, frame) => columns.map((column) => column[frame] / usual));
  return { still, shapes, shares };
}

/** Eigenvalues and eigenvectors (as columns) of a symmetric matrix, by Jacobi's rotations. */
function eigen(symmetric) {
  const size = symmetric.length;
  const a = symmetric.map((row) => [...row]);
  const vectors = a.map((_, i) => a.map((_, j) => (i === j ? 1 : 0)));
  const total = a.flat().reduce((sum, value) => sum + value * value, 0);
  for (let sweep = 0; sweep < 60; sweep += 1) {
    let off = 0;
    for (let p = 0; p < size; p += 1) {
      for (let q = p + 1; q < size; q += 1) {
        off += a[p][q] ** 2;
        if (Math.abs(a[p][q]) < 1e-300) continue;
        const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(theta, 1));
        const c = 1 / Math.hypot(t, 1);
        const s = t * c;
        for (let k = 0; k < size; k += 1) {
          [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
        }
        for (let k = 0; k < size; k += 1) {
          [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
          const [left, right] = [vectors[k][p], vectors[k][q]];
          [vectors[k][p], vectors[k][q]] = [c * left - s * right, s * left + c * right];
        }
      }
    }
    if (off < 1e-22 * total) break;
  }
  return { values: a.map((row, idx) => row[idx]), vectors };
}
