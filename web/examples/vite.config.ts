import { defineConfig } from "vite";

export default defineConfig({
  // Relative, so that the built pages work from any folder of any web server.
  base: "./",
  // The models as they lie in the repository: female/bundle.json, male/bundle.json, ...
  publicDir: "../../models",
  server: { port: 5181 },
  build: {
    target: "es2022",
    chunkSizeWarningLimit: 4000,
    rolldownOptions: {
      input: ["", "three/", "babylon/", "renderer/", "webgl2/", "react/"].map(
        (folder) => `${folder}index.html`,
      ),
    },
  },
});
