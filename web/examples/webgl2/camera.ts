type Vector = readonly [number, number, number];

const FOV_Y_RADIANS = 0.42;
const NEAR_M = 0.1;
const FAR_M = 50;

/** Clip from view, column-major. */
export function perspective(aspect: number): Float32Array {
  const f = 1 / Math.tan(FOV_Y_RADIANS / 2);
  const depth = 1 / (NEAR_M - FAR_M);
  return Float32Array.of(
    ...[f / aspect, 0, 0, 0],
    ...[0, f, 0, 0],
    ...[0, 0, (FAR_M + NEAR_M) * depth, -1],
    ...[0, 0, 2 * FAR_M * NEAR_M * depth, 0],
  );
}

const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const unit = (a: Vector): Vector => {
  const length = Math.sqrt(dot(a, a));
  return [a[0] / length, a[1] / length, a[2] / length];
};

/** View from world, column-major, +Y up. */
export function lookAt(eyeWorldM: Vector, targetWorldM: Vector): Float32Array {
  const back = unit(minus(eyeWorldM, targetWorldM));
  const right = unit(cross([0, 1, 0], back));
  const up = cross(back, right);
  return Float32Array.of(
    ...[right[0], up[0], back[0], 0],
    ...[right[1], up[1], back[1], 0],
    ...[right[2], up[2], back[2], 0],
    ...[-dot(right, eyeWorldM), -dot(up, eyeWorldM), -dot(back, eyeWorldM), 1],
  );
}
