// A geometry with positions and normals of its own, which shares everything else with another.
import { type BufferAttribute, BufferGeometry, StreamDrawUsage } from "three";

/**
 * Of attributes that are written often. Not `DynamicDrawUsage`: WebGPURenderer uploads such attributes whole each time
 * that it renders, whether they have changed or not.
 */
export const USAGE = StreamDrawUsage;

/** Name under which positions are repeated where shaders must not be those of the source. */
const MARK = "dynaskin";

/**
 * The geometry with some attributes of its own. Index and other attributes are shared with `source`; morph
 * targets and bounds are left out.
 */
export function withAttributes(
  source: BufferGeometry,
  attributes: ReadonlyMap<string, BufferAttribute>,
): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.name = source.name;
  geometry.userData = source.userData;
  geometry.setIndex(source.index);
  for (const [name, attribute] of Object.entries(source.attributes)) {
    geometry.setAttribute(name, attribute);
  }
  for (const [name, attribute] of attributes) {
    geometry.setAttribute(name, attribute);
    // WebGPURenderer keeps one shader for geometries whose attributes have the same names and sizes, and
    // a shader for whole numbers draws no others.
    if (isWhole(source.attributes[name])) geometry.setAttribute(MARK, attribute);
  }
  for (const { start, count, materialIndex } of source.groups) {
    geometry.addGroup(start, count, materialIndex);
  }
  geometry.setDrawRange(source.drawRange.start, source.drawRange.count);
  return geometry;
}

function isWhole(attribute: BufferGeometry["attributes"][string] | undefined): boolean {
  return attribute !== undefined && !(attribute.array instanceof Float32Array);
}
