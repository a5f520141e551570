// Shadows of materials whose plugins move vertices: Babylon's usual shader of shadows knows nothing of plugins.

import type { Material } from "@babylonjs/core/Materials/material.js";
import { ShadowDepthWrapper } from "@babylonjs/core/Materials/shadowDepthWrapper.js";

interface Shadows {
  readonly wrapper: ShadowDepthWrapper;
  users: number;
}

/** Of the materials that have a wrapper of ours. */
const known = new WeakMap<Material, Shadows>();

/**
 * Has a material cast shadows as it draws, until all who asked for it have called what they are given. Gives null where
 * the page's own wrapper does so already.
 */
export function castAsDrawn(material: Material): (() => void) | null {
  const shadows = known.get(material) ?? wrap(material);
  if (!shadows) return null;
  shadows.users += 1;
  return () => {
    shadows.users -= 1;
    if (shadows.users > 0) return;
    const { wrapper } = shadows;
    known.delete(material);
    if (material.shadowDepthWrapper === wrapper) material.shadowDepthWrapper = null;
    wrapper.dispose();
  };
}

function wrap(material: Material): Shadows | null {
  if (material.shadowDepthWrapper) return null;
  const wrapper = new ShadowDepthWrapper(material, material.getScene());
  material.shadowDepthWrapper = wrapper;
  const shadows = { wrapper, users: 0 };
  known.set(material, shadows);
  return shadows;
}
