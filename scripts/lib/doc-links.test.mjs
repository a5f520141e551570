import { deepEqual } from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { brokenIn } from "./doc-links.mjs";

const root = mkdtempSync(join(tmpdir(), "doc-links-"));
after(() => rmSync(root, { recursive: true }));
mkdirSync(join(root, "docs"));
mkdirSync(join(root, "models", "female"), { recursive: true });
writeFileSync(join(root, "models", "female", "traits.json"), "{}");
writeFileSync(join(root, "README.md"), "# Soft tissue, *moving*\n");

const broken = async (text) => {
  const page = join(root, "docs", "page.md");
  writeFileSync(page, text);
  return await brokenIn(root, page);
};

test("what is there is no problem", async () => {
  const text = [
    "[readme](../README.md#soft-tissue-moving) ![](../models) [out](https://example.org/x)",
    "`models/female/` `models/BODY/traits.json` `models/*/*.json` `web/demo/dist` `text/html`",
    "[here](#below)",
    "",
    "## Below",
    "",
    "```sh\ncat models/nobody\n```",
  ];
  deepEqual(await broken(text.join("\n")), []);
});

test("a file, a heading and a path that are not there are told with their line", async () => {
  const text =
    "[a](gone.md)\n[b](../README.md#gone)\n\n`models/male/body.glb` `models/BODY/gone.json`\n";
  deepEqual(await broken(text), [
    "docs/page.md:1: gone.md is not there.",
    "docs/page.md:2: ../README.md#gone has no such heading.",
    "docs/page.md:4: `models/male/body.glb` is no file or folder of the repository.",
    "docs/page.md:4: `models/BODY/gone.json` is no file or folder of the repository.",
  ]);
});
