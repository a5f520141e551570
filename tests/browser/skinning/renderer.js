import { createRenderer } from "dynaskin/renderer";
import { compareSkinnings, EYE_M, FOV_Y_RADIANS, SIZE, TARGET_M } from "./stage.js";

/** See `compareSkinnings`; the plain surface has skin matrices of the identity. */
export function compareInRenderer(backend) {
  return compareSkinnings(async (avatar, model) => {
    const canvas = document.createElement("canvas");
    document.body.append(canvas);
    const renderer = await createRenderer(canvas, { backend });
    renderer.resize(SIZE, SIZE);
    renderer.setCamera({ eyeWorldM: EYE_M, targetWorldM: TARGET_M, fovYRadians: FOV_Y_RADIANS });
    const body = renderer.addBody(model.body);
    const { offsets } = avatar;
    const still = new Float32Array(offsets.length);
    const skinMatrices = new Float32Array(24 * 16);
    for (let at = 0; at < skinMatrices.length; at += 16) {
      for (const idx of [0, 5, 10, 15]) skinMatrices[at + idx] = 1;
    }
    const picture = async () => {
      await new Promise(requestAnimationFrame);
      renderer.render();
      return canvas.toDataURL();
    };
    return {
      skin: (pose) => {
        avatar.step(pose, 1 / 60);
        body.update(avatar);
      },
      draw: picture,
      drawPlain: (positions, normals) => {
        body.update({ positions, normals, offsets: still, skinMatrices });
        return picture();
      },
      ...(backend === "webgpu" && { read: () => body.readSkinnedPositions() }),
    };
  });
}
