#!/usr/bin/env bash
# three's WebGPURenderer keeps the shader of whole-number positions for a geometry of floats.
#
# Version: three 0.187.0 from npm, Node 20.
# Expected: an object whose geometry is replaced by one with other types of attributes is compiled anew. A
#   quantised glTF (KHR_mesh_quantization, as gltfpack writes it without normalisation) has Int16 positions; a
#   program that deforms it puts a geometry of Float32 positions in its place.
# What happens: the shader reads Int16 positions as ivec3 and Float32 positions as vec3, and the key by which
#   the renderer decides whether to compile anew holds an attribute's name, its size and whether it is
#   normalised, but not its type. Both geometries have the same key, so the pipeline of the first meets the
#   buffers of the second: WebGPU refuses it and the object is not drawn. The key of a normalised Int8
#   attribute is another one.
# Output seen:
#   Int16Array: key position,3, shader type ivec3
#   Float32Array: key position,3, shader type vec3
#   Int8Array normalised: key position,3,n, shader type vec3
#
# Installs a pinned package in a temporary folder, removed at the end; needs node and npm. Fails where any
# of this is otherwise.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --no-save --prefix "$folder" three@0.187.0 > /dev/null
cat > check.mjs <<'JS'
import { BufferAttribute, BufferGeometry, NodeBuilder } from "three/webgpu";
import RenderObject from "three/src/renderers/common/RenderObject.js";

const builder = Object.create(NodeBuilder.prototype);
for (const [array, normalised] of [
  [new Int16Array(9), false],
  [new Float32Array(9), false],
  [new Int8Array(9), true],
]) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(array, 3, normalised));
  // As the renderer calls them, without a graphics card.
  const key = RenderObject.prototype.getGeometryCacheKey.call({ geometry });
  const type = builder.getTypeFromAttribute(geometry.attributes.position);
  const kind = array.constructor.name + (normalised ? " normalised" : "");
  console.log(`${kind}: key ${key} shader type ${type}`);
}
JS
node check.mjs | tee seen.txt
diff seen.txt - <<'SEEN'
Int16Array: key position,3, shader type ivec3
Float32Array: key position,3, shader type vec3
Int8Array normalised: key position,3,n, shader type vec3
SEEN
