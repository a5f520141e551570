// What the package holds beside the code.
import { existsSync, readFileSync } from "node:fs";
import { homedir } from "node:os";
import { fileURLToPath } from "node:url";
import { describe, expect, it } from "vitest";

const SDK = new URL("../", import.meta.url);
const ROOT = fileURLToPath(new URL("../../", SDK));

const textOf = (file: string) => readFileSync(new URL(file, SDK), "utf8");

describe("the package", () => {
  it.each(["core", "renderer", "slim"])(
    "names no folder of the machine that built it: %s",
    (name) => {
      const bytes = readFileSync(new URL(`dist/wasm/${name}_bg.wasm`, SDK)).toString("latin1");
      for (const folder of [ROOT, `${homedir()}/`, "/.cargo/", "/registry/src/", "/rustlib/src/"]) {
        const place = bytes.indexOf(folder);
        expect(place < 0 ? "" : bytes.slice(place, place + 100), folder).toBe("");
      }
    },
  );

  it("holds the licences of all that is compiled in, and a bill of materials of the same", () => {
    const { files, version } = JSON.parse(textOf("package.json")) as {
      files: string[];
      version: string;
    };
    for (const file of ["THIRD_PARTY_NOTICES.txt", "sbom.cdx.json"]) {
      expect(files).toContain(file);
      expect(existsSync(new URL(file, SDK))).toBe(true);
    }
    const notices = textOf("THIRD_PARTY_NOTICES.txt");
    const bom = JSON.parse(textOf("sbom.cdx.json")) as {
      bomFormat: string;
      metadata: { component: { version: string } };
      components: { name: string; version: string; hashes?: { alg: string }[] }[];
      dependencies: { ref: string; dependsOn?: string[] }[];
    };
    expect(bom.bomFormat).toBe("CycloneDX");
    expect(bom.metadata.component.version).toBe(version);
    const names = bom.components.map(({ name }) => name);
    expect(names).toEqual(expect.arrayContaining(["tract-core", "wgpu", "glam", "gltf", "zip"]));
    for (const { name, version: of, hashes } of bom.components) {
      expect(notices).toContain(`  ${name} ${of}  `);
      expect(hashes?.[0]?.alg, name).toBe("SHA-256");
    }
    const own = bom.dependencies.find(({ ref }) => ref === `dynaskin@${version}`);
    expect(own?.dependsOn?.length).toBe(names.length);
  });
});
