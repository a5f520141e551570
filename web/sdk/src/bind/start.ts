// The WebAssembly file that binds: downloaded with the first avatar that is bound.
import { checkVersion } from "../core.js";
import { DynaSkinError } from "../error.js";
import { Instance } from "../instance.js";
import * as glue from "../wasm/bind.js";
import { compile, type WasmSource } from "../wasm/instantiate.js";
import type { AvatarParts, BindWish } from "./parts.js";

const WHAT = "the part of dynaskin that binds avatars";

let starting: Promise<Instance> | null = null;

/** Starts the file once, and anew after a crash. */
async function start(wasm: WasmSource | undefined): Promise<Instance> {
  const running = await starting?.catch(() => null);
  if (running && !running.crash) return running;
  if (running?.crash) glue.__wbg_reset_state();
  starting = startNew(wasm);
  return starting;
}

async function startNew(wasm: WasmSource | undefined): Promise<Instance> {
  const module = await compile(wasm ?? new URL("../wasm/bind_bg.wasm", import.meta.url), {
    what: WHAT,
  });
  try {
    await glue.default({ module_or_path: module });
    checkVersion(glue.bindVersion());
    return new Instance();
  } catch (cause) {
    if (cause instanceof DynaSkinError) throw cause;
    throw new DynaSkinError(
      "wasm",
      `${WHAT} could not be started; is its .wasm file the one of this package's version?`,
      { cause },
    );
  }
}

/**
 * Binds in the thread it is called in, and gives the binding's bytes.
 *
 * @throws DynaSkinError `fetch`, `wasm`, and what binding refuses
 */
export async function bindHere(
  parts: AvatarParts,
  bodyGlb: Uint8Array,
  { depicts, bones }: BindWish,
  wasm: WasmSource | undefined,
  onProgress: (fraction: number) => void,
): Promise<Uint8Array> {
  const instance = await start(wasm);
  return instance.guard(() => {
    const avatar = new glue.AvatarParts();
    try {
      for (const { name, humanoid, parent, matrix } of parts.nodes) {
        avatar.addNode(name, humanoid, parent, matrix);
      }
      for (const mesh of parts.meshes) {
        avatar.addMesh(
          ...([mesh.name, mesh.material, mesh.positions, mesh.skinJoints] as const),
          ...([mesh.skinWeights, mesh.indices, mesh.joints, mesh.inverseBinds] as const),
        );
      }
    } catch (error) {
      avatar.free();
      throw error;
    }
    // It consumes the avatar.
    return avatar.bind(bodyGlb, depicts, bones, onProgress);
  });
}
