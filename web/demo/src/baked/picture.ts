import { type BakedFile, mix } from "./file.js";

/** Where the picture's camera is: from its target, and what it is moved by, in metres. */
export interface Framing {
  reachM: number;
  rightM: number;
  upM: number;
  fovYRadians: number;
}

const VERTEX = `#version 300 es
uniform vec4 camera; // moved right and up, reach (m); tangent of half the angle
uniform float aspect;
in vec3 place;
in float light;
in float cloth;
out vec2 look;
const float NEAR_M = 0.1;
const float FAR_M = 8.0;
void main() {
  float depth = camera.z - place.z;
  look = vec2(light, cloth);
  gl_Position = vec4(
    (place.xy - camera.xy) / (camera.w * vec2(aspect, 1.0)),
    ((FAR_M + NEAR_M) * depth - 2.0 * FAR_M * NEAR_M) / (FAR_M - NEAR_M),
    depth
  );
}`;

const FRAGMENT = `#version 300 es
precision highp float;
uniform mat3 skin;
uniform mat3 clothes;
in vec2 look;
out vec4 colour;
const float HEM_SPAN_M = 0.1; // from 0 to 1
void main() {
  // Hems as in crates/render/shader/body.wgsl: an edge, a seam beside it, and the cloth's shade on the skin.
  float pastM = (look.y - 0.5) * HEM_SPAN_M;
  float pixelM = max(fwidth(pastM), 1e-5);
  float past = clamp(pastM / pixelM + 0.5, 0.0, 1.0);
  float seamM = max(0.0015, pixelM);
  float seam = (1.0 - smoothstep(0.0, seamM, abs(pastM - 0.006))) * 0.0015 / seamM;
  float beside = smoothstep(-0.007, 0.0, pastM) * (1.0 - smoothstep(0.0, 0.0015, pastM));
  // The light is the root of what the surface reflects.
  float l = look.x * sqrt((1.0 - 0.35 * seam) * (1.0 - 0.45 * beside));
  vec3 factors = vec3(1.0, l, l * l);
  colour = vec4(mix(skin * factors, clothes * factors, past), 1.0);
}`;

/** Draws a baked loop on a canvas, before nothing: around the body the page shows. */
export class BakedPicture {
  readonly #canvas: HTMLCanvasElement;
  readonly #file: BakedFile;
  readonly #gl: WebGL2RenderingContext;
  readonly #program: WebGLProgram;
  readonly #places: Float32Array;
  readonly #tissue: Float32Array;
  readonly #light: Float32Array;
  /** Both surfaces as the graphics card takes them, plane after plane. */
  readonly #buffers: { places: WebGLBuffer; light: WebGLBuffer; cloth: WebGLBuffer };

  /** @throws Error where the browser has no WebGL2 */
  constructor(canvas: HTMLCanvasElement, file: BakedFile) {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) throw new Error("This browser has no WebGL2.");
    this.#canvas = canvas;
    this.#file = file;
    this.#gl = gl;
    this.#program = linkedProgram(gl);
    this.#places = new Float32Array(3 * file.vertices);
    this.#tissue = new Float32Array(3 * file.vertices);
    this.#light = new Float32Array(file.vertices);
    const place = (values: ArrayBufferView | null, target: number) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      if (values) gl.bufferData(target, values, gl.STATIC_DRAW);
      return buffer;
    };
    this.#buffers = {
      places: place(null, gl.ARRAY_BUFFER),
      light: place(null, gl.ARRAY_BUFFER),
      cloth: place(file.tracks.cloth.still, gl.ARRAY_BUFFER),
    };
    place(file.triangles, gl.ELEMENT_ARRAY_BUFFER);
    gl.useProgram(this.#program);
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
    this.#attach("cloth", this.#buffers.cloth, 1);
  }

  /**
   * Draws a moment of the loop (0 to 1), without tissue in so much of the picture from its left edge, in the light of the
   * dark scheme or of the light one.
   */
  draw(
    moment: number,
    leftShare: number,
    framing: Framing,
    pixelRatio: number,
    isDark: boolean,
  ): void {
    const gl = this.#gl;
    const canvas = this.#canvas;
    const { frames, tracks } = this.#file;
    const width = Math.max(1, Math.round(canvas.clientWidth * pixelRatio));
    const height = Math.max(1, Math.round(canvas.clientHeight * pixelRatio));
    // What is set gets new memory, even where it is the same.
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    mix(tracks.places, frames, moment, this.#places);
    mix(tracks.tissue, frames, moment, this.#tissue);
    mix(tracks.light, frames, moment, this.#light);
    this.#upload("light", this.#buffers.light, this.#light, 1);
    gl.viewport(0, 0, canvas.width, canvas.height);
    const palette = this.#file.palettes[isDark ? 1 : 0];
    gl.uniformMatrix3fv(this.#uniform("skin"), false, palette.subarray(0, 9));
    gl.uniformMatrix3fv(this.#uniform("clothes"), false, palette.subarray(9));
    const { reachM, rightM, upM, fovYRadians } = framing;
    gl.uniform4f(this.#uniform("camera"), rightM, upM, reachM, Math.tan(fovYRadians / 2));
    gl.uniform1f(this.#uniform("aspect"), canvas.width / canvas.height);
    const seam = Math.round(canvas.width * leftShare);
    gl.enable(gl.SCISSOR_TEST);
    this.#drawPart(0, seam);
    for (const [at, offset] of this.#tissue.entries()) {
      this.#places[at] = (this.#places[at] ?? 0) + offset;
    }
    this.#drawPart(seam, canvas.width);
  }

  /** Gives back what it holds of the graphics card. */
  dispose(): void {
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #drawPart(fromPx: number, toPx: number): void {
    const gl = this.#gl;
    if (toPx <= fromPx) return;
    this.#upload("place", this.#buffers.places, this.#places, 3);
    gl.scissor(fromPx, 0, toPx - fromPx, this.#canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawElements(gl.TRIANGLES, this.#file.triangles.length, gl.UNSIGNED_SHORT, 0);
  }

  #upload(name: string, buffer: WebGLBuffer, planes: Float32Array, count: number): void {
    const gl = this.#gl;
    const { vertices } = this.#file;
    const values =
      count === 1
        ? planes
        : Float32Array.from(
            planes,
            (_, at) => planes[(at % count) * vertices + Math.floor(at / count)] ?? 0,
          );
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    this.#attach(name, buffer, count);
  }

  #attach(name: string, buffer: WebGLBuffer, count: number): void {
    const gl = this.#gl;
    const location = gl.getAttribLocation(this.#program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, count, gl.FLOAT, false, 0, 0);
  }

  #uniform(name: string): WebGLUniformLocation | null {
    return this.#gl.getUniformLocation(this.#program, name);
  }
}

function linkedProgram(gl: WebGL2RenderingContext): WebGLProgram {
  const program = gl.createProgram();
  for (const [type, text] of [
    [gl.VERTEX_SHADER, VERTEX],
    [gl.FRAGMENT_SHADER, FRAGMENT],
  ] as const) {
    const shader = gl.createShader(type);
    if (!shader) throw new Error("The graphics card is lost.");
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`The baked loop cannot be drawn: ${gl.getProgramInfoLog(program)}`);
  }
  return program;
}
