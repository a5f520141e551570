// The resolution follows the frame time. The clock is the test's own: nothing here waits.
import { afterEach, describe, expect, it, vi } from "vitest";
import { AdaptiveResolution } from "../dist/renderer/resolution.js";
import { Renderer } from "../dist/renderer.js";

/** A screen whose frames take `frameMs(scale)` milliseconds, played for some seconds. */
class Screen {
  readonly resolution: AdaptiveResolution;
  /** Every change: when, and to which scale. */
  readonly changes: { atMs: number; scale: number }[] = [];
  nowMs = 0;

  constructor(isDrawnInSoftware = false) {
    this.resolution = new AdaptiveResolution(60, 0.5, isDrawnInSoftware);
  }

  play(seconds: number, frameMs: (scale: number) => number): void {
    const endMs = this.nowMs + seconds * 1000;
    while (this.nowMs < endMs) {
      this.nowMs += frameMs(this.resolution.scale);
      if (this.resolution.frame(this.nowMs)) {
        this.changes.push({ atMs: this.nowMs, scale: this.resolution.scale });
      }
    }
  }
}

const REFRESH_MS = 1000 / 60;
/** A card that takes `fullMs` for all pixels, on a display of 60 Hz. */
const card = (fullMs: number) => (scale: number) => Math.max(REFRESH_MS, fullMs * scale ** 2);

describe("adaptive resolution", () => {
  it("stays as it is while frames are in time", () => {
    const screen = new Screen();
    screen.play(60, card(10));
    expect(screen.changes).toEqual([]);
    expect(screen.resolution.scale).toBe(1);
  });

  it("falls until frames are in time, and no further than allowed", () => {
    const screen = new Screen();
    screen.play(4, card(30));
    expect(30 * screen.resolution.scale ** 2).toBeLessThan(REFRESH_MS * 1.25);
    expect(screen.resolution.scale).toBeGreaterThan(0.6);
    const slower = new Screen();
    slower.play(20, card(150));
    expect(slower.resolution.scale).toBe(0.5);
  });

  it("helps a card that manages two pictures a second within seconds", () => {
    const screen = new Screen();
    screen.play(8, card(450));
    expect(screen.resolution.scale).toBe(0.5);
  });

  it("helps where a picture takes longer than a second, and takes one pause for a pause", () => {
    const screen = new Screen();
    screen.play(1, card(10));
    screen.play(1, () => 1500);
    screen.play(1, card(10));
    expect(screen.changes).toEqual([]);
    screen.play(12, card(1500));
    expect(screen.resolution.scale).toBe(0.5);
  });

  it("begins with few pixels where the processor draws, and has all once it is in time", () => {
    const screen = new Screen(true);
    expect(screen.resolution.scale).toBe(0.5);
    screen.play(30, card(10));
    expect(screen.resolution.scale).toBe(1);
  });

  it("comes back to all pixels when the load goes", () => {
    const screen = new Screen();
    screen.play(10, card(40));
    expect(screen.resolution.scale).toBeLessThan(1);
    screen.play(120, card(5));
    expect(screen.resolution.scale).toBe(1);
  });

  it("tries too many pixels again later and later", () => {
    const screen = new Screen();
    screen.play(180, card(30));
    const ups = screen.changes.filter(
      ({ scale }, idx) => idx > 0 && scale > (screen.changes[idx - 1]?.scale ?? 1),
    );
    const gapsMs = ups.slice(1).map(({ atMs }, idx) => atMs - (ups[idx]?.atMs ?? 0));
    expect(gapsMs.length).toBeGreaterThan(2);
    for (const [idx, gapMs] of gapsMs.slice(1).entries()) {
      expect(gapMs).toBeGreaterThan((gapsMs[idx] ?? 0) * 0.95);
    }
    // Three minutes at the edge: a constant wait of two seconds would change sixty times and more.
    expect(screen.changes.length).toBeLessThan(20);
  });

  it("gives the sharp picture back where fewer pixels do not help", () => {
    const screen = new Screen();
    screen.play(30, () => 1000 / 30);
    expect(screen.resolution.scale).toBe(1);
    expect(screen.changes.length).toBe(3);
  });

  it("takes neither single stalls nor a hidden tab for slow frames", () => {
    const screen = new Screen();
    let frame = 0;
    screen.play(60, () => {
      frame += 1;
      if (frame % 200 === 0) return 30_000;
      return frame % 7 === 0 ? 90 : REFRESH_MS;
    });
    expect(screen.changes).toEqual([]);
  });
});

describe("the renderer with adaptive resolution", () => {
  afterEach(() => vi.restoreAllMocks());

  /** A renderer whose sizes and pictures are written down. */
  function recorded(resolution: AdaptiveResolution | null): [renderer: Renderer, calls: string[]] {
    const calls: string[] = [];
    const raw = {
      backend: "webgl2",
      adapter: "none",
      lost: () => new Promise(() => {}),
      resize: (...size: number[]) => calls.push(size.map((value) => value.toFixed(2)).join(" ")),
      render: () => calls.push("drawn") > 0,
    };
    // Pages make one with createRenderer; its types hide the constructor.
    const Constructor = Renderer as unknown as new (...parts: unknown[]) => Renderer;
    const renderer = new Constructor(new EventTarget(), raw, resolution);
    renderer.resize(640, 480, 2);
    return [renderer, calls];
  }

  /** What reaches the graphics card when frames take 40 ms, then 5. */
  function sizesAndPictures(resolution: AdaptiveResolution | null): string[] {
    let nowMs = 0;
    vi.spyOn(performance, "now").mockImplementation(() => nowMs);
    const [renderer, calls] = recorded(resolution);
    for (let frame = 0; frame < 2000; frame += 1) {
      nowMs += Math.max(16, (frame < 200 ? 40 : 5) * renderer.resolutionScale ** 2);
      renderer.render();
    }
    return calls;
  }

  it("resizes just before a picture, keeps the page's size and comes back", () => {
    const calls = sizesAndPictures(new AdaptiveResolution());
    const resized = calls.filter((call) => call !== "drawn");
    expect(resized.length).toBeGreaterThan(3);
    expect(resized[1]).toBe("640.00 480.00 1.67");
    expect(resized.at(-1)).toBe("640.00 480.00 2.00");
    for (const [idx, call] of calls.entries()) {
      if (call !== "drawn") expect(calls[idx + 1]).toBe("drawn");
    }
  });

  it("draws a picture that stands with all pixels, and the next ones as before", () => {
    const [renderer, calls] = recorded(new AdaptiveResolution(60, 0.5, true));
    expect(renderer.resolutionScale).toBe(0.5);
    for (const allPixels of [false, true, true, false]) renderer.render({ allPixels });
    const [few, all] = ["640.00 480.00 1.00", "640.00 480.00 2.00"];
    expect(calls).toEqual([few, "drawn", all, "drawn", "drawn", few, "drawn"]);
  });

  it("leaves the size alone where it is off", () => {
    const calls = sizesAndPictures(null);
    expect(calls.filter((call) => call !== "drawn")).toEqual(["640.00 480.00 2.00"]);
  });
});
