import { showWorker } from "./show-worker.js";

// esbuild copies no files beside a script, so the application names both.
showWorker({
  wasm: "/node_modules/dynaskin/dist/wasm/core_bg.wasm",
  createWorker: () => new Worker("/dist-esbuild/thread.js", { type: "module" }),
});
