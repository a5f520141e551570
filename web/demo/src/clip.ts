import type { View } from "./view.js";

/** Width and height of a film, in its pixels and in the page's while it is made. */
export const SIDE_PX = 720;
const FPS = 30;
const SECONDS = 4;
const BITS_PER_SECOND = 5e6;
/** Height of a name, and of the smaller names of a row of bodies. */
const NAME_PX = 26;
const ROW_NAME_PX = 22;
/** Around a text on its plate, and around the plate. */
const PADDING_PX = 10;
const GAP_PX = 10;
/** In the order in which players are likely to know them. */
const CODECS = ["avc", "av1", "vp9"] as const;

/** What is written into a clip. */
export interface ClipTexts {
  names: readonly string[];
  /** Where in the picture each name has its middle, as shares of its width from the left; null: at the left and right. */
  middles: () => readonly number[] | null;
  /** Where the page is. */
  address: string;
}

/**
 * Makes a square film of what the page shows, picture by picture, so that a slow machine films as smoothly as a
 * fast one: `advance` moves the page on and draws. Null where the browser encodes nothing that MP4 holds.
 */
export async function makeClip(
  view: View,
  texts: ClipTexts,
  advance: (seconds: number) => void,
): Promise<Blob | null> {
  // Few visitors take a clip along: its writer is no part of the first view.
  const { BufferTarget, CanvasSource, getFirstEncodableVideoCodec, Mp4OutputFormat, Output } =
    await import("mediabunny");
  const size = { width: SIDE_PX, height: SIDE_PX, bitrate: BITS_PER_SECOND };
  const codec = await getFirstEncodableVideoCodec([...CODECS], size);
  if (!codec) return null;
  const canvas = Object.assign(document.createElement("canvas"), size);
  const context = canvas.getContext("2d");
  if (!context) return null;
  const target = new BufferTarget();
  const output = new Output({ format: new Mp4OutputFormat({ fastStart: "in-memory" }), target });
  const source = new CanvasSource(canvas, { codec, bitrate: BITS_PER_SECOND });
  output.addVideoTrack(source, { frameRate: FPS });
  await output.start();
  for (let idx = 0; idx < SECONDS * FPS; idx += 1) {
    advance(1 / FPS);
    drawSquare(context, view, texts);
    await source.add(idx / FPS, 1 / FPS);
  }
  await output.finalize();
  return target.buffer && new Blob([target.buffer], { type: "video/mp4" });
}

/** Draws the middle of the picture on a square canvas, with the names and the address. */
export function drawSquare(context: CanvasRenderingContext2D, view: View, texts: ClipTexts): void {
  const [bottom] = view.parts;
  if (!bottom) return;
  const { width, height } = bottom.canvas;
  const scale = SIDE_PX / Math.max(1, Math.min(width, height));
  const left = (SIDE_PX - scale * width) / 2;
  const top = (SIDE_PX - scale * height) / 2;
  let divider: number | null = null;
  for (const { canvas, from, to } of view.parts) {
    const span = (to - from) * canvas.width;
    if (span < 1) continue;
    const wide = scale * (to - from) * width;
    const at = left + scale * from * width;
    context.drawImage(
      canvas,
      ...[from * canvas.width, 0, span, canvas.height],
      ...([at, top, wide, scale * height] as const),
    );
    if (from === 0 && to < 1) divider = at + wide;
  }
  if (divider !== null) {
    context.fillStyle = "rgb(255 255 255 / 85%)";
    context.fillRect(divider - 1, 0, 2, SIDE_PX);
  }
  const { names, address } = texts;
  const middles = names.length > 1 ? texts.middles() : null;
  const sizePx = middles ? ROW_NAME_PX : NAME_PX;
  names.forEach((name, idx) => {
    const share = middles?.[idx];
    const isLast = names.length > 1 && idx === names.length - 1;
    const at = share === undefined ? (isLast ? "right" : "left") : SIDE_PX * share;
    drawText(context, name, at, 20, sizePx, SIDE_PX / (middles ? names.length : 1));
  });
  drawText(context, address, "left", SIDE_PX - 48, 22, SIDE_PX);
}

/** Writes a text at a side of the picture, or with its middle so many pixels from the left, as wide as `mostPx` at most. */
function drawText(
  context: CanvasRenderingContext2D,
  text: string,
  at: "left" | "right" | number,
  top: number,
  wantedPx: number,
  mostPx: number,
): void {
  const font = (px: number) => `650 ${px}px system-ui, sans-serif`;
  context.font = font(wantedPx);
  const room = mostPx - 2 * (PADDING_PX + GAP_PX);
  const sizePx = wantedPx * Math.min(1, room / context.measureText(text).width);
  context.font = font(sizePx);
  context.textBaseline = "top";
  const width = context.measureText(text).width;
  const edge = PADDING_PX + GAP_PX;
  const wanted = at === "left" ? edge : at === "right" ? SIDE_PX : at - width / 2;
  const x = Math.max(edge, Math.min(SIDE_PX - edge - width, wanted));
  context.fillStyle = "rgb(20 22 28 / 62%)";
  context.beginPath();
  context.roundRect(x - PADDING_PX, top - 6, width + 2 * PADDING_PX, sizePx + 14, 10);
  context.fill();
  context.fillStyle = "#fff";
  context.fillText(text, x, top);
}
