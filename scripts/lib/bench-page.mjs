// A page of Chromium in which a bench runs.

/** A WebGPU canvas presents only in a window. */
const WEBGPU = [
  ...["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan"],
  ...["--use-vulkan=swiftshader", "--use-angle=swiftshader"],
];

const QUIET = ["--no-sandbox", "--disable-quic", "--no-first-run", "--enable-unsafe-swiftshader"];

/**
 * A browser for `backend`, which draws in software.
 *
 * @param {"webgl2" | "webgpu"} backend
 * @param {string} executablePath
 */
export async function launchFor(backend, executablePath) {
  const { chromium } = await import("@playwright/test");
  const own =
    backend === "webgpu" ? { headless: false, args: WEBGPU } : { args: ["--disable-gpu"] };
  return chromium.launch({ executablePath, ...own, args: [...QUIET, ...own.args] });
}
