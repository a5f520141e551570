import { type Avatar, type Body, type Bundle, load, type Model, type Shape } from "dynaskin";
import { type ActorKind, isMethod, type Sex } from "./actors.js";

/** One body with the networks that have been loaded for it so far: makes its actors. */
export class Cast {
  readonly #methods = new Map<ActorKind, Model>();
  #model: Model | null = null;

  constructor(
    readonly sex: Sex,
    readonly body: Body,
    /** Whether its core runs the networks of other methods and reads motion files. */
    readonly isWhole: boolean,
  ) {}

  /** The model of dynaskin's own, once it is there. */
  get model(): Model | null {
    return this.#model;
  }

  /** Takes over the model that this cast's body belongs to. */
  setModel(model: Model): void {
    this.#model = model;
  }

  /** Downloads a method's networks, unless they are there or it needs none. */
  async prepare(
    kind: ActorKind,
    options: {
      signal: AbortSignal;
      onProgress: (loadedBytes: number, totalBytes: number) => void;
    },
  ): Promise<void> {
    if (!isMethod(kind) || this.#methods.has(kind)) return;
    const model = await load({
      model: new URL(`${this.sex}/methods/${kind}/`, document.baseURI),
      body: this.body,
      signal: options.signal,
      onProgress: ({ loadedBytes, totalBytes }) => options.onProgress(loadedBytes, totalBytes),
    });
    this.#methods.set(kind, model);
  }

  /** What an actor's networks learned from; null for actors without networks, or not yet there. */
  bundleOf(kind: ActorKind): Bundle | null {
    return this.#modelOf(kind)?.bundle ?? null;
  }

  /** An actor's avatar. Until its networks are there, and where it needs none: plain skinning. */
  createAvatar(kind: ActorKind, shape: Shape): Avatar {
    return (this.#modelOf(kind) ?? this.body).createAvatar({ shape });
  }

  #modelOf(kind: ActorKind): Model | null {
    return kind === "dynaskin" ? this.#model : (this.#methods.get(kind) ?? null);
  }

  /** Frees body and networks; avatars made from them live on. */
  dispose(): void {
    for (const model of this.#methods.values()) model.dispose();
    this.#methods.clear();
    this.#model?.dispose();
    this.body.dispose();
  }
}
