import { lessMotion } from "./less-motion.js";

/** Share of the way to the body that the camera covers per second, as a rate. */
const FOLLOW_PER_SECOND = 5;
/** How far the body may go from the middle of a picture that is not to drift, in metres. */
const STRAY_M = 0.7;
const MIN_DISTANCE_M = 0.5;
const MAX_DISTANCE_M = 9;
/** Nearer than this, the picture does not hold all of a body, in metres. */
const CLOSE_M = 2;
const RADIANS_PER_PIXEL = 0.006;
/** What a key raises or lowers the camera by, in metres. */
const KEY_RAISE_M = 0.08;
/** The angle around +Y at which the page starts. */
export const START_YAW_RADIANS = 0.38;
const START = { yawRadians: START_YAW_RADIANS, pitchRadians: 0.1, distanceM: 3.8, heightM: 0.86 };

/** A camera on a sphere around the body: drag orbits, wheel and pinch zoom, two fingers shift. */
export class OrbitCamera {
  /** Angle around +Y; 0 looks at the body's face from +Z. */
  yawRadians = START.yawRadians;
  /** Angle above the horizon. */
  pitchRadians = START.pitchRadians;
  /** From the target, as the visitor chose it. */
  distanceM = START.distanceM;
  /** Factor on the distance, for pictures that have to show more. */
  retreat = 1;
  /** Height of the target over the floor. */
  heightM = START.heightM;
  /** How far a body that jumps has taken the camera up, in metres. */
  riseM = 0;
  /** What the camera goes back to: as {@link place}. */
  home: readonly number[] | null = null;
  /** The floor point under the target, which follows the body. */
  readonly floorM = { x: 0, z: 0 };
  readonly #pointers = new Map<number, { x: number; y: number }>();

  constructor(canvas: HTMLCanvasElement) {
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(end, (event) => this.#pointers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Back to the view the page starts with. */
  reset(): void {
    this.place = this.home;
  }

  /** Yaw and pitch in radians, distance and height in metres; null: as at the start. */
  get place(): readonly number[] | null {
    const now = [this.yawRadians, this.pitchRadians, this.distanceM, this.heightM];
    const start = Object.values(START);
    return now.some((value, idx) => Math.abs(value - (start[idx] ?? 0)) > 1e-3) ? now : null;
  }

  set place(place: readonly number[] | null) {
    const [yaw = 0, pitch = 0, distance = 0, height = 0] = place ?? Object.values(START);
    this.yawRadians = yaw;
    this.pitchRadians = Math.max(-0.25, Math.min(1.45, pitch));
    this.distanceM = Math.max(MIN_DISTANCE_M, Math.min(MAX_DISTANCE_M, distance));
    this.heightM = Math.max(0.05, Math.min(2, height));
  }

  /**
   * Goes after the body, which is over a point of the floor (metres), for a frame of so many seconds;
   * 0 after a jump in time. For visitors who ask for less motion the camera stands until the body would
   * leave the picture, and is there at once then.
   */
  followBody(xM: number, zM: number, elapsedSeconds: number): void {
    let share = elapsedSeconds === 0 ? 1 : 1 - Math.exp(-FOLLOW_PER_SECOND * elapsedSeconds);
    if (lessMotion.matches) {
      const strayM = Math.hypot(xM - this.floorM.x, zM - this.floorM.z);
      share = elapsedSeconds === 0 || strayM > STRAY_M ? 1 : 0;
    }
    this.follow(xM, zM, share);
  }

  /** Moves the target towards a point of the floor, by `share` of the way. */
  follow(xM: number, zM: number, share: number): void {
    this.floorM.x += (xM - this.floorM.x) * share;
    this.floorM.z += (zM - this.floorM.z) * share;
  }

  /** From the target to the camera, in metres. */
  get reachM(): number {
    return this.distanceM * this.retreat;
  }

  /** What the camera looks at, in the world, in metres. */
  get targetWorldM(): [number, number, number] {
    return [this.floorM.x, this.heightM + this.riseM, this.floorM.z];
  }

  /** Whether it looks at a part of the body that fills the picture. */
  get isClose(): boolean {
    return this.distanceM < CLOSE_M;
  }

  /** Where the camera is, in the world, in metres; never below the floor. */
  get eyeWorldM(): [number, number, number] {
    const [x, y, z] = this.targetWorldM;
    const flat = this.reachM * Math.cos(this.pitchRadians);
    return [
      x + flat * Math.sin(this.yawRadians),
      Math.max(0.06, y + this.reachM * Math.sin(this.pitchRadians)),
      z + flat * Math.cos(this.yawRadians),
    ];
  }

  /** The way the camera looks: a unit vector of the world. */
  get awayM(): [number, number, number] {
    const [eye, target] = [this.eyeWorldM, this.targetWorldM];
    const way = target.map((value, axis) => value - (eye[axis] ?? 0));
    const length = Math.hypot(...way);
    const [x = 0, y = 0, z = 1] = way.map((value) => value / length);
    return [x, y, z];
  }

  /** The world vector of a move along the picture's right and up, in metres. */
  shiftM(rightM: number, upM: number): [number, number, number] {
    const [sinYaw, cosYaw] = [Math.sin(this.yawRadians), Math.cos(this.yawRadians)];
    const [sinPitch, cosPitch] = [Math.sin(this.pitchRadians), Math.cos(this.pitchRadians)];
    return [
      rightM * cosYaw - upM * sinPitch * sinYaw,
      upM * cosPitch,
      -rightM * sinYaw - upM * sinPitch * cosYaw,
    ];
  }

  #move(event: PointerEvent): void {
    const last = this.#pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.x;
    const dy = event.clientY - last.y;
    const others = [...this.#pointers].filter(([id]) => id !== event.pointerId);
    const other = others[0]?.[1];
    if (other) {
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      const now = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      this.#zoom(before / Math.max(now, 1));
      this.#lift(dy / 2);
    } else if (event.shiftKey || event.buttons === 4) {
      this.#lift(dy);
    } else {
      this.#orbit(-dx * RADIANS_PER_PIXEL, dy * RADIANS_PER_PIXEL);
    }
    last.x = event.clientX;
    last.y = event.clientY;
  }

  #wheel(event: WheelEvent): void {
    // The story is the top of a page that scrolls; a pinch on a touchpad comes with Ctrl.
    if (document.documentElement.classList.contains("story-on") && !event.ctrlKey) return;
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    this.#zoom(Math.exp(Math.max(-120, Math.min(120, event.deltaY * lines)) * 0.0016));
  }

  #key(event: KeyboardEvent): void {
    const moves: Record<string, () => void> = {
      ArrowLeft: () => this.#orbit(-0.08, 0),
      ArrowRight: () => this.#orbit(0.08, 0),
      ArrowUp: () => this.#orbit(0, 0.06),
      ArrowDown: () => this.#orbit(0, -0.06),
      "+": () => this.#zoom(0.9),
      "-": () => this.#zoom(1.1),
      PageUp: () => this.#raise(KEY_RAISE_M),
      PageDown: () => this.#raise(-KEY_RAISE_M),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  }

  #orbit(yaw: number, pitch: number): void {
    this.yawRadians += yaw;
    this.pitchRadians = Math.max(-0.25, Math.min(1.45, this.pitchRadians + pitch));
  }

  #zoom(factor: number): void {
    this.distanceM = Math.max(MIN_DISTANCE_M, Math.min(MAX_DISTANCE_M, this.distanceM * factor));
  }

  #lift(pixels: number): void {
    this.#raise((pixels * this.distanceM) / 1000);
  }

  #raise(metres: number): void {
    this.heightM = Math.max(0.05, Math.min(2, this.heightM + metres));
  }
}
