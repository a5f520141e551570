// A strict TypeScript application with dynaskin's own renderer.
import { type Avatar, DynaSkinError, type Model } from "dynaskin";
import { type BodyHandle, createRenderer, heatRamp, type Renderer } from "dynaskin/renderer";

export async function start(model: Model, avatar: Avatar): Promise<Renderer> {
  const canvas = document.createElement("canvas");
  const renderer = await createRenderer(canvas, { backend: "auto", adaptiveResolution: true });
  const body: BodyHandle = renderer.addBody(model.body);
  renderer.setCamera({ eyeWorldM: [1.4, 1.2, 3.4], targetWorldM: [0, 0.9, 0], fovYRadians: 0.6 });
  renderer.setHeatMap(heatRamp().length);
  body.update(avatar);
  const drawn: boolean = renderer.render();
  const reason: string | null = await renderer.lost;
  if (!drawn && reason !== null) await renderer.recover();
  return renderer;
}

export const hasNoGraphics = (error: unknown): boolean =>
  error instanceof DynaSkinError && error.code === "no-adapter";
