// What stops the core from starting. A core that has started serves everybody, so these come first.
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { load } from "dynaskin";
import { load as loadInline, restPose } from "dynaskin/inline";
import { createWorkerAvatar } from "dynaskin/worker";
import { afterEach, describe, expect, it, vi } from "vitest";
import { expectError, modelFiles, modelFolder, readModelFile } from "./support.js";

afterEach(() => vi.restoreAllMocks());

const model = modelFolder();

describe("the WebAssembly file", () => {
  it("is a page of HTML, as servers answer for an unknown address", async () => {
    const wasm = new Response("<!doctype html><title>My app</title>");
    const error = await expectError("wasm", () => load({ model, wasm }));
    expect(error.message).toContain("web page where the dynaskin core should be");
  });

  it("is damaged", () => expectError("wasm", () => load({ model, wasm: new Uint8Array(100) })));

  it("needs SIMD, which the browser lacks", async () => {
    const validate = WebAssembly.validate;
    vi.spyOn(WebAssembly, "validate").mockImplementation((bytes) => {
      expect(validate(bytes)).toBe(true);
      return false;
    });
    const error = await expectError("wasm", () => load({ model, wasm: new Uint8Array(100) }));
    expect(error.message).toContain("SIMD");
  });

  it("is missing", () =>
    expectError("fetch", () => load({ model, wasm: new URL("missing.wasm", model) })));
});

describe("a download", () => {
  /** Sends half of what it announces, then hangs up, or waits for ever. */
  async function withServer<T>(hangUp: boolean, use: (url: string) => Promise<T>): Promise<T> {
    const file = readModelFile("body.glb");
    const server = createServer((_request, response) => {
      response.writeHead(200, { "Content-Length": file.length });
      response.write(file.subarray(0, file.length / 2), () => {
        if (hangUp) response.destroy();
      });
    });
    await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
    try {
      return await use(`http://127.0.0.1:${(server.address() as AddressInfo).port}/body.glb`);
    } finally {
      server.closeAllConnections();
      server.close();
    }
  }

  it("that breaks off half-way names the file", async () => {
    const error = await withServer(true, (body) =>
      expectError("fetch", () => load({ model: { ...modelFiles(), body } })),
    );
    expect(error.message).toContain("the body");
    expect(error.message).toContain("body.glb");
  });

  it("that is aborted half-way rejects with the signal's reason", async () => {
    const abort = new AbortController();
    const reason = new Error("the user left");
    const loading = withServer(false, (body) =>
      load({
        model: { ...modelFiles(), body },
        signal: abort.signal,
        onProgress: ({ loadedBytes }) => {
          if (loadedBytes > 400_000) abort.abort(reason);
        },
      }),
    );
    await expect(loading).rejects.toBe(reason);
  });
});

describe("other entries", () => {
  it("inline brings its own WebAssembly", async () => {
    const fetched = vi.spyOn(globalThis, "fetch");
    const loaded = await loadInline({ model: modelFiles() });
    const avatar = loaded.createAvatar();
    avatar.step(restPose(), 1 / 60);
    expect(avatar.positions.length).toBe(6890 * 3);
    expect(fetched).not.toHaveBeenCalled();
    const compiled = vi.spyOn(WebAssembly, "compile");
    (await loadInline({ model: modelFiles() })).dispose();
    expect(compiled).not.toHaveBeenCalled();
    compiled.mockRestore();
    await expectError("argument", () => loadInline(undefined as never));
    avatar.dispose();
    loaded.dispose();
  });

  it("worker says so where there are no workers", () =>
    expectError("worker", () => createWorkerAvatar({ model })));
});
