// Work in a WebGL2 context of somebody else, who finds its state as it was.

/** What is off while we work, by the names in a context. */
const SWITCHES = [
  "BLEND",
  "CULL_FACE",
  "DEPTH_TEST",
  "RASTERIZER_DISCARD",
  "SAMPLE_ALPHA_TO_COVERAGE",
  "SAMPLE_COVERAGE",
  "SCISSOR_TEST",
  "STENCIL_TEST",
] as const;

/** How arrays are read, and how we have them read. */
const UNPACK = [
  ["UNPACK_ALIGNMENT", 4],
  ["UNPACK_FLIP_Y_WEBGL", false],
  ["UNPACK_PREMULTIPLY_ALPHA_WEBGL", false],
  ["UNPACK_ROW_LENGTH", 0],
  ["UNPACK_SKIP_PIXELS", 0],
  ["UNPACK_SKIP_ROWS", 0],
] as const;

/**
 * Runs `work`, which may bind textures (2D) to the units from `firstUnit` on, framebuffers to draw to, vertex arrays,
 * programs, array, uniform and captured buffers; and puts everything back.
 */
export function withOwnState<Given>(
  gl: WebGL2RenderingContext,
  firstUnit: number,
  units: number,
  work: () => Given,
): Given {
  const current: WebGLProgram | null = gl.getParameter(gl.CURRENT_PROGRAM);
  // One that was deleted lives as long as it is current, and cannot become so again.
  const isGone = current !== null && gl.getProgramParameter(current, gl.DELETE_STATUS);
  const framebuffer = gl.getParameter(gl.DRAW_FRAMEBUFFER_BINDING);
  const vertices = gl.getParameter(gl.VERTEX_ARRAY_BINDING);
  const arrays = gl.getParameter(gl.ARRAY_BUFFER_BINDING);
  const uniforms = gl.getParameter(gl.UNIFORM_BUFFER_BINDING);
  const unpacked = gl.getParameter(gl.PIXEL_UNPACK_BUFFER_BINDING);
  const captured = gl.getParameter(gl.TRANSFORM_FEEDBACK_BINDING);
  const viewport: Int32Array = gl.getParameter(gl.VIEWPORT);
  const colours: boolean[] = gl.getParameter(gl.COLOR_WRITEMASK);
  const isOn = SWITCHES.map((name) => gl.isEnabled(gl[name]));
  const unpack = UNPACK.map(([name]) => gl.getParameter(gl[name]));
  const activeUnit = gl.getParameter(gl.ACTIVE_TEXTURE);
  const textures = Array.from({ length: units }, (_, idx) => {
    gl.activeTexture(gl.TEXTURE0 + firstUnit + idx);
    return gl.getParameter(gl.TEXTURE_BINDING_2D);
  });
  for (const name of SWITCHES) gl.disable(gl[name]);
  for (const [name, value] of UNPACK) gl.pixelStorei(gl[name], value);
  gl.colorMask(true, true, true, true);
  // What is captured may be bound nowhere else.
  gl.bindBuffer(gl.ARRAY_BUFFER, null);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
  try {
    return work();
  } finally {
    for (const [idx, name] of SWITCHES.entries()) {
      if (isOn[idx]) gl.enable(gl[name]);
      else gl.disable(gl[name]);
    }
    for (const [idx, [name]] of UNPACK.entries()) gl.pixelStorei(gl[name], unpack[idx]);
    for (const [idx, texture] of textures.entries()) {
      gl.activeTexture(gl.TEXTURE0 + firstUnit + idx);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    }
    gl.activeTexture(activeUnit);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, captured);
    gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, arrays);
    gl.bindBuffer(gl.UNIFORM_BUFFER, uniforms);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, unpacked);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, framebuffer);
    gl.useProgram(isGone ? null : current);
    gl.viewport(...(viewport as unknown as [number, number, number, number]));
    gl.colorMask(...(colours as [boolean, boolean, boolean, boolean]));
  }
}
