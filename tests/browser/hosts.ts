// Small servers with the headers of real hosts: the repository's files, and pages of a test's own.
import { readFile } from "node:fs/promises";
import { createServer, type OutgoingHttpHeaders } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join, normalize } from "node:path";
import { ROOT } from "./places.js";

const TYPES: Record<string, string> = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".json": "application/json",
  ".wasm": "application/wasm",
};

/** How a host answers. */
export interface HostOptions {
  /** Pages by path. */
  pages?: Record<string, string>;
  /** Headers of an answer; `isPage` for what is in `pages`. */
  headers?: (path: string, isPage: boolean) => OutgoingHttpHeaders;
  /** Paths that are not there, beside those that are none. */
  missing?: RegExp;
}

/** A host that runs; another port is another origin. */
export interface Host {
  origin: string;
  close: () => void;
}

/** Serves until it is closed. */
export async function startHost(options: HostOptions = {}): Promise<Host> {
  const { pages = {}, headers = () => ({}), missing = /$^/ } = options;
  const server = createServer(async (request, response) => {
    const path = new URL(request.url ?? "/", "http://host").pathname;
    const page = pages[path];
    const extra = headers(path, page !== undefined);
    try {
      if (missing.test(path)) throw new Error("not there");
      const body = page ?? (await readFile(join(ROOT, normalize(path))));
      const type = TYPES[extname(path) || ".html"];
      response.writeHead(200, { "Content-Type": type ?? "application/octet-stream", ...extra });
      response.end(body);
    } catch {
      response.writeHead(404, { "Content-Type": "text/plain", ...extra }).end("not there");
    }
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address() as AddressInfo;
  return {
    origin: `http://127.0.0.1:${port}`,
    close: () => {
      server.closeAllConnections();
      server.close();
    },
  };
}
