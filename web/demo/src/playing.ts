import { type Avatar, type Motion, POSE_LENGTH, type Pose } from "dynaskin";

/** Seconds of motion that are stepped through before a moment that is jumped to. */
const WARM_UP_SECONDS = 2;
const TICK_SECONDS = 1 / 60;
/** Longest part of a motion that one display frame may advance, after a stall. */
const MAX_FRAME_SECONDS = 0.25;

/** Plays a motion on an avatar: the clock of the page, with pause, slow motion and jumps. */
export class Playback {
  /** Playback speed; 1 is real time. The tissue slows down with the skeleton. */
  speed = 1;
  /** Whether the clock stands still. */
  paused = false;
  /** How often the motion has been played to its end. */
  rounds = 0;
  /** The pose last given to the avatar. */
  readonly pose: Pose = new Float64Array(POSE_LENGTH);
  #timeSeconds = 0;
  #avatar: Avatar;
  #motion: Motion;

  constructor(avatar: Avatar, motion: Motion) {
    this.#avatar = avatar;
    this.#motion = motion;
    this.seek(0);
  }

  /** Where in the motion it is, in seconds. */
  get timeSeconds(): number {
    return this.#timeSeconds;
  }

  /** The motion that plays. */
  get motion(): Motion {
    return this.#motion;
  }

  /** The avatar it plays on. */
  get avatar(): Avatar {
    return this.#avatar;
  }

  /** Plays another motion from its beginning. */
  setMotion(motion: Motion): void {
    this.#motion = motion;
    this.rounds = 0;
    this.seek(0);
  }

  /** Goes on with another avatar at the same moment. */
  setAvatar(avatar: Avatar, motion: Motion): void {
    this.#avatar = avatar;
    this.#motion = motion;
    this.seek(Math.min(this.#timeSeconds, motion.durationSeconds));
  }

  /** Advances by a display frame of `elapsedSeconds` of real time. */
  frame(elapsedSeconds: number): void {
    if (this.paused) return;
    this.advance(Math.min(elapsedSeconds, MAX_FRAME_SECONDS) * this.speed);
  }

  /** Advances by `seconds` of motion. A motion that ends starts again, with settled tissue. */
  advance(seconds: number): void {
    const { durationSeconds } = this.#motion;
    const next = this.#timeSeconds + seconds;
    if (next >= durationSeconds) {
      this.rounds += 1;
      this.#avatar.reset();
      this.#apply(0, 0);
      return;
    }
    this.#apply(next, seconds);
  }

  /** One tick of the model's clock, 1/60 s. */
  step(): void {
    this.advance(TICK_SECONDS);
  }

  /** One tick in the present pose. */
  hold(): void {
    this.#avatar.step(this.pose, TICK_SECONDS);
  }

  /**
   * Jumps to a moment, with the tissue as if the motion had been playing for two seconds (or from
   * its beginning, when that is nearer, or from `fromSeconds`). The same call gives the same skin.
   */
  seek(timeSeconds: number, fromSeconds = Math.max(0, timeSeconds - WARM_UP_SECONDS)): void {
    const ticks = Math.round((timeSeconds - fromSeconds) / TICK_SECONDS);
    this.#avatar.reset();
    this.#apply(timeSeconds - ticks * TICK_SECONDS, 0);
    for (let tick = 1; tick <= ticks; tick += 1) {
      this.#apply(timeSeconds - (ticks - tick) * TICK_SECONDS, TICK_SECONDS);
    }
  }

  /** Gives the avatar the present pose again, after its shape or a gain changed. */
  refresh(): void {
    this.#apply(this.#timeSeconds, 0);
  }

  #apply(timeSeconds: number, dtSeconds: number): void {
    this.#timeSeconds = Math.max(0, timeSeconds);
    this.#motion.poseAt(this.#timeSeconds, this.pose);
    this.#avatar.step(this.pose, dtSeconds);
  }
}
