import { batch, effect, type Signal, signal, untracked } from "@preact/signals-core";

/**
 * Values by name that are written in one place, {@link Store.change}, and followed everywhere: whoever
 * reads {@link Store.state} within {@link Store.show} or {@link Store.on} runs again when that changes.
 * Lists and records are replaced, never changed.
 */
export class Store<State extends object> {
  /** The values as they are now. */
  readonly state: Readonly<State>;
  readonly #signals = new Map<keyof State, Signal<unknown>>();
  #revision = 0;

  constructor(initial: State) {
    const state = {};
    for (const [name, value] of Object.entries(initial)) {
      const held = signal<unknown>(value);
      this.#signals.set(name as keyof State, held);
      Object.defineProperty(state, name, { enumerable: true, get: () => held.value });
    }
    this.state = state as Readonly<State>;
  }

  /** Another number after every change. */
  get revision(): number {
    return this.#revision;
  }

  /** Changes some values together: what follows from them follows once, before this returns. */
  change(values: Partial<State>): void {
    batch(() => {
      for (const [name, value] of Object.entries(values)) {
        const held = this.#signals.get(name as keyof State);
        if (!held || held.peek() === value) continue;
        held.value = value;
        this.#revision += 1;
      }
    });
  }

  /** Shows something, now and whenever what `work` read of the state has changed. */
  show(work: () => void): void {
    effect(work);
  }

  /** Calls `work` whenever one of the values that `read` gives is another than before; not at first. */
  on(read: () => readonly unknown[], work: () => void): void {
    let before: readonly unknown[] | null = null;
    effect(() => {
      const now = read();
      const isOther = before?.some((value, idx) => value !== now[idx]) ?? false;
      before = now;
      if (isOther) untracked(work);
    });
  }
}
