// dynaskin without an engine: positions and normals go into vertex buffers, the shader skins them
// with the avatar's own matrices.
import { load, Motion } from "dynaskin";
import { showError, showNote } from "../src/shared/note.js";
import "../src/shared/hook.js";
import { lookAt, perspective } from "./camera.js";
import { createProgram, FRAGMENT, VERTEX } from "./shader.js";

const MODEL = new URL("../male/", location.href);
const SHAPE = [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

async function main() {
  const canvas = document.querySelector("canvas") as HTMLCanvasElement;
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) throw new Error("This browser has no WebGL2.");
  const model = await load({ model: MODEL });
  const { body } = model;
  const avatar = model.createAvatar({ shape: SHAPE });
  const motion = Motion.procedural("hop", avatar);

  const program = createProgram(gl, VERTEX, FRAGMENT);
  const attribute = (index: number, data: ArrayBufferView<ArrayBuffer>, usage: number) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    gl.enableVertexAttribArray(index);
    return buffer;
  };
  const positions = attribute(0, new Float32Array(body.vertexCount * 3), gl.DYNAMIC_DRAW);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  const normals = attribute(1, new Float32Array(body.vertexCount * 3), gl.DYNAMIC_DRAW);
  gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
  attribute(2, new Uint8Array(body.skinJoints), gl.STATIC_DRAW);
  gl.vertexAttribIPointer(2, 4, gl.UNSIGNED_BYTE, 0, 0);
  attribute(3, new Float32Array(body.skinWeights), gl.STATIC_DRAW);
  gl.vertexAttribPointer(3, 4, gl.FLOAT, false, 0, 0);
  attribute(4, new Uint8Array(body.colors), gl.STATIC_DRAW);
  gl.vertexAttribPointer(4, 4, gl.UNSIGNED_BYTE, true, 0, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(body.faces), gl.STATIC_DRAW);

  const pose = new Float64Array(99);
  let timeSeconds = 0;

  function animate(deltaSeconds: number) {
    timeSeconds = (timeSeconds + deltaSeconds) % motion.durationSeconds;
    avatar.step(motion.poseAt(timeSeconds, pose), deltaSeconds);
  }

  function draw(gl: WebGL2RenderingContext) {
    canvas.width = innerWidth * devicePixelRatio;
    canvas.height = innerHeight * devicePixelRatio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.clearColor(0.914, 0.902, 0.882, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    // The views go straight to the graphics card; they must not be kept.
    gl.bindBuffer(gl.ARRAY_BUFFER, positions);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, avatar.positions);
    gl.bindBuffer(gl.ARRAY_BUFFER, normals);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, avatar.normals);
    gl.useProgram(program);
    const uniform = (name: string) => gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(
      uniform("clip_from_view"),
      false,
      perspective(canvas.width / canvas.height),
    );
    gl.uniformMatrix4fv(uniform("view_from_world"), false, lookAt([1.6, 1.5, 4.6], [0, 1, 0]));
    gl.uniformMatrix4fv(uniform("world_from_rest"), false, avatar.skinMatrices);
    gl.drawElements(gl.TRIANGLES, body.faces.length, gl.UNSIGNED_INT, 0);
  }

  let playing = true;
  let lastMs = performance.now();
  function frame(gl: WebGL2RenderingContext) {
    const nowMs = performance.now();
    if (playing) animate((nowMs - lastMs) / 1000);
    lastMs = nowMs;
    draw(gl);
    requestAnimationFrame(() => frame(gl));
  }
  frame(gl);
  showNote("plain WebGL2", avatar);

  window.dynaskinExample = {
    avatar,
    showMoment(seconds) {
      playing = false;
      timeSeconds = 0;
      avatar.reset();
      for (let tick = 0; tick < seconds * 60; tick += 1) animate(1 / 60);
    },
  };
}

main().catch(showError);
