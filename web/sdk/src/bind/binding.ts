import { kindOf } from "../check.js";
import { DynaSkinError } from "../error.js";
import { Model } from "../model.js";
import type { JointName } from "../pose.js";
import type { CoreBinding } from "../wasm/core.js";

/** Bytes over which a binding is refused before it is read: large ones have 200 kB. */
const MAX_BINDING_BYTES = 32 * 2 ** 20;

/** What binding found of an avatar. */
export interface BindingReport {
  /** The body's joints and the avatar's bone that turns each; two with a plus between them. */
  bones: { joint: JointName; bone: string }[];
  /** The body's joints that no bone turns; they follow their parents. */
  missing: JointName[];
  /** What is measured of the avatar where it rests. */
  proportions: {
    /** From the crown to the height of the shoulder joints, over the stature. */
    crownToShoulder: number;
    /** Height of the hip joints above the soles, over the stature. */
    hipHeight: number;
    /** Stature in metres; null where the file has a unit of its own. */
    statureM: number | null;
  };
  /** Share of the skin within 2 cm of the fitted body, 0 to 1; head, hands and feet left out. */
  shareClose: number;
  /** The same before the body is drawn smoothly to loose clothes. */
  shareCloseBare: number;
  /** Median distance from the body before that, metres. */
  medianM: number;
  /** Vertices of all skinned meshes. */
  vertices: number;
  /** How many of them move. */
  moving: number;
  /** Each mesh, in the order in which they were bound. */
  meshes: { name: string; material: string; vertices: number; moving: number }[];
  /** Regions that stay still, and why. */
  regionsOff: { region: string; reason: string }[];
  /** Bones that move breasts or buttocks by themselves: `springBones` of `TissueOptions` says what becomes of them. */
  doubleMotion: string[];
  /** What was found other than usual: a sentence each. */
  notes: string[];
}

/**
 * How a body's tissue moves one avatar: found once by `bindAvatar`, stored as some 20 to 200 kB, played by
 * any number of `AvatarTissue`. Holds no memory of WebAssembly, so there is nothing to dispose of.
 */
export class Binding {
  /** What was found. */
  readonly report: BindingReport;
  readonly #bytes: Uint8Array;

  private constructor(bytes: Uint8Array, report: BindingReport) {
    this.#bytes = bytes;
    this.report = report;
  }

  /**
   * Reads a binding that {@link toBytes} or `dynaskin bind` wrote.
   *
   * @param bytes - the binding
   * @param model - a model of the body that it was bound to
   * @throws DynaSkinError `binding` for bytes that were changed, cut, or written by another version, and
   *   for another body; `argument` for what are no bytes or no model
   */
  static fromBytes(bytes: Uint8Array | ArrayBuffer, model: Model): Binding {
    checkModel(model);
    if (!(bytes instanceof Uint8Array || bytes instanceof ArrayBuffer)) {
      const found = kindOf(bytes);
      throw new DynaSkinError("argument", `A binding is read from its bytes, got ${found}.`);
    }
    if (bytes.byteLength > MAX_BINDING_BYTES) {
      throw new DynaSkinError(
        "binding",
        `This is no binding: it has ${Math.ceil(bytes.byteLength / 2 ** 20)} MiB, and bindings have less than one.`,
      );
    }
    const own = new Uint8Array(bytes).slice();
    const { core } = model;
    return core.guard(() => {
      const raw = new core.glue.CoreBinding(own, model.body.raw);
      const report = raw.report() as BindingReport;
      raw.free();
      return new Binding(own, report);
    });
  }

  /** The binding as bytes, to be stored. A copy. */
  toBytes(): Uint8Array {
    return this.#bytes.slice();
  }

  /** @internal */
  open(model: Model): CoreBinding {
    const { core } = model;
    return core.guard(() => new core.glue.CoreBinding(this.#bytes, model.body.raw));
  }
}

/** Refuses what is no model. */
export function checkModel(model: unknown): asserts model is Model {
  if (model instanceof Model) return;
  throw new DynaSkinError("argument", "Binding needs a model, as load() gives it.");
}
