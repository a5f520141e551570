import { defineConfig } from "@playwright/test";
import { DEMO_URL, EXAMPLES_URL, REPOSITORY_URL, ROOT } from "./places.js";

/** Chromium's own traffic is off; the rest is what a machine without a graphics card needs. */
const QUIET = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--enable-unsafe-swiftshader",
  "--autoplay-policy=no-user-gesture-required",
];

/** WebGPU in software. A canvas presents only in a window, so not headless: see scripts/test.mjs. */
const WEBGPU = [
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
];

const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";

/** Serves what Vite has built. */
function vitePreview(folder: string, url: string) {
  return {
    command: `node ${ROOT}/node_modules/vite/bin/vite.js preview --port ${new URL(url).port} --strictPort`,
    cwd: `${ROOT}/${folder}`,
    url,
    reuseExistingServer: false,
  };
}

export default defineConfig({
  testDir: ".",
  // Two lanes: while one page draws in software, the other waits for a timer or a file.
  workers: 2,
  timeout: 300_000,
  expect: { timeout: 30_000 },
  forbidOnly: Boolean(process.env.CI),
  reporter: process.env.PLAYWRIGHT_JSON_OUTPUT_FILE ? [["list"], ["json"]] : "list",
  outputDir: `${ROOT}/test-results/browser`,
  use: { viewport: { width: 1000, height: 640 }, baseURL: DEMO_URL },
  projects: [
    {
      name: "webgl2",
      testIgnore: /webgpu/,
      use: { launchOptions: { executablePath, args: [...QUIET, "--disable-gpu"] } },
    },
    {
      name: "webgpu",
      testMatch: /webgpu/,
      use: {
        headless: !process.env.DISPLAY,
        launchOptions: { executablePath, args: [...QUIET, ...WEBGPU] },
      },
    },
  ],
  webServer: [
    vitePreview("web/demo", DEMO_URL),
    vitePreview("web/examples", EXAMPLES_URL),
    {
      command: `node ${ROOT}/scripts/lib/serve.mjs ${new URL(REPOSITORY_URL).port}`,
      url: `${REPOSITORY_URL}/blank`,
      reuseExistingServer: false,
    },
  ],
});
