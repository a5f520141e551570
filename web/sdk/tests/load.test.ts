import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { once } from "node:events";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { type Body, type BundleFile, load, type Progress, restPose } from "dynaskin";
import { describe, expect, it } from "vitest";
import { expectError, loadModel, modelFiles, modelFolder, readModelFile } from "./support.js";

describe("load", () => {
  it("gives the body first, then the model", async () => {
    const order: string[] = [];
    const progress: Progress[] = [];
    let early: Body | null = null;
    const model = await load({
      model: modelFolder(),
      onProgress: (now) => progress.push({ ...now }),
      onBody: (body) => {
        early = body;
        const avatar = body.createAvatar();
        avatar.step(restPose(), 1 / 60);
        expect(avatar.dynamics).toBe(false);
        order.push("body");
        avatar.dispose();
      },
    });
    order.push("model");
    expect(order).toEqual(["body", "model"]);
    expect(model.body).toBe(early);
    expect(model.body.vertexCount).toBe(6890);
    const last = progress.at(-1);
    expect(last?.loadedBytes).toBe(last?.totalBytes);
    expect(last?.loadedBytes).toBeGreaterThan(1e5);
    model.dispose();
    model.dispose();
    await expectError("disposed", () => model.createAvatar());
  });

  it("takes a folder without the final slash, and files", async () => {
    const folder = modelFolder().href.replace(/\/$/, "");
    for (const model of [folder, modelFiles()]) {
      const loaded = await load({ model });
      expect(loaded.name).toBe("female");
      loaded.dispose();
    }
  });

  it("refuses what is no address with a sentence that helps", async () => {
    const error = await expectError("argument", () => load({ model: "models/female/" }));
    expect(error.message).toContain("full address");
    await expectError("argument", () => load({ model: 5 as unknown as string }));
  });

  it("may run twice at the same time", async () => {
    const [a, b] = await Promise.all([loadModel(), loadModel()]);
    a.dispose();
    b.createAvatar().dispose();
    b.dispose();
  });

  it("lets avatars live on when the model is disposed", async () => {
    const model = await loadModel();
    const avatar = model.createAvatar();
    model.dispose();
    avatar.step(restPose(), 1 / 60);
    expect(avatar.positions.length).toBe(6890 * 3);
    avatar.dispose();
  });

  it("rejects with the signal's reason when it is aborted", async () => {
    const reason = new Error("enough");
    await expect(load({ model: modelFolder(), signal: AbortSignal.abort(reason) })).rejects.toBe(
      reason,
    );
  });
});

describe("another method's networks", () => {
  const springs = new URL("methods/spring-bones/", modelFolder());

  it("share the body that is there, and leave it when they go", async () => {
    const model = await loadModel();
    const announced: number[] = [];
    const other = await load({
      model: springs,
      body: model.body,
      onProgress: ({ loadedBytes }) => announced.push(loadedBytes),
    });
    expect(other.body).toBe(model.body);
    expect(other.bundle.training.method).toBe("spring-bones");
    // body.glb has 1.1 MB, the networks of the springs 0.6 MB.
    expect(announced.at(-1)).toBeLessThan(1e6);
    const avatar = other.createAvatar();
    avatar.step(restPose(), 1 / 60);
    other.dispose();
    model.body.createAvatar().dispose();
    avatar.dispose();
    model.dispose();
  });

  it("are refused where the package leaves out the method's code, which the error says", async () => {
    const dsnet = new URL("methods/dsnet/", modelFolder());
    const model = await loadModel();
    await expect(load({ model: dsnet, body: model.body })).rejects.toMatchObject({
      code: "bundle",
      message: expect.stringContaining("guests"),
    });
    model.dispose();
  });

  it("are refused with the body of another model, and with what is no body", async () => {
    const male = await loadModel("male");
    const error = await expectError("bundle", () => load({ model: springs, body: male.body }));
    expect(error.message).toContain(male.body.sha256);
    await expectError("argument", () => load({ model: springs, body: {} as Body }));
    male.body.createAvatar().dispose();
    male.dispose();
  });
});

describe("files that cannot be used", () => {
  const noise = Uint8Array.from({ length: 3000 }, (_, idx) => (idx * 7919) % 251);
  const bundleText = (bytes: Uint8Array) => new TextDecoder().decode(bytes);
  const half = (bytes: Uint8Array) => bytes.slice(0, bytes.length / 2);
  const spoilHash = (file: BundleFile) => {
    file.sha256 = `${file.sha256.slice(0, -1)}${file.sha256.endsWith("0") ? "1" : "0"}`;
  };

  it("a folder that is not there", () =>
    expectError("fetch", () => load({ model: new URL("nowhere/", modelFolder()) })));

  it.each(["body", "predictor", "decoder"] as const)("a wrong hash of the %s", async (key) => {
    const error = await expectError("bundle", () =>
      load({ model: modelFiles({}, (bundle) => spoilHash(bundle[key])) }),
    );
    expect(error.message).toMatch(/hash|sha-?256/i);
  });

  it("a bundle that is no JSON", () =>
    expectError("bundle", () => load({ model: { ...modelFiles(), bundle: noise } })));

  it.each([
    ["bundle.json", "bundle.json"],
    ["body.glb", "the body"],
    ["predictor.onnx", "the predictor"],
    ["decoder.onnx", "the decoder"],
  ])("a web page where %s should be, naming the address that was asked", async (name, what) => {
    const page = "\ufeff\n<!doctype html><title>start</title>";
    const server = createServer((request, answer) => {
      const asked = String(request.url).split("/").at(-1) ?? "";
      answer.end(asked === name ? page : readModelFile(asked));
    }).listen(0, "127.0.0.1");
    try {
      await once(server, "listening");
      const { port } = server.address() as AddressInfo;
      const model = `http://127.0.0.1:${port}/models/femail`;
      const error = await expectError("bundle", () => load({ model }));
      expect(error.message).toContain(`web page where ${what} should be: ${model}/${name}. `);
    } finally {
      server.close();
    }
  });

  it.each(["bundle", "body", "predictor", "decoder"] as const)(
    "the bytes of a web page as the %s",
    async (key) => {
      const bytes = new TextEncoder().encode("\n<!doctype html><title>start</title>");
      const error = await expectError("bundle", () =>
        load({ model: { ...modelFiles(), [key]: bytes } }),
      );
      expect(error.message).toMatch(/web page where [\w. ]+ should be\. /);
    },
  );

  it.each([
    "//elsewhere.example/body.glb",
    "https://elsewhere.example/body.glb",
    "data:model/gltf-binary,x",
    "../../../secret",
    "..\\secret",
    "file:///etc/hostname",
    "sub/body.glb",
    ".hidden",
    "",
    "body\n.glb",
    5,
    null,
  ])("a bundle that names %j as its body, before anything is asked for", async (name) => {
    const bundle = JSON.parse(bundleText(readModelFile("bundle.json")));
    bundle.body.file = name;
    const asked: string[] = [];
    const server = createServer((request, answer) => {
      asked.push(String(request.url));
      answer.end(JSON.stringify(bundle));
    }).listen(0, "127.0.0.1");
    try {
      await once(server, "listening");
      const { port } = server.address() as AddressInfo;
      const error = await expectError("bundle", () =>
        load({ model: `http://127.0.0.1:${port}/m` }),
      );
      expect(error.message).toMatch(/body\.file is/);
      expect(asked).toEqual(["/m/bundle.json"]);
    } finally {
      server.close();
    }
  });

  it("a bundle.json of another hash than the integrity given", async () => {
    const bytes = readModelFile("bundle.json");
    const integrity = `sha256-${createHash("sha256").update(bytes).digest("base64")}`;
    (await load({ model: modelFolder(), integrity })).dispose();
    const changed = { ...modelFiles(), bundle: new TextEncoder().encode(`${bundleText(bytes)} `) };
    const error = await expectError("bundle", () => load({ model: changed, integrity }));
    expect(error.message).toContain(`expected ${integrity}`);
    for (const odd of ["", "sha256-", "sha512-abc", 5 as unknown as string]) {
      await expectError("argument", () => load({ model: modelFolder(), integrity: odd }));
    }
  });

  it("a bundle.json without end: the download is stopped", async () => {
    let sent = 0;
    let isClosed = false;
    const server = createServer((_request, answer) => {
      const block = Buffer.alloc(1 << 20, " ");
      const more = () => {
        while (!isClosed && sent < 1 << 28) {
          sent += block.length;
          if (!answer.write(block)) break;
        }
      };
      answer.on("drain", more);
      answer.on("close", () => {
        isClosed = true;
      });
      more();
    }).listen(0, "127.0.0.1");
    try {
      await once(server, "listening");
      const { port } = server.address() as AddressInfo;
      const error = await expectError("fetch", () => load({ model: `http://127.0.0.1:${port}/m` }));
      expect(error.message).toMatch(/bundle\.json has 17 MiB; at most 16 MiB are read/);
      expect(sent).toBeLessThan(1 << 27);
    } finally {
      server.closeAllConnections();
      server.close();
    }
  });

  it("a bundle of another format", () =>
    expectError("bundle", () =>
      load({
        model: modelFiles({}, (bundle) => {
          bundle.format = "something-else";
        }),
      }),
    ));

  it("a bundle whose vertices are not of the body", () =>
    expectError("bundle", () =>
      load({
        model: modelFiles({}, (bundle) => {
          bundle.vertices[bundle.vertices.length - 1] = 6890;
        }),
      }),
    ));

  it("a body that is no GLB", () =>
    expectError("body", () => load({ model: modelFiles({ body: noise }) })));

  it("a truncated body", () =>
    expectError("body", () =>
      load({ model: modelFiles({ body: half(readModelFile("body.glb")) }) }),
    ));

  it("a predictor that is no ONNX", () =>
    expectError("network", () => load({ model: modelFiles({ predictor: noise }) })));

  it("a truncated decoder", () => {
    const decoder = half(readModelFile("decoder.onnx"));
    return expectError("network", () => load({ model: modelFiles({ decoder }) }));
  });

  it("a decoder in the predictor's place, which breaks the contract", () => {
    const predictor = readModelFile("decoder.onnx");
    return expectError("network", () => load({ model: modelFiles({ predictor }) }));
  });

  it("leaves what was loaded before untouched", async () => {
    const model = await loadModel();
    const avatar = model.createAvatar();
    await expectError("network", () => load({ model: modelFiles({ predictor: noise }) }));
    avatar.step(restPose(), 1 / 60);
    avatar.dispose();
    model.dispose();
  });
});

describe("import", () => {
  it("works in plain Node, with nothing printed and nothing of a browser needed", () => {
    const code =
      "import * as sdk from 'dynaskin'; import * as renderer from 'dynaskin/renderer';" +
      "if (typeof sdk.load !== 'function' || typeof renderer.createRenderer !== 'function') process.exit(3);";
    const output = execFileSync(process.execPath, ["--input-type=module", "-e", code], {
      cwd: import.meta.dirname,
      encoding: "utf8",
      stdio: ["ignore", "pipe", "pipe"],
    });
    expect(output).toBe("");
  });
});
