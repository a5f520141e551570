#!/usr/bin/env bash
# three's WebGPURenderer uploads attributes with DynamicDrawUsage whole each time that it renders.
#
# Version: three 0.187.0 from npm, Node 20.
# Expected: three's usages are hints for the graphics card's memory (DYNAMIC_DRAW and so on), and an attribute is
#   uploaded again when needsUpdate says so, where it has update ranges only these. WebGLRenderer does that.
# What happens: the part of WebGPURenderer that keeps attributes uploads one with DynamicDrawUsage in every call, with
#   needsUpdate or without. A range lasts for one upload, so that the next call, in which nothing has changed, uploads
#   all of the attribute. For who deforms a few vertices of a mesh, the usage that seems right costs most.
#   StreamDrawUsage, as WebGL's hint as good, is uploaded when it has changed and no more.
# Output seen:
#   StaticDrawUsage: 10 vertices changed: 30 numbers; then nothing: 0, 0 numbers
#   DynamicDrawUsage: 10 vertices changed: 30 numbers; then nothing: 3000, 3000 numbers
#   StreamDrawUsage: 10 vertices changed: 30 numbers; then nothing: 0, 0 numbers
#
# Installs a pinned package in a temporary folder, removed at the end; needs node and npm. Fails where any
# of this is otherwise.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --no-save --prefix "$folder" three@0.187.0 > /dev/null
cat > check.mjs <<'JS'
import * as THREE from "three";
import Attributes from "three/src/renderers/common/Attributes.js";
import { AttributeType } from "three/src/renderers/common/Constants.js";

for (const usage of ["StaticDrawUsage", "DynamicDrawUsage", "StreamDrawUsage"]) {
  let numbers = 0;
  // In place of the graphics card: counts as WebGPU's does what would be uploaded.
  const backend = {
    createAttribute() {},
    updateAttribute({ updateRanges, array, clearUpdateRanges }) {
      numbers += updateRanges.length
        ? updateRanges.reduce((sum, { count }) => sum + count, 0)
        : array.length;
      clearUpdateRanges.call(arguments[0]);
    },
  };
  const attributes = new Attributes(backend, { createAttribute() {} });
  const attribute = new THREE.BufferAttribute(new Float32Array(3000), 3).setUsage(THREE[usage]);
  const render = () => {
    numbers = 0;
    attributes.update(attribute, AttributeType.VERTEX);
    return numbers;
  };
  render();
  attribute.addUpdateRange(0, 30);
  attribute.needsUpdate = true;
  console.log(`${usage}: 10 vertices changed: ${render()} numbers; then nothing: ${render()}, ${render()} numbers`);
}
JS
node check.mjs | tee seen.txt
diff seen.txt - <<'SEEN'
StaticDrawUsage: 10 vertices changed: 30 numbers; then nothing: 0, 0 numbers
DynamicDrawUsage: 10 vertices changed: 30 numbers; then nothing: 3000, 3000 numbers
StreamDrawUsage: 10 vertices changed: 30 numbers; then nothing: 0, 0 numbers
SEEN
