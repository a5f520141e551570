// Vite 7's development server needs the one line that docs/troubleshooting.md names.
const pages = ["index.html", "worker.html", "readme.html", "renderer.html"].map(
  (page) => `${import.meta.dirname}/${page}`,
);

export default {
  base: "/dist-vite7/",
  cacheDir: "node_modules/.vite7",
  optimizeDeps: { exclude: ["dynaskin"] },
  build: { outDir: "dist-vite7", rollupOptions: { input: pages } },
};
