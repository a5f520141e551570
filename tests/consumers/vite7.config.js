// Vite 7's development server needs the one line that docs/troubleshooting.md names.
const input = ["index.html", "worker.html", "readme.html", "renderer.html", "src/thread.js"].map(
  (file) => `${import.meta.dirname}/${file}`,
);

export default {
  base: "/dist-vite7/",
  cacheDir: "node_modules/.vite7",
  optimizeDeps: { exclude: ["dynaskin", "dynaskin-female", "dynaskin-male"] },
  build: {
    outDir: "dist-vite7",
    rollupOptions: {
      input,
      output: {
        entryFileNames: ({ name }) => (name === "thread" ? "[name].js" : "assets/[name]-[hash].js"),
      },
    },
  },
};
