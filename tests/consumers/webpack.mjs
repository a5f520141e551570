// Builds src/main.js and src/worker.js with webpack as it is, without any loader.
import webpack from "webpack";

const folder = import.meta.dirname;
webpack(
  {
    mode: "production",
    performance: false,
    context: folder,
    entry: { main: "./src/main.js", worker: "./src/worker.js", thread: "./src/thread.js" },
    output: { path: `${folder}/dist-webpack`, publicPath: "/dist-webpack/" },
  },
  (error, stats) => {
    if (!error && !stats.hasErrors()) return;
    process.stderr.write(`${error ?? stats.toString("errors-only")}\n`);
    process.exitCode = 1;
  },
);
