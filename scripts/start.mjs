// npm start: builds what is missing and serves the demo on localhost.
import { spawn } from "node:child_process";
import { buildForDemo, viteProgram } from "./build.mjs";
import { DEMO } from "./lib/paths.mjs";
import { bold, main, say } from "./lib/run.mjs";

main(async () => {
  say(
    bold("dynaskin: building the demo. The first time takes some minutes; later starts, seconds."),
  );
  await buildForDemo();
  say(`\n${bold("▸ Demo page")} (Ctrl+C stops it)`);
  const server = spawn(process.execPath, [viteProgram(), ...process.argv.slice(2)], {
    cwd: DEMO,
    stdio: "inherit",
  });
  for (const signal of ["SIGINT", "SIGTERM"]) process.on(signal, () => server.kill(signal));
  server.on("close", (code) => {
    process.exitCode = code ?? 0;
  });
});
