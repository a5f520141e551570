// npm start: builds what is missing and serves the demo on localhost, as it ships: the built page, which is
// built again, and loaded again, whenever its sources change.
import { buildForDemo } from "./build.mjs";
import { DEMO } from "./lib/paths.mjs";
import { bold, main, say } from "./lib/run.mjs";

/** Where open pages wait to be told of the next build. */
const BUILDS = "/__builds";
/** What a page that is served here has beside what ships. */
const RELOAD = `<script>new EventSource("${BUILDS}").onmessage = () => location.reload();</script>`;

/** Pages that are open, and the built page with what reloads it. */
function reloading(readPage) {
  const open = new Set();
  const plugin = {
    name: "reload-after-builds",
    configurePreviewServer(server) {
      server.middlewares.use((request, response, next) => {
        const { pathname } = new URL(request.url ?? "/", "http://localhost");
        if (pathname === BUILDS) {
          response.writeHead(200, { "Content-Type": "text/event-stream" });
          open.add(response);
          request.on("close", () => open.delete(response));
        } else if (pathname === "/" || pathname === "/index.html") {
          response.writeHead(200, {
            "Content-Type": "text/html",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Embedder-Policy": "require-corp",
          });
          response.end(readPage().replace("</body>", `${RELOAD}</body>`));
        } else next();
      });
    },
  };
  const tell = () => {
    for (const page of open) page.write("data: built\n\n");
  };
  return { plugin, tell };
}

main(async () => {
  say(
    bold("dynaskin: building the demo. The first time takes some minutes; later starts, seconds."),
  );
  await buildForDemo();
  const { readFileSync } = await import("node:fs");
  const { join } = await import("node:path");
  const { build, preview } = await import("vite");
  const { plugin, tell } = reloading(() => readFileSync(join(DEMO, "dist", "index.html"), "utf8"));
  const watcher = await build({ root: DEMO, logLevel: "warn", build: { watch: {} } });
  await new Promise((done) => {
    watcher.on("event", (event) => {
      if (event.code === "ERROR") say(`  ${event.error?.message ?? "The page cannot be built."}`);
      if (event.code !== "END") return;
      tell();
      done();
    });
  });
  const portAt = process.argv.indexOf("--port");
  const port = portAt > 0 ? Number(process.argv[portAt + 1]) : 5180;
  const server = await preview({ root: DEMO, plugins: [plugin], preview: { port } });
  say(`\n${bold("▸ Demo page")} (Ctrl+C stops it)`);
  server.printUrls();
});
