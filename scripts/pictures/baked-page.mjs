// What `npm run pictures -- baked` runs in the page of the built demo.

/**
 * Where each vertex of both surfaces is at a moment of the motion, as they are drawn: in the world, metres, as base64 of
 * floats. Only WebGPU hands that back.
 *
 * @param {number} timeSeconds of the motion
 */
export async function surfacesAt(timeSeconds) {
  const { view } = window.dynaskinDemo;
  window.dynaskinDemo.seek(timeSeconds);
  const text = (floats) => {
    let bytes = "";
    for (const byte of new Uint8Array(floats.buffer)) bytes += String.fromCharCode(byte);
    return btoa(bytes);
  };
  const plain = text(await view.leftBody.readSkinnedPositions());
  return { plain, soft: text(await view.bodies[0].readSkinnedPositions()) };
}

/**
 * A moment of the story, of surfaces as {@link surfacesAt} has them: where each vertex is (right, up and towards the
 * camera from its target, metres), and the colour that the picture has there, where it is to be seen; and how far along
 * the edges that cross a hem it crosses them.
 */
export function record({ timeSeconds, plain, soft }) {
  /** How far behind what is in front of it a vertex may be and be seen, in metres; triangles are coarse. */
  const DEPTH_M = 0.01;
  /** How far around it the body must go on, in metres of depth: at an outline, pixels have the background in them. */
  const AROUND_M = 0.03;
  /** How far from a vertex's place its colour is looked for, in pixels. */
  const REACH_PX = 3;

  const demo = window.dynaskinDemo;
  const { view } = demo;
  const { faces } = demo.model.body;
  const half = Math.round(innerWidth / 2);
  const canvas = new OffscreenCanvas(innerWidth, innerHeight);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  // It draws, and canvases have their pictures until the task ends.
  demo.seek(timeSeconds);
  for (const { canvas: part, from, to } of view.parts) {
    const [x, width] = [Math.round(from * innerWidth), Math.round((to - from) * innerWidth)];
    const scale = part.width / innerWidth;
    const source = [x * scale, 0, width * scale, part.height];
    context.drawImage(part, ...source, x, 0, width, innerHeight);
  }
  const { data: pixels } = context.getImageData(0, 0, innerWidth, innerHeight);

  const target = view.camera.targetWorldM;
  const axes = [view.camera.shiftM(1, 0), view.camera.shiftM(0, 1), view.camera.awayM];
  const depths = new Float32Array(innerWidth * innerHeight).fill(Number.NEGATIVE_INFINITY);
  const surfaces = [];
  for (const [idx, surface] of [plain, soft].entries()) {
    const bytes = Uint8Array.from(atob(surface), (letter) => letter.charCodeAt(0));
    const world = new Float32Array(bytes.buffer);
    const places = new Float32Array(world.length);
    const px = new Float32Array((world.length / 3) * 2);
    const project = view.projector();
    for (let at = 0; at < world.length; at += 3) {
      const from = [0, 1, 2].map((axis) => world[at + axis] - target[axis]);
      const along = axes.map((axis) => axis.reduce((sum, part, k) => sum + part * from[k], 0));
      places.set([along[0], along[1], -along[2]], at);
      px.set(project(...world.subarray(at, at + 3)), (at / 3) * 2);
    }
    surfaces.push({ places, px });
    draw(px, places, idx === 0 ? 0 : half, idx === 0 ? half : innerWidth);
  }

  const count = surfaces[0].places.length / 3;
  const colours = new Uint8Array(3 * count);
  const seen = new Uint8Array(count);
  const reach = [];
  for (let y = -REACH_PX; y <= REACH_PX; y += 1) {
    for (let x = -REACH_PX; x <= REACH_PX; x += 1) reach.push([x, y]);
  }
  reach.sort(([ax, ay], [bx, by]) => ax * ax + ay * ay - bx * bx - by * by);
  for (let vertex = 0; vertex < count; vertex += 1) {
    for (const [idx, { places, px }] of surfaces.entries()) {
      const [x, y] = [Math.floor(px[2 * vertex]), Math.floor(px[2 * vertex + 1])];
      if (x < half !== (idx === 0)) continue;
      const depth = places[3 * vertex + 2];
      const near = (atX, atY, mostM) =>
        atX > 0 &&
        atY > 0 &&
        atX < innerWidth - 1 &&
        atY < innerHeight - 1 &&
        Math.abs(depths[atY * innerWidth + atX] - depth) < mostM;
      const found = reach.find(
        ([dx, dy]) =>
          near(x + dx, y + dy, DEPTH_M) &&
          near(x + dx - 1, y + dy, AROUND_M) &&
          near(x + dx + 1, y + dy, AROUND_M) &&
          near(x + dx, y + dy - 1, AROUND_M) &&
          near(x + dx, y + dy + 1, AROUND_M),
      );
      if (!found) continue;
      const at = 4 * ((y + found[1]) * innerWidth + x + found[0]);
      colours.set(pixels.subarray(at, at + 3), 3 * vertex);
      seen[vertex] = 1;
    }
  }
  const text = ({ buffer }) => {
    let bytes = "";
    const all = new Uint8Array(buffer);
    for (let at = 0; at < all.length; at += 8192) {
      bytes += String.fromCharCode(...all.subarray(at, at + 8192));
    }
    return btoa(bytes);
  };
  return {
    plain: text(surfaces[0].places),
    soft: text(surfaces[1].places),
    colours: text(colours),
    seen: text(seen),
  };

  /** Draws the depth of a surface into columns of `depths`. */
  function draw(px, places, fromX, toX) {
    for (let at = 0; at < faces.length; at += 3) {
      const corners = faces.subarray(at, at + 3);
      const [ax, bx, cx] = Array.from(corners, (vertex) => px[2 * vertex]);
      const [ay, by, cy] = Array.from(corners, (vertex) => px[2 * vertex + 1]);
      const [az, bz, cz] = Array.from(corners, (vertex) => places[3 * vertex + 2]);
      const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
      if (area === 0) continue;
      const left = Math.max(fromX, Math.ceil(Math.min(ax, bx, cx) - 0.5));
      const right = Math.min(toX - 1, Math.floor(Math.max(ax, bx, cx) - 0.5));
      const top = Math.max(0, Math.ceil(Math.min(ay, by, cy) - 0.5));
      const bottom = Math.min(innerHeight - 1, Math.floor(Math.max(ay, by, cy) - 0.5));
      for (let y = top; y <= bottom; y += 1) {
        for (let x = left; x <= right; x += 1) {
          const b = ((x + 0.5 - ax) * (cy - ay) - (cx - ax) * (y + 0.5 - ay)) / area;
          const c = ((bx - ax) * (y + 0.5 - ay) - (x + 0.5 - ax) * (by - ay)) / area;
          if (b < 0 || c < 0 || b + c > 1) continue;
          const depth = az + b * (bz - az) + c * (cz - az);
          const pixel = y * innerWidth + x;
          if (depth > depths[pixel]) depths[pixel] = depth;
        }
      }
    }
  }
}

/** What does not change: triangles and how much of each vertex is cloth, of the body in two colours. */
export function bodyOf() {
  const { faces, colors } = window.dynaskinDemo.model.body;
  return { faces: Array.from(faces), colors: Array.from(colors) };
}
