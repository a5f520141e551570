/** Skins positions that already hold the offsets, with up to four joints a vertex. */
export const VERTEX = `#version 300 es
layout(location = 0) in vec3 position_rest_m;
layout(location = 1) in vec3 normal_rest;
layout(location = 2) in uvec4 joints;
layout(location = 3) in vec4 weights;
layout(location = 4) in vec4 color_srgb;
uniform mat4 clip_from_view, view_from_world, world_from_rest[24];
out vec3 normal_world, color;
void main() {
  mat4 skin = weights.x * world_from_rest[joints.x] + weights.y * world_from_rest[joints.y]
            + weights.z * world_from_rest[joints.z] + weights.w * world_from_rest[joints.w];
  normal_world = mat3(skin) * normal_rest;
  color = color_srgb.rgb;
  gl_Position = clip_from_view * view_from_world * skin * vec4(position_rest_m, 1.0);
}`;

/** One lamp from the front left, and light from the sky. */
export const FRAGMENT = `#version 300 es
precision highp float;
in vec3 normal_world, color;
out vec4 result;
void main() {
  vec3 normal = normalize(normal_world);
  float lamp = max(dot(normal, normalize(vec3(-0.5, 0.8, 0.8))), 0.0);
  result = vec4(color * (0.45 + 0.15 * normal.y + 0.55 * lamp), 1.0);
}`;

/** Compiles and links; a mistake in a shader is an error that says where. */
export function createProgram(
  gl: WebGL2RenderingContext,
  vertex: string,
  fragment: string,
): WebGLProgram {
  const program = gl.createProgram();
  for (const [type, source] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ] as const) {
    const shader = gl.createShader(type);
    if (!shader) throw new Error("The WebGL context is lost.");
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader) ?? "The shader does not compile.");
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(program) ?? "The shaders do not fit together.");
  }
  return program;
}
