// Dual-quaternion skinning for the vertex stage of an engine, as the Rust crate `dynaskin-body` and the renderer do it.

/**
 * GLSL before `main`. `dynaskinRigid` gives the blend of four bones' matrices by their dual quaternions, in place of
 * their mean. A bone's matrix is a rotation and a translation after a uniform scale.
 *
 * @internal
 */
export const DUAL_QUATERNIONS = `
vec4 dynaskinRotation(mat3 m) {
  float x = m[0][0];
  float y = m[1][1];
  float z = m[2][2];
  vec3 sums = vec3(m[1][2] + m[2][1], m[2][0] + m[0][2], m[0][1] + m[1][0]);
  vec3 differences = vec3(m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]);
  // By the largest component: the others may vanish.
  if (x + y + z > 0.0) return normalize(vec4(differences, 1.0 + x + y + z));
  if (x >= y && x >= z) return normalize(vec4(1.0 + x - y - z, sums.z, sums.y, differences.x));
  if (y >= z) return normalize(vec4(sums.z, 1.0 - x + y - z, sums.x, differences.y));
  return normalize(vec4(sums.y, sums.x, 1.0 - x - y + z, differences.z));
}
mat4 dynaskinRigid(mat4 first, mat4 second, mat4 third, mat4 fourth, vec4 weights) {
  mat4 bones[4];
  bones[0] = first;
  bones[1] = second;
  bones[2] = third;
  bones[3] = fourth;
  // Far from the origin translations would lose digits: they count from the first bone's.
  vec3 origin = first[3].xyz;
  vec4 pivot = vec4(0.0);
  vec4 real = vec4(0.0);
  vec4 dual = vec4(0.0);
  float scale = 0.0;
  for (int idx = 0; idx < 4; idx += 1) {
    float weight = weights[idx];
    if (weight <= 0.0) continue;
    mat3 linear = mat3(bones[idx]);
    float volume = determinant(linear);
    // What is of no size has no rotation.
    if (volume == 0.0) return first;
    float size = sign(volume) * pow(abs(volume), 1.0 / 3.0);
    vec4 rotation = dynaskinRotation(linear / size);
    if (pivot == vec4(0.0)) pivot = rotation;
    // q and -q are one rotation: each is taken on the side of the first.
    float signedWeight = dot(rotation, pivot) < 0.0 ? -weight : weight;
    vec3 at = 0.5 * (bones[idx][3].xyz - origin);
    real += signedWeight * rotation;
    dual += signedWeight * vec4(rotation.w * at + cross(at, rotation.xyz), -dot(at, rotation.xyz));
    scale += weight * size;
  }
  // No bone moves the vertex.
  if (pivot == vec4(0.0)) return first;
  float reciprocal = inversesqrt(dot(real, real));
  vec4 q = reciprocal * real;
  vec4 d = reciprocal * dual;
  vec3 moved = origin + 2.0 * (q.w * d.xyz - d.w * q.xyz + cross(q.xyz, d.xyz));
  vec4 x = 2.0 * q.x * q;
  vec4 y = 2.0 * q.y * q;
  vec4 z = 2.0 * q.z * q;
  return mat4(
    scale * vec4(1.0 - y.y - z.z, x.y + z.w, x.z - y.w, 0.0),
    scale * vec4(x.y - z.w, 1.0 - x.x - z.z, y.z + x.w, 0.0),
    scale * vec4(x.z + y.w, y.z - x.w, 1.0 - x.x - y.y, 0.0),
    vec4(moved, 1.0)
  );
}
`;
