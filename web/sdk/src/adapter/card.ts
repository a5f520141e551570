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
  /** Is told that somebody else writes to the mesh's buffers. */
  overwrite(): void;
  /**
   * Is told that another frame is drawn, once what has changed for it is decoded. Where the mesh has a buffer of
   * previous positions, it then holds those of the frame before.
   */
  beginFrame(): void;
  /** Gives the place back. */
  free(): void;
}

/** An avatar that leaves decoding to whoever draws it. */
export interface MaybeUndecoded {
  readonly undecoded?: Undecoded | null;
}
