// A static file server on localhost for tests and benchmarks: the repository as it lies.
// `node scripts/lib/serve.mjs PORT` runs it on its own.
import { createReadStream } from "node:fs";
import { stat } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize, sep } from "node:path";
import { ROOT } from "./paths.mjs";

const TYPES = {
  ".css": "text/css",
  ".html": "text/html",
  ".js": "text/javascript",
  ".json": "application/json",
  ".mjs": "text/javascript",
  ".wasm": "application/wasm",
};

/** What `/blank` answers: a page that tests import modules into. */
const BLANK = "<!doctype html><html lang=en><meta charset=utf-8><title>blank</title></html>";

/**
 * Serves `root` on 127.0.0.1; port 0 chooses a free one. `packed`: sends the `.br` beside a file in its place, to who
 * takes it.
 */
export async function serve({ root = ROOT, port = 0, packed = false } = {}) {
  const server = createServer((request, response) => {
    // Isolated, so that performance.now() steps by 5 µs.
    response.setHeader("Cross-Origin-Opener-Policy", "same-origin");
    response.setHeader("Cross-Origin-Embedder-Policy", "require-corp");
    response.setHeader("Cache-Control", "no-store");
    answer(root, packed, request, response).catch(() => response.writeHead(404).end("not found"));
  });
  await new Promise((done) => server.listen(port, "127.0.0.1", done));
  return { url: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}

async function answer(root, packed, request, response) {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  if (path === "/blank") {
    response.writeHead(200, { "Content-Type": TYPES[".html"] }).end(BLANK);
    return;
  }
  const file = join(root, normalize(path));
  if (!file.startsWith(root + sep)) throw new Error("outside the served folder");
  const type = TYPES[extname(file)] ?? "application/octet-stream";
  const takesPacked = packed && /\bbr\b/.test(request.headers["accept-encoding"] ?? "");
  const smaller = takesPacked ? await stat(`${file}.br`).catch(() => null) : null;
  const { size } = smaller ?? (await stat(file));
  if (smaller) response.setHeader("Content-Encoding", "br");
  response.writeHead(200, { "Content-Type": type, "Content-Length": size });
  createReadStream(smaller ? `${file}.br` : file).pipe(response);
}

if (process.argv[1] === import.meta.filename) await serve({ port: Number(process.argv[2]) });
