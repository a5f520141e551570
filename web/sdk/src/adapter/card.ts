// What decodes surfaces on the graphics card that an engine draws with.
import type { Undecoded } from "../decoding.js";

/**
 * A mesh's place among those that a card decodes.
 *
 * @internal
 */
export interface CardSeat {
  /** Whether the card has gone: what it wrote is lost, and nothing is written any more. */
  readonly isLost: boolean;
  /** Takes over what is to be seen. The card decodes it before the engine draws next. */
  take(undecoded: Undecoded): void;
  /** Is told that somebody else has written to the mesh's buffers. */
  overwrite(): void;
  /** Gives the place back. */
  free(): void;
}

/** An avatar that leaves decoding to whoever draws it. */
export interface MaybeUndecoded {
  readonly undecoded?: Undecoded | null;
}
