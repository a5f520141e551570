import type { Avatar, Body, RegionName } from "dynaskin";
import { byId } from "./dom.js";
import type { View } from "./view.js";

/** The regions whose foremost points are measured. */
const MEASURED: readonly RegionName[] = ["chest", "belly"];
const LINE_PX = 2.5;
/** How far beside its point a number stands, as a share of the picture's height. */
const ASIDE = 0.12;

/** What is known of a body's surface before it moves. */
interface Outlined {
  body: Body;
  /** Per edge two vertices and the faces on both sides. */
  edges: Int32Array;
  /** The points that are measured. */
  points: readonly number[];
}

/** The outline of the body without tissue over the picture of the one with it, and two distances. */
export class Ghost {
  readonly #view: View;
  readonly #canvas = byId<HTMLCanvasElement>("ghost");
  #outlined: Outlined | null = null;
  #places = new Float32Array();
  #isClear = true;

  constructor(view: View) {
    this.#view = view;
  }

  /** Takes the outline away. */
  clear(): void {
    if (this.#isClear) return;
    this.#isClear = true;
    this.#canvas.width = 0;
    byId("ghost-text").textContent = "";
  }

  /** Draws the outline of `plain`, and how far `moved` is from it. */
  draw(body: Body, plain: Avatar, moved: Avatar): void {
    this.#isClear = false;
    if (this.#outlined?.body !== body) this.#outlined = outlinedOf(body, plain);
    const context = this.#resize();
    if (!context) return;
    this.#projectAll(plain.skinned().positions);
    this.#drawOutline(context, body.faces, this.#outlined.edges);
    this.#drawDistances(context, moved, this.#outlined.points);
  }

  #resize(): CanvasRenderingContext2D | null {
    const { clientWidth, clientHeight } = this.#canvas;
    const scale = Math.min(devicePixelRatio, 2);
    const [width, height] = [Math.round(clientWidth * scale), Math.round(clientHeight * scale)];
    if (this.#canvas.width !== width || this.#canvas.height !== height) {
      Object.assign(this.#canvas, { width, height });
    }
    const context = this.#canvas.getContext("2d");
    context?.setTransform(scale, 0, 0, scale, 0, 0);
    context?.clearRect(0, 0, clientWidth, clientHeight);
    return context;
  }

  #projectAll(positions: Float32Array): void {
    const count = positions.length / 3;
    if (this.#places.length !== 2 * count) this.#places = new Float32Array(2 * count);
    const project = this.#view.projector();
    for (let vertex = 0; vertex < count; vertex += 1) {
      const at = 3 * vertex;
      const [xPx, yPx] = project(
        positions[at] ?? 0,
        positions[at + 1] ?? 0,
        positions[at + 2] ?? 0,
      );
      this.#places[2 * vertex] = xPx;
      this.#places[2 * vertex + 1] = yPx;
    }
  }

  /** Where faces that look here meet faces that look away; what other faces cover is wiped out. */
  #drawOutline(context: CanvasRenderingContext2D, faces: Uint32Array, edges: Int32Array): void {
    const x = (vertex: number) => this.#places[2 * vertex] ?? 0;
    const y = (vertex: number) => this.#places[2 * vertex + 1] ?? 0;
    const corner = (face: number, idx: number) => faces[3 * face + idx] ?? 0;
    const facing = new Uint8Array(faces.length / 3);
    const front = new Path2D();
    for (let face = 0; face < facing.length; face += 1) {
      const [a, b, c] = [corner(face, 0), corner(face, 1), corner(face, 2)];
      const area = (x(b) - x(a)) * (y(c) - y(a)) - (x(c) - x(a)) * (y(b) - y(a));
      if (area >= 0) continue;
      facing[face] = 1;
      front.moveTo(x(a), y(a));
      front.lineTo(x(b), y(b));
      front.lineTo(x(c), y(c));
      front.closePath();
    }
    const outline = new Path2D();
    for (let at = 0; at < edges.length; at += 4) {
      const [a = 0, b = 0, one = 0, other = 0] = edges.subarray(at, at + 4);
      if (facing[one] === (other < 0 ? 0 : facing[other])) continue;
      outline.moveTo(x(a), y(a));
      outline.lineTo(x(b), y(b));
    }
    context.lineCap = "round";
    context.strokeStyle = "rgb(0 0 0 / 55%)";
    context.lineWidth = 2 * LINE_PX + 2;
    context.stroke(outline);
    context.strokeStyle = "#fff";
    context.lineWidth = 2 * LINE_PX;
    context.stroke(outline);
    context.globalCompositeOperation = "destination-out";
    context.fill(front);
    context.globalCompositeOperation = "source-over";
  }

  #drawDistances(
    context: CanvasRenderingContext2D,
    moved: Avatar,
    points: readonly number[],
  ): void {
    const { offsets } = moved;
    const { positions } = moved.skinned();
    const project = this.#view.projector();
    const texts: string[] = [];
    const { clientWidth, clientHeight } = this.#canvas;
    context.font = "650 20px system-ui, sans-serif";
    context.textBaseline = "middle";
    for (const [idx, vertex] of points.entries()) {
      const [x = 0, y = 0, z = 0] = positions.subarray(3 * vertex, 3 * vertex + 3);
      const [toX, toY] = project(x, y, z);
      const [fromX = 0, fromY = 0] = this.#places.subarray(2 * vertex, 2 * vertex + 2);
      const mm = Math.round(1000 * Math.hypot(...offsets.subarray(3 * vertex, 3 * vertex + 3)));
      const aside = Math.min(clientWidth - 84, toX + ASIDE * clientHeight);
      for (const [colour, width] of [
        ["rgb(0 0 0 / 60%)", 5],
        ["#fff", 2],
      ] as const) {
        context.strokeStyle = colour;
        context.lineWidth = width;
        context.beginPath();
        context.moveTo(fromX, fromY);
        context.lineTo(toX, toY);
        context.lineTo(aside - 8, toY);
        context.stroke();
      }
      context.fillStyle = "#fff";
      for (const [px, py] of [
        [fromX, fromY],
        [toX, toY],
      ] as const) {
        context.beginPath();
        context.arc(px, py, 4.5, 0, 7);
        context.fill();
      }
      drawLabel(context, `${mm} mm`, aside, toY);
      texts.push(`${MEASURED[idx]} ${mm} mm`);
    }
    byId("ghost-text").textContent = texts.join(", ");
  }
}

function drawLabel(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  context.fillStyle = "rgb(20 22 28 / 82%)";
  context.beginPath();
  context.roundRect(x - 8, y - 17, context.measureText(text).width + 20, 34, 10);
  context.fill();
  context.fillStyle = "#fff";
  context.fillText(text, x + 2, y + 1);
}

/** Edges with the faces beside them, and the foremost vertex of each measured region. */
function outlinedOf(body: Body, avatar: Avatar): Outlined {
  const { faces } = body;
  const known = new Map<number, number>();
  const edges: number[] = [];
  for (let at = 0; at < faces.length; at += 1) {
    const face = Math.floor(at / 3);
    const [a = 0, b = 0] = [faces[at], faces[at % 3 === 2 ? at - 2 : at + 1]];
    const key = Math.min(a, b) * body.vertexCount + Math.max(a, b);
    const place = known.get(key);
    if (place !== undefined) edges[place + 3] = face;
    else {
      known.set(key, edges.length);
      edges.push(a, b, face, -1);
    }
  }
  const { positions } = avatar;
  const points = MEASURED.map((region) => {
    const weights = body.regionWeights(region);
    let best = -1;
    for (const [vertex, weight] of weights.entries()) {
      const isAhead = best < 0 || (positions[3 * vertex + 2] ?? 0) > (positions[3 * best + 2] ?? 0);
      if (weight > 0.6 && isAhead) best = vertex;
    }
    return Math.max(0, best);
  });
  return { body, edges: Int32Array.from(edges), points };
}
