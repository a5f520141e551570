// The bodies that a graphics card decodes, in pools: all bodies of a pool that have changed are decoded at once.
import type { DecoderMatrix, Undecoded } from "../decoding.js";
import type { CardSeat } from "./card.js";
import { MAX_SLOTS, WIDTH } from "./decoding-shaders.js";

/** Numbers of the shaders' uniform block before its slots. */
const BATCH_HEAD = 4;

/** What decodes on one card. */
export interface PoolCard {
  /** Whether the card has gone. */
  readonly isLost: boolean;
  /** Is told that bodies of a pool have changed. */
  touch(pool: CardPool): void;
  /** Lets go of a decoder that has no bodies any more. */
  forget(matrix: DecoderMatrix): void;
}

/** The bodies of one decoder. */
export abstract class CardDecoder<Pool extends CardPool> {
  readonly matrix: DecoderMatrix;
  /** Rows of texels that one body has. */
  readonly bodyRows: number;
  readonly #pools: Pool[] = [];
  readonly #maxRows: number;

  /**
   * @param vertexTexels - of the table of vertices, in whole rows
   * @param maxRows - of a texture on this card
   */
  constructor(matrix: DecoderMatrix, vertexTexels: number, maxRows: number) {
    this.matrix = matrix;
    this.bodyRows = vertexTexels / WIDTH;
    this.#maxRows = maxRows;
  }

  /** A free place. Each pool is twice as large as the one before: few bodies take little memory, many few passes. */
  take(): [pool: Pool, slot: number] {
    for (const pool of this.#pools) {
      const slot = pool.seats.indexOf(null);
      if (slot >= 0) return [pool, slot];
    }
    const largest = Math.floor(this.#maxRows / this.bodyRows);
    const pool = this.makePool(Math.min(2 ** this.#pools.length, MAX_SLOTS, largest));
    this.#pools.push(pool);
    return [pool, 0];
  }

  /** Is told that a place is free: with the last body everything goes. */
  release(): void {
    if (this.#pools.some(({ seats }) => seats.some((seat) => seat))) return;
    for (const pool of this.#pools) pool.dispose();
    this.dispose();
  }

  protected abstract makePool(capacity: number): Pool;
  /** Gives back the tables. */
  protected abstract dispose(): void;
}

/** Room for some bodies of one decoder. */
export abstract class CardPool<Seat extends object = object> {
  /** By slot: who has it. */
  readonly seats: (Seat | null)[];
  /** Texels of a row of latents, of which each body has one. */
  readonly latentWidth: number;
  /** Slots whose surface has changed. */
  protected readonly changed = new Set<number>();
  /** By slot: constants that are not uploaded yet. */
  protected readonly constants = new Map<number, Undecoded>();
  /** The shaders' uniform block. */
  protected readonly batch = new Uint32Array(BATCH_HEAD + MAX_SLOTS);
  readonly #latents: Float32Array<ArrayBuffer>;
  readonly #card: PoolCard;
  readonly #decoder: { release(): void };

  constructor(card: PoolCard, decoder: CardDecoder<CardPool<Seat>>, capacity: number) {
    const { bodyRows, matrix } = decoder;
    this.#card = card;
    this.#decoder = decoder;
    this.seats = Array.from({ length: capacity }, () => null);
    this.latentWidth = Math.max(1, Math.ceil(matrix.latentCount / 4));
    this.#latents = new Float32Array(4 * this.latentWidth * capacity);
    const vertexCount = bodyRows * WIDTH;
    this.batch.set([vertexCount, bodyRows, vertexCount, capacity * bodyRows]);
  }

  /** Takes over what a body is decoded from. */
  set(slot: number, undecoded: Undecoded, withConstants: boolean): void {
    if (withConstants) this.constants.set(slot, undecoded);
    this.#latents.set(undecoded.latents(), 4 * this.latentWidth * slot);
    this.changed.add(slot);
    this.#card.touch(this);
  }

  /** Gives a place back. */
  free(slot: number): void {
    this.seats[slot] = null;
    this.changed.delete(slot);
    this.constants.delete(slot);
    this.#decoder.release();
  }

  /** Writes the changed slots into the batch; gives the rows of latents from the first of them to the last. */
  protected beginBatch(): { first: number; count: number; numbers: Float32Array<ArrayBuffer> } {
    const slots = [...this.changed];
    this.batch.set(slots, BATCH_HEAD);
    const [first, end] = [Math.min(...slots), Math.max(...slots) + 1];
    const row = 4 * this.latentWidth;
    const numbers = this.#latents.subarray(first * row, end * row);
    return { first, count: end - first, numbers };
  }

  abstract dispose(): void;
}

/** A body's place in a pool. */
export abstract class PoolSeat implements CardSeat {
  readonly #card: PoolCard;
  readonly #pool: CardPool;
  readonly #slot: number;
  #constantsRevision: string | null = null;
  #surfaceRevision: number | null = null;
  /** Whether any frame has drawn the mesh. */
  #isShown: boolean;
  /** Whether a frame has drawn what the mesh's buffers hold. */
  #isDrawn: boolean;
  /** Whether the previous positions may be others than those. */
  #isMoving = true;

  /** @param isShown - whether a frame has drawn the mesh, as somebody else has written it */
  constructor(card: PoolCard, pool: CardPool, slot: number, isShown: boolean) {
    this.#isShown = isShown;
    this.#isDrawn = isShown;
    this.#card = card;
    this.#pool = pool;
    this.#slot = slot;
    pool.seats[slot] = this;
  }

  get isLost(): boolean {
    return this.#card.isLost;
  }

  take(undecoded: Undecoded): void {
    const { surfaceRevision, constantsRevision } = undecoded;
    const isConstant = constantsRevision === this.#constantsRevision;
    if (isConstant && surfaceRevision === this.#surfaceRevision) return;
    this.#pool.set(this.#slot, undecoded, !isConstant);
    this.#constantsRevision = constantsRevision;
    this.#surfaceRevision = surfaceRevision;
  }

  overwrite(): void {
    this.#surfaceRevision = null;
    this.#settle();
  }

  beginFrame(): void {
    // Before the first frame nothing was anywhere else.
    if (!this.#isShown) this.#isDrawn = true;
    this.#isShown = true;
    this.#settle();
    this.#isDrawn = true;
  }

  /** Is told that the mesh's buffer of previous positions is another one. */
  protected forgetPrevious(): void {
    this.#isMoving = true;
  }

  /** Before the buffers are written: whether previous positions are to be copied from them. */
  protected leaveDrawn(): boolean {
    const isDrawn = this.#isDrawn;
    this.#isDrawn = false;
    this.#isMoving = true;
    return isDrawn;
  }

  #settle(): void {
    if (!this.#isDrawn || !this.#isMoving || this.isLost) return;
    this.#isMoving = false;
    this.copyToPrevious();
  }

  /** Copies positions to the previous ones, where the mesh has these. */
  protected abstract copyToPrevious(): void;

  free(): void {
    this.#pool.free(this.#slot);
    if (!this.isLost) this.dispose();
  }

  /** Gives back what it has on the card. */
  protected abstract dispose(): void;
}
