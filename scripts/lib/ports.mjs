// Ports that are free, so that two runs on one machine do not meet.
import { createServer } from "node:net";

/** The first of so many free ports in a row on localhost. */
export async function freePorts(count) {
  for (;;) {
    const first = 20_000 + Math.floor(Math.random() * 12_000);
    const row = Array.from({ length: count }, (_, idx) => isFree(first + idx));
    if ((await Promise.all(row)).every(Boolean)) return first;
  }
}

function isFree(port) {
  return new Promise((done) => {
    const server = createServer();
    server.once("error", () => done(false));
    server.listen(port, () => server.close(() => done(true)));
  });
}
