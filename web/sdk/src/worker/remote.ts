// What avatars and crowds in a worker have in common: changes, steps, and their answers.
import type { DynaSkinError } from "../error.js";
import { POSE_LENGTH, type Pose } from "../pose.js";
import { type Link, Refusal } from "./link.js";
import { buffersOf, type Doing, type State, type Stepped, type SurfaceArrays } from "./protocol.js";
import { disposed } from "./refusals.js";

/** Who waits until everything is answered. */
interface Waiting {
  resolve: () => void;
  reject: (error: unknown) => void;
}

/** @internal An avatar, as a step of the object that it belongs to moves it. */
export interface Member {
  readonly id: number;
  takeSpare(): SurfaceArrays;
  receiveStep(stepped: Stepped, idx: number): void;
}

/**
 * An object of a worker, as the page has it. Changes are sent at once and read as asked for until the
 * worker answers; of the steps only the newest waits while the worker is busy with another.
 */
export abstract class Remote<Target, Settings extends object> {
  /** @internal */
  readonly id: number;
  /** @internal */
  protected settings: Settings;
  readonly #link: Link;
  readonly #what: string;
  /** What else ends with this object. */
  readonly #onDispose: () => void;
  #isDisposed = false;
  #unansweredChanges = 0;
  #unansweredSteps = 0;
  #failure: DynaSkinError | null = null;
  readonly #idle: Waiting[] = [];
  #nextPoses = new Float64Array(POSE_LENGTH);
  #nextDtSeconds: number | null = null;
  #spentPoses = new Float64Array(0);

  /** @internal */
  constructor(
    { link, id, what }: { link: Link; id: number; what: string },
    settings: Settings,
    onDispose: () => void,
  ) {
    this.#link = link;
    this.#what = what;
    this.#onDispose = onDispose;
    this.id = id;
    this.settings = settings;
  }

  /** @internal The avatars that a step moves, in the order of its poses. */
  protected abstract members(): readonly Member[];

  /** @internal Takes over what came with an answer, but for the settings. */
  protected abstract receive(answer: Partial<Stepped> & Pick<State<Settings>, "shown">): void;

  /** Whether an answer is outstanding: surfaces and settings are not up to date yet. */
  get pending(): boolean {
    return this.#unansweredSteps > 0 || this.#unansweredChanges > 0;
  }

  /**
   * Resolves when the worker has answered all requests of this object: surfaces and
   * settings are then those of the last step and the last change. For tests, and for pages that draw single
   * frames; pages that draw continuously do not need it.
   *
   * @throws DynaSkinError what the worker refused since the last step, `disposed`, `worker`
   */
  whenAnswered(): Promise<void> {
    return new Promise((resolve, reject) => {
      this.assertSound();
      this.#idle.push({ resolve, reject });
      this.#settleIdle();
    });
  }

  /** Frees the object in the worker. May be called again; anything else throws `disposed` afterwards. */
  dispose(): void {
    if (this.#isDisposed) return;
    this.flush();
    this.#isDisposed = true;
    this.#ifOpen(() => this.#link.tell("dispose", { target: this.id }));
    for (const { reject } of this.#idle.splice(0)) reject(disposed(this.#what));
    this.#onDispose();
  }

  /** @internal */
  get disposed(): boolean {
    return this.#isDisposed;
  }

  /** @internal Whether both are of one worker. */
  isBeside(other: Remote<unknown, object>): boolean {
    return this.#link === other.#link;
  }

  /** @internal Throws `disposed`. */
  assertAlive(): void {
    if (this.#isDisposed) throw disposed(this.#what);
  }

  /** @internal Throws `disposed`, or why the worker is gone. */
  assertSound(): void {
    this.assertAlive();
    this.#link.assertOpen();
  }

  /** @internal What the worker refused since the last step. */
  takeFailure(): DynaSkinError | null {
    const failure = this.#failure;
    this.#failure = null;
    return failure;
  }

  /**
   * @internal Changes the object; the next step throws what the worker refuses.
   * @param expected - how the settings read meanwhile
   */
  protected change(doing: Doing<Target>, expected: Partial<Settings> = {}): void {
    const refused = (error: DynaSkinError) => {
      this.#failure ??= error;
    };
    this.#do(doing, () => {}, refused);
    this.settings = { ...this.settings, ...expected };
  }

  /** @internal Changes what nothing to be seen depends on, and what the worker will not refuse. */
  protected changeSilently(doing: Doing<Target>, expected: Partial<Settings>): void {
    this.assertAlive();
    this.#link.tell("do", { target: this.id, doing: doing as never });
    this.settings = { ...this.settings, ...expected };
  }

  /** @internal Asks for something; the caller waits for it. */
  protected ask<Value>(doing: Doing<Target>): Promise<Value> {
    return new Promise((resolve, reject) => {
      this.assertSound();
      this.#do(doing, (value) => resolve(value as Value), reject);
    });
  }

  #do(
    doing: Doing<Target>,
    onValue: (value: unknown) => void,
    onRefusal: (error: DynaSkinError) => void,
  ): void {
    this.assertAlive();
    const answer = this.#link.call("do", { target: this.id, doing: doing as never });
    this.#unansweredChanges += 1;
    answer
      .then(
        ({ value, state }) => {
          this.#unansweredChanges -= 1;
          this.receive(state);
          this.receiveSettings(state.settings as Partial<Settings>);
          onValue(value);
        },
        (error) => {
          this.#unansweredChanges -= 1;
          if (error instanceof Refusal) this.receiveSettings(error.settings as Settings);
          onRefusal(error);
        },
      )
      .finally(() => this.#settleIdle());
  }

  /** @internal While later changes are outstanding, what they ask for is shown. */
  receiveSettings(settings: Partial<Settings> | undefined): void {
    if (this.#unansweredChanges === 0) this.settings = { ...this.settings, ...settings };
  }

  /**
   * @internal Sends poses, one for each of {@link members}. While an earlier step is unanswered they
   * wait, newer ones take their place, and the times between add up.
   */
  protected give(poses: readonly Pose[], dtSeconds: number): void {
    const length = poses.length * POSE_LENGTH;
    if (this.#nextPoses.length !== length) this.#nextPoses = new Float64Array(length);
    for (const [idx, pose] of poses.entries()) this.#nextPoses.set(pose, idx * POSE_LENGTH);
    this.#nextDtSeconds = (this.#nextDtSeconds ?? 0) + dtSeconds;
    if (this.#unansweredSteps === 0) this.flush();
  }

  /** @internal Forgets poses that wait. */
  protected forgetPoses(): void {
    this.#nextDtSeconds = null;
  }

  /** @internal Sends poses that wait, before something that must come after them. */
  flush(): void {
    const dtSeconds = this.#nextDtSeconds;
    if (dtSeconds === null) return;
    this.#nextDtSeconds = null;
    this.#ifOpen(() => this.#sendStep(dtSeconds));
  }

  #sendStep(dtSeconds: number): void {
    const members = this.members();
    const fits = this.#spentPoses.length === this.#nextPoses.length;
    const poses = fits ? this.#spentPoses : new Float64Array(this.#nextPoses.length);
    this.#spentPoses = new Float64Array(0);
    poses.set(this.#nextPoses);
    const avatars = members.map(({ id }) => id);
    const surfaces = members.map((avatar) => avatar.takeSpare());
    const buffers = [...surfaces.flatMap(buffersOf), poses.buffer as ArrayBuffer];
    this.#unansweredSteps += 1;
    this.#link
      .call("step", { target: this.id, avatars, poses, dtSeconds, surfaces }, buffers)
      .then(
        (stepped) => {
          this.#spentPoses = stepped.poses as Float64Array<ArrayBuffer>;
          for (const [idx, avatar] of members.entries()) avatar.receiveStep(stepped, idx);
          this.receive(stepped);
        },
        (error) => {
          this.#failure ??= error;
        },
      )
      .finally(() => {
        this.#unansweredSteps -= 1;
        if (this.#unansweredSteps === 0) this.flush();
        this.#settleIdle();
      });
  }

  /** A worker that is gone needs no telling. */
  #ifOpen(work: () => void): void {
    try {
      this.#link.assertOpen();
    } catch {
      return;
    }
    work();
  }

  #settleIdle(): void {
    if (this.pending || this.#idle.length === 0) return;
    const failure = this.takeFailure();
    for (const { resolve, reject } of this.#idle.splice(0)) {
      if (failure) reject(failure);
      else resolve();
    }
  }
}
