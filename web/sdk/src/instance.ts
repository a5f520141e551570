import { crashedBy, type DynaSkinError, isTrap, toDynaSkinError } from "./error.js";

/**
 * A running WebAssembly file. After a trap its memory may be anything, and wasm-bindgen's locks stay
 * locked: nothing made from it is touched again, and all of it says so.
 *
 * @internal
 */
export class Instance {
  #trap: unknown = null;

  /** Why nothing of it can be used; null while all is well. */
  get crash(): DynaSkinError | null {
    return this.#trap === null ? null : crashedBy(this.#trap);
  }

  /** Throws `crashed` after a trap. */
  assertSound(): void {
    if (this.#trap !== null) throw crashedBy(this.#trap);
  }

  /** Runs a call into WebAssembly and gives its errors our type. */
  guard<T>(call: () => T): T {
    this.assertSound();
    try {
      return call();
    } catch (error) {
      if (!isTrap(error)) throw toDynaSkinError(error);
      this.#trap = error;
      throw crashedBy(error);
    }
  }

  /** As {@link guard} for a call that is answered later. */
  async guardLater<T>(call: () => Promise<T>): Promise<T> {
    this.assertSound();
    try {
      return await call();
    } catch (error) {
      if (!isTrap(error)) throw toDynaSkinError(error);
      this.#trap = error;
      throw crashedBy(error);
    }
  }

  /** Frees what the file holds for us; after a trap nothing is left to free. */
  free(raw: { free(): void } | null): void {
    if (raw && this.#trap === null) this.guard(() => raw.free());
  }
}
