// The page's end of a worker: calls and their answers, and when to give it up.
import { DynaSkinError } from "../error.js";
import type { StartWatch } from "./diagnosis.js";
import type { Calls, Message, Request } from "./protocol.js";
import { brokenWorker, silentWorker } from "./refusals.js";

/** Silence is looked for so many times within the time that it may last. */
const LOOKS = 4;

/** Longer timers fire at once. */
const LONGEST_TIMER_MS = 2 ** 31 - 1;

/** Why the worker refused a call, and how the object is set that it was for. */
export class Refusal extends DynaSkinError {
  /** How the object is set. */
  readonly settings: object | undefined;

  constructor({ code, message, settings }: Message & { type: "refusal" }) {
    super(code, message);
    this.settings = settings;
  }
}

/** What a worker says of itself while it works. */
export type News = Extract<Message, { type: "progress" | "read" }>;

/** Who waits for an answer. */
interface Waiting {
  resolve: (back: never) => void;
  reject: (error: unknown) => void;
}

/** A worker that answers calls, until it is closed, stops, or stays silent. */
export class Link {
  readonly #worker: Worker;
  readonly #timeoutMs: number;
  readonly #waiting = new Map<number, Waiting>();
  #lastId = 0;
  #timer: ReturnType<typeof setInterval> | null = null;
  #silentLooks = 0;
  /** Until the worker says something. */
  #watching: StartWatch | null;
  /** Why it is closed; a reason may be anything, also null. */
  #closed: { reason: unknown } | null = null;

  /** `onNews` is told how far the worker is; what it throws closes the link. */
  constructor(
    worker: Worker,
    timeoutMs: number,
    onNews: (news: News) => void,
    watch: StartWatch | null = null,
  ) {
    this.#worker = worker;
    this.#timeoutMs = timeoutMs;
    this.#watching = watch;
    worker.onerror = (event) => this.#fail(event);
    worker.onmessageerror = (event) => this.close(brokenWorker(event));
    worker.onmessage = ({ data }: MessageEvent<Message>) => {
      this.#silentLooks = 0;
      this.#endWatch();
      if (data.type === "progress" || data.type === "read") this.#report(onNews, data);
      else if (data.type !== "alive") this.#receive(data);
    };
  }

  /** Throws why the worker is gone, if it is. */
  assertOpen(): void {
    if (this.#closed) throw this.#closed.reason;
  }

  /** A number for an object of the worker, or for a call. */
  nextId(): number {
    this.#lastId += 1;
    return this.#lastId;
  }

  /**
   * Asks the worker. Throws at once where the worker is gone, or what is sent cannot be; rejects with
   * what the worker refused, or why it went.
   */
  call<Name extends keyof Calls>(
    call: Name,
    sent: Calls[Name]["sent"],
    transfer: Transferable[] = [],
  ): Promise<Calls[Name]["back"]> {
    const id = this.nextId();
    this.#post({ id, call, sent } as Request, transfer);
    this.#watch();
    return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
  }

  /** As {@link call}, where no answer is needed. */
  tell<Name extends keyof Calls>(call: Name, sent: Calls[Name]["sent"]): void {
    this.#post({ call, sent } as Request, []);
  }

  /** Ends the worker; who waits, and who asks from now on, gets `reason`. */
  close(reason: unknown): void {
    this.#closed ??= { reason };
    this.#endWatch();
    if (this.#timer !== null) clearInterval(this.#timer);
    this.#timer = null;
    this.#worker.terminate();
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const { reject } of waiting) reject(reason);
  }

  /** An error without a word, before the worker has said anything, is one of its start. */
  #fail(event: ErrorEvent): void {
    const watch = event.message ? null : this.#watching;
    const broken = () => this.close(brokenWorker(event));
    if (watch) watch.explain().then((reason) => this.close(reason), broken);
    else broken();
  }

  #endWatch(): void {
    this.#watching?.stop();
    this.#watching = null;
  }

  #post(request: Request, transfer: Transferable[]): void {
    this.assertOpen();
    try {
      this.#worker.postMessage(request, transfer);
    } catch (cause) {
      const message = "What was given cannot be sent to a worker.";
      throw new DynaSkinError("argument", message, { cause });
    }
  }

  #receive(message: Extract<Message, { id: number }>): void {
    const waiting = this.#waiting.get(message.id);
    this.#waiting.delete(message.id);
    if (message.type === "refusal") waiting?.reject(new Refusal(message));
    else waiting?.resolve(message.back as never);
  }

  #report(onNews: (news: News) => void, news: News): void {
    try {
      onNews(news);
    } catch (error) {
      this.close(error);
    }
  }

  /**
   * Gives the worker up when it has been silent for long. Counted in looks, not by the clock: while
   * the page itself stands still (a breakpoint, a closed lid) answers lie unread, and nobody is late.
   */
  #watch(): void {
    if (this.#timer !== null || this.#timeoutMs === Number.POSITIVE_INFINITY) return;
    this.#silentLooks = 0;
    this.#timer = setInterval(
      () => {
        this.#silentLooks += 1;
        if (this.#waiting.size === 0) {
          clearInterval(this.#timer ?? undefined);
          this.#timer = null;
        } else if (this.#silentLooks > LOOKS) {
          this.close(silentWorker(this.#timeoutMs));
        }
      },
      Math.min(this.#timeoutMs / LOOKS, LONGEST_TIMER_MS),
    );
  }
}
