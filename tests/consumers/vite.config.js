// For Vite 8, as it is but for the folders.
export default {
  base: "/dist-vite/",
  build: {
    outDir: "dist-vite",
    rolldownOptions: {
      input: ["index.html", "worker.html", "readme.html", "renderer.html", "src/thread.js"],
      output: {
        entryFileNames: ({ name }) => (name === "thread" ? "[name].js" : "assets/[name]-[hash].js"),
      },
    },
  },
};
