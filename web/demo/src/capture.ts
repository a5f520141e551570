import { type ClipTexts, drawSquare, makeClip, SIDE_PX } from "./clip.js";
import { byId } from "./dom.js";
import { showError, showWhile } from "./toast.js";
import type { View } from "./view.js";

const RECORDING_FPS = 30;
const LONGEST_RECORDING_SECONDS = 20;
const CLIP_SECONDS = 4;
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

/** Pictures and short recordings of what the canvases show. */
export class Capture {
  readonly #view: View;
  readonly #redraw: () => void;
  readonly #canvas = document.createElement("canvas");
  #recorder: MediaRecorder | null = null;
  /** What is written into a recording that stands in for a film. */
  #texts: ClipTexts | null = null;
  #stopTimer = 0;
  #isFilming = false;

  /** `redraw` draws a picture at once, since a canvas keeps none for later. */
  constructor(view: View, redraw: () => void) {
    this.#view = view;
    this.#redraw = redraw;
    byId("picture").addEventListener("click", () => void this.savePicture());
    byId("record").addEventListener("click", () => this.toggleRecording());
  }

  /** Saves the picture as PNG. */
  async savePicture(): Promise<void> {
    this.#redraw();
    this.#compose();
    const blob = await new Promise<Blob | null>((done) => this.#canvas.toBlob(done, "image/png"));
    if (blob) save(blob, "dynaskin.png");
    else
      showError("No picture was made", new Error("The browser did not make a PNG of the canvas."));
  }

  /**
   * Saves a square film of four seconds as MP4: `advance` moves the page on by so many seconds and draws. Where
   * the browser cannot make one, a recording of four seconds is saved. Resolves when it is.
   */
  async saveClip(texts: ClipTexts, advance: (seconds: number) => void): Promise<void> {
    if (this.isBusy) return;
    this.#isFilming = true;
    const unsay = showWhile(
      "Filming",
      "Four seconds, frame by frame. The video is saved when it is done.",
    );
    try {
      const clip = await makeClip(this.#view, texts, advance);
      if (clip) save(clip, "dynaskin.mp4");
      else {
        // Its clock is the page's.
        this.#isFilming = false;
        unsay();
        this.#texts = texts;
        this.toggleRecording(CLIP_SECONDS);
        await new Promise<unknown>((done) => {
          if (this.#recorder) this.#recorder.addEventListener("stop", done);
          else done(null);
        });
      }
    } catch (error) {
      showError("No film was made", error);
    } finally {
      this.#isFilming = false;
      this.#texts = null;
      unsay();
    }
  }

  /** Whether a film or a recording is being made. */
  get isBusy(): boolean {
    return this.#isFilming || this.#recorder !== null;
  }

  /** Whether a film is being made, whose clock is its own. */
  get isFilming(): boolean {
    return this.#isFilming;
  }

  /** Begins a recording, or ends it and saves it as WebM. */
  toggleRecording(longestSeconds = LONGEST_RECORDING_SECONDS): void {
    if (this.#recorder) {
      this.#recorder.stop();
      return;
    }
    const type = globalThis.MediaRecorder && TYPES.find((t) => MediaRecorder.isTypeSupported(t));
    if (!type || !this.#canvas.captureStream) {
      showError(
        "This browser cannot record",
        new Error("It has no MediaRecorder for WebM. A picture can still be saved."),
      );
      return;
    }
    this.#redraw();
    this.#compose();
    const stream = this.#canvas.captureStream(RECORDING_FPS);
    this.#start(new MediaRecorder(stream, { mimeType: type }), longestSeconds);
  }

  /** Whether pictures are taken, of a body that stands still too. */
  get isRecording(): boolean {
    return this.#recorder !== null;
  }

  /** Takes over a picture that has just been drawn, while recording. */
  afterDraw(): void {
    if (this.#recorder) this.#compose();
  }

  #start(recorder: MediaRecorder, longestSeconds: number): void {
    const parts: Blob[] = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    const unsay = showWhile("Recording", `Press again to stop; it ends after ${longestSeconds} s.`);
    recorder.addEventListener("stop", () => {
      unsay();
      clearTimeout(this.#stopTimer);
      for (const track of recorder.stream.getTracks()) track.stop();
      this.#recorder = null;
      this.#showRecording(false);
      save(new Blob(parts, { type: "video/webm" }), "dynaskin.webm");
    });
    recorder.start();
    this.#recorder = recorder;
    this.#showRecording(true);
    const stop = () => recorder.state === "recording" && recorder.stop();
    this.#stopTimer = window.setTimeout(stop, longestSeconds * 1000);
  }

  #showRecording(on: boolean): void {
    byId("record").setAttribute("aria-pressed", `${on}`);
    byId("record-text").textContent = on ? "Stop recording" : "Record";
  }

  #compose(): void {
    const { parts } = this.#view;
    const [bottom] = parts;
    if (!bottom) return;
    const out = this.#canvas;
    if (this.#texts) {
      if (out.width !== SIDE_PX || out.height !== SIDE_PX) {
        Object.assign(out, { width: SIDE_PX, height: SIDE_PX });
      }
      const square = out.getContext("2d");
      if (square) drawSquare(square, this.#view, this.#texts);
      return;
    }
    const { width, height } = bottom.canvas;
    // A recorder does not follow a change of size: it goes on in its own, with bars where it must.
    if (!this.#recorder && (out.width !== width || out.height !== height)) {
      Object.assign(out, { width, height });
    }
    const context = out.getContext("2d");
    if (!context || width === 0 || height === 0) return;
    const scale = Math.min(out.width / width, out.height / height);
    const [left, top] = [(out.width - scale * width) / 2, (out.height - scale * height) / 2];
    if (left > 0 || top > 0) {
      context.fillStyle = "#000";
      context.fillRect(0, 0, out.width, out.height);
    }
    for (const { canvas, from, to } of parts) {
      const span = (to - from) * canvas.width;
      if (span < 1) continue;
      const [source, at] = [from * canvas.width, left + scale * from * width];
      const [wide, high] = [scale * (to - from) * width, scale * height];
      context.drawImage(canvas, source, 0, span, canvas.height, at, top, wide, high);
    }
  }
}

function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  const link = Object.assign(document.createElement("a"), { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
