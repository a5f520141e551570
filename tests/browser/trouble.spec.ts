// What goes wrong or comes slowly: downloads, a body that cannot be had, a clipboard that is shut.
import { readFileSync, statSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";
import { gzipSync } from "node:zlib";
import { expect, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { hopFile } from "../hop-bvh.js";
import { hopGlb } from "../hop-files.js";
import { ROOT } from "./places.js";
import { dropFile, dropFiles, openAddress, openDemo, test } from "./support.js";

const DIST = join(ROOT, "web", "demo", "dist");
const TYPES: Record<string, string> = {
  ".css": "text/css",
  ".html": "text/html",
  ".js": "text/javascript",
  ".svg": "image/svg+xml",
  ".wasm": "application/wasm",
};

/** Serves the build packed, as most hosts do. */
async function servePacked(): Promise<{ server: Server; url: string }> {
  const server = createServer((request, response) => {
    const { pathname } = new URL(request.url ?? "/", "http://localhost");
    const file = join(DIST, pathname === "/" ? "index.html" : pathname);
    const packed = gzipSync(readFileSync(file), { level: 1 });
    response.writeHead(200, {
      "Content-Type": TYPES[extname(file)] ?? "application/octet-stream",
      "Content-Encoding": "gzip",
      "Content-Length": packed.length,
    });
    response.end(packed);
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  return { server, url: `http://127.0.0.1:${(server.address() as AddressInfo).port}/` };
}

/** Keeps what the progress bar shows, from the first moment. */
async function watchBar(page: Page): Promise<void> {
  await page.addInitScript(() => {
    const seen: { share: number; text: string; done: boolean }[] = [];
    Object.assign(window, { seen });
    document.addEventListener("DOMContentLoaded", () => {
      const [bar, fill, text] = ["loading", "loading-fill", "loading-text"].map((id) =>
        document.getElementById(id),
      );
      const look = () =>
        seen.push({
          share: Number.parseFloat(fill?.style.width || "0"),
          text: text?.textContent ?? "",
          done: bar?.classList.contains("done") ?? false,
        });
      const watcher = new MutationObserver(look);
      if (bar) watcher.observe(bar, { subtree: true, attributes: true, childList: true });
    });
  });
}

type Seen = { share: number; text: string; done: boolean }[];
const barSeen = (page: Page) => page.evaluate(() => (window as unknown as { seen: Seen }).seen);
const totals = (seen: Seen) => seen.flatMap(({ text }) => text.match(/of ([\d.]+) MB/)?.[1] ?? []);

test("one bar from the first byte to the networks, also where the server packs", async ({
  page,
}) => {
  const { server, url } = await servePacked();
  try {
    await watchBar(page);
    await openAddress(page, `${url}?left=spring-bones&hud=1&resolution=full`);
    await expect(page.locator("#loading")).toHaveClass(/done/);
    const seen = await barSeen(page);
    expect(seen.length).toBeGreaterThan(10);
    const shares = seen.map(({ share }) => share);
    expect(shares).toEqual(shares.toSorted((a, b) => a - b));
    expect(shares.at(-1)).toBe(100);
    // It fills neither early nor with an end that moves away.
    const before = seen.filter(({ done }) => !done);
    expect(new Set(totals(before)).size).toBe(1);
    expect(before[0]?.share).toBeLessThan(20);
    expect(before.some(({ share }) => share > 30 && share < 95)).toBe(true);
    expect(before.at(-1)?.share).toBeGreaterThan(99);
    expect(before.at(-1)?.text).toContain("unpacked");
    const files = ["body.glb", "predictor.onnx", "decoder.onnx", "bundle.json"];
    const bytes = files.reduce(
      (sum, name) => sum + statSync(join(DIST, "female", name)).size,
      ["predictor.onnx", "decoder.onnx", "bundle.json"].reduce(
        (sum, name) => sum + statSync(join(DIST, "female", "methods", "spring-bones", name)).size,
        0,
      ),
    );
    expect(Number(totals(before)[0])).toBeGreaterThan(bytes / 1e6 + 5);
    const told = await page.locator("#hud-rows").textContent();
    const [, packed = "", unpacked = ""] =
      /downloads([\d,]+) KBunpacked([\d,]+) KB/.exec(told ?? "") ?? [];
    const kilobytes = (text: string) => Number(text.replaceAll(",", ""));
    console.log(`downloads ${packed} KB, unpacked ${unpacked} KB, bar ${totals(before)[0]} MB`);
    // The page itself counts, too.
    expect(kilobytes(unpacked)).toBeGreaterThan(1000 * Number(totals(before)[0]));
    expect(kilobytes(packed)).toBeLessThan(0.8 * kilobytes(unpacked));
    expect(kilobytes(packed)).toBeGreaterThan(1500);
  } finally {
    server.closeAllConnections();
    server.close();
  }
});

test("what is fetched later has a bar of its own and is added to the downloads", async ({
  page,
}) => {
  await watchBar(page);
  await openDemo(page, "?paused=1&hud=1&view=side");
  const told = async () =>
    Number(
      (await page.locator("#hud-rows").textContent())
        ?.match(/downloads([\d,]+) KB/)?.[1]
        ?.replaceAll(",", ""),
    );
  await expect.poll(told).toBeGreaterThan(2000);
  const first = await told();
  await page.getByLabel("Second", { exact: true }).selectOption({ label: "DSNet (narrow)" });
  await expect(page.locator("#names")).toContainText("DSNet (narrow)");
  await expect.poll(told).toBeGreaterThan(first + 900);
  const second = await told();
  await page
    .getByRole("combobox", { name: "Motion" })
    .selectOption({ label: "One leg hop, simulated" });
  await expect(page.locator("#names")).toContainText("Ground truth");
  await expect.poll(told).toBeGreaterThan(second + 500);
  const third = await told();
  await page.getByText("Male", { exact: true }).click();
  await expect(page.locator("#now-playing")).toContainText(/ male body/, { timeout: 120_000 });
  await expect.poll(told).toBeGreaterThan(third + 2000);
  await expect(page.locator("#loading")).toHaveClass(/done/);
  const seen = await barSeen(page);
  const again = seen.slice(seen.findIndex(({ done }) => done)).filter(({ done }) => !done);
  expect(again.some(({ share }) => share < 20)).toBe(true);
  expect(again.some(({ text }) => text.includes("DSNet"))).toBe(true);
});

test("a body that cannot be had leaves clip, actors, panel and address alone", async ({ page }) => {
  await page.route("**/male/body.glb", (route) => route.abort());
  await openDemo(page, "?paused=1&view=side&left=dmpl&clip=one-leg-hop&third=truth&heat=error");
  // Whatever changes writes the address anew.
  await page.keyboard.press("t");
  const names = page.locator("#names .name span");
  const list = page.getByRole("combobox", { name: "Motion" });
  const state = async () => ({
    names: await names.allTextContents(),
    address: page.url(),
    motion: await list.inputValue(),
    clips: await list.locator("#motion-clips option").allTextContents(),
    slots: await Promise.all(
      ["left", "right", "third", "fourth"].map((slot) =>
        page.locator(`#actor-${slot}`).inputValue(),
      ),
    ),
    sex: await page.locator("input[name=sex]:checked").inputValue(),
    playing: await page.locator("#now-playing").textContent(),
    legend: await page.locator("#legend-title").textContent(),
  });
  const before = await state();
  expect(before.names).toEqual(["Dyna / DMPL", "dynaskin", "Ground truth"]);
  await page.getByText("Male", { exact: true }).click();
  await expect(page.getByRole("alert")).toContainText("The male body could not be loaded");
  expect(await state()).toEqual(before);
  await expect(page.locator("#clothes-note")).toContainText("Ground truth was simulated");
  await expect(page.locator("#loading")).toHaveClass(/done/);
});

test("a message goes when what it says is over", async ({ page }) => {
  await page.route("**/male/body.glb", (route) => route.abort());
  await openDemo(page);
  const alert = page.getByRole("alert");
  await test.step("a file that was refused, once another motion is chosen", async () => {
    await dropFile(page, "letter.bvh", "Dear reader, this is no motion.");
    await expect(alert).toContainText("letter.bvh cannot be played");
    await page.getByRole("combobox", { name: "Motion" }).selectOption("twist");
    await expect(alert).not.toContainText("letter.bvh");
    await expect(page.locator("#file-report")).toBeHidden();
  });
  await test.step("a body that could not be had, once it is there", async () => {
    await page.getByText("Male", { exact: true }).click();
    await expect(alert).toContainText("The male body could not be loaded");
    await page.unroute("**/male/body.glb");
    // By the panel; with the message's own button it goes anyway.
    await page.getByText("Male", { exact: true }).click();
    await expect(page.locator("#now-playing")).toContainText("male body");
    await expect(page.locator("#loading")).toHaveClass(/done/);
    await expect(alert).not.toContainText("could not be loaded");
  });
  await test.step("a recording, once it has ended", async () => {
    await page.keyboard.press("v");
    await expect(page.getByText("Press again to stop")).toBeVisible();
    const download = page.waitForEvent("download");
    await page.keyboard.press("v");
    await download;
    await expect(page.getByText("Press again to stop")).toHaveCount(0);
  });
});

test("who goes back to the body on the screen has it at once", async ({ page }) => {
  let letGo = () => {};
  const held = new Promise<void>((done) => {
    letGo = done;
  });
  await page.route("**/male/body.glb", async (route) => {
    await held;
    await route.continue().catch(() => {});
  });
  await openDemo(page, "?paused=1&view=side&clip=one-leg-hop&third=truth");
  await page.keyboard.press("t");
  const names = await page.locator("#names .name span").allTextContents();
  const address = page.url();
  await page.getByText("Male", { exact: true }).click();
  await expect(page.locator("#loading")).not.toHaveClass(/done/);
  await page.getByText("Female", { exact: true }).click();
  await expect(page.locator("#loading")).toHaveClass(/done/);
  letGo();
  expect(await page.locator("#names .name span").allTextContents()).toEqual(names);
  expect(page.url()).toBe(address);
  await expect(page.getByLabel("Third", { exact: true })).toHaveValue("truth");
});

test("a comparison that cannot be had with the other body leaves the usual actors", async ({
  page,
}) => {
  await page.route("**/female/methods/dmpl/*.onnx", (route) => route.abort());
  await openDemo(page, "?paused=1&view=side&left=dmpl");
  await expect(page.getByRole("alert")).toContainText("That comparison could not be loaded");
  await expect(page.locator("#names .name span")).toHaveText(["Linear skinning", "dynaskin"]);
  await expect(page.getByLabel("First", { exact: true })).toHaveValue("linear");
});

test("without a clipboard the text is shown to be copied by hand", async ({ page }) => {
  await page.addInitScript(() => {
    Object.defineProperty(navigator, "clipboard", { value: undefined });
  });
  const problems = await openDemo(page, "?paused=1&hud=1");
  const dialog = page.getByRole("dialog", { name: "Copy it by hand" });
  const shown = async (): Promise<string> => {
    await expect(dialog).toBeVisible();
    const text = await page.evaluate(() => {
      const area = document.activeElement as HTMLTextAreaElement;
      return area.value.slice(area.selectionStart, area.selectionEnd);
    });
    await page.keyboard.press("Escape");
    await expect(dialog).toBeHidden();
    return text;
  };
  await page.getByRole("button", { name: "Link to this view" }).click();
  expect(await shown()).toBe(page.url());
  await page.locator("#hud-copy").click();
  expect(await shown()).toContain("dynaskin timings");
  await page.keyboard.press("u");
  await page.getByRole("button", { name: "Copy the program" }).click();
  expect(await shown()).toContain('from "dynaskin"');
  await expect(page.getByRole("dialog", { name: "Use it in your page" })).toBeVisible();
  expect(problems).toEqual([]);
});

test("a clipboard that refuses is no error without an answer", async ({ page }) => {
  await page.addInitScript(() => {
    navigator.clipboard.writeText = () => Promise.reject(new Error("not allowed"));
  });
  const problems = await openDemo(page, "?paused=1");
  await page.getByRole("button", { name: "Link to this view" }).click();
  await expect(page.getByRole("dialog", { name: "Copy it by hand" })).toBeVisible();
  expect(problems).toEqual([]);
});

test("notes wait for their turn in a screen reader, errors do not", async ({ page }) => {
  await openDemo(page, "?paused=1");
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Link to this view" }).click();
  const notes = page.locator("#notes");
  await expect(notes).toHaveAttribute("role", "status");
  await expect(notes).toContainText("Copied");
  await expect(page.getByRole("alert")).toBeEmpty();
  await dropFile(page, "letter.bvh", "Dear reader");
  await expect(page.getByRole("alert")).toContainText("letter.bvh cannot be played");
  await expect(notes).not.toContainText("letter.bvh");
  await page.getByRole("alert").getByRole("button", { name: "Close this message" }).click();
  await expect(page.getByRole("alert")).toBeEmpty();
});

test("a timeline that is dragged jumps once a picture", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&view=side&left=dsnet");
  const counted = await page.evaluate(async () => {
    const demo = window.dynaskinDemo;
    const avatar = demo?.avatar;
    if (!demo || !avatar) throw new Error("the demo is not ready");
    let steps = 0;
    const step = avatar.step;
    avatar.step = function (...given) {
      steps += 1;
      return step.apply(this, given);
    };
    const input = document.getElementById("time") as HTMLInputElement;
    const start = performance.now();
    for (let event = 0; event < 25; event += 1) {
      input.value = `${2 + event * 0.1}`;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
    const eventsMs = performance.now() - start;
    const atOnce = steps;
    await new Promise((done) => setTimeout(done, 3000));
    return { eventsMs, atOnce, steps, timeSeconds: demo.timeSeconds };
  });
  console.log(
    `25 events of the timeline: ${counted.eventsMs.toFixed(1)} ms, ${counted.steps} steps`,
  );
  expect(counted.atOnce).toBe(0);
  // One jump: the two seconds before it, and its first moment.
  expect(counted.steps).toBe(121);
  expect(counted.timeSeconds).toBeCloseTo(4.4, 2);
  await expect(page).toHaveURL(/time=4\.4/);
});

test("of several files the first is played, and the page says so; none leaves the computer", async ({
  page,
}) => {
  await openDemo(page, "?paused=1");
  // A file brings the whole core with it: pages and models may be asked for, nothing may be sent.
  const origin = new URL(page.url()).origin;
  const sent: string[] = [];
  page.on("request", (request) => {
    const isLocal = /^(data|blob):/.test(request.url());
    const isAsked = request.url().startsWith(`${origin}/`) && !request.url().includes("?");
    if (!isLocal && !(isAsked && request.method() === "GET" && request.postData() === null)) {
      sent.push(`${request.method()} ${request.url()}`);
    }
  });
  await dropFiles(page, [
    ["first.bvh", hopFile()],
    ["second.bvh", hopFile()],
    ["third.bvh", hopFile()],
  ]);
  await expect(page.locator("#now-playing")).toContainText("first.bvh");
  await expect(page.locator("#notes")).toContainText("3 were dropped; only the first, first.bvh");
  await dropFile(page, "hop.glb", await hopGlb());
  await expect(page.locator("#now-playing")).toContainText("hop.glb");
  await dropFile(page, "letter.bvh", "Dear reader");
  await expect(page.getByRole("alert")).toContainText("letter.bvh cannot be played");
  expect(sent).toEqual([]);
});

test("a refused file shows which joints it has", async ({ reused: page }) => {
  await openDemo(page, "?paused=1");
  const report = page.locator("#file-report");
  const stranger = hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box");
  await dropFile(page, "nobody.bvh", stranger);
  await expect(report).toContainText("nobody.bvh cannot be played");
  const joints = [...stranger.matchAll(/(?:ROOT|JOINT) (\S+)/g)].map(([, name]) => name);
  await expect(report.locator("td")).toHaveText(joints as string[]);
  await expect(report.locator("summary")).toHaveText(`Its joints (${joints.length})`);
  await dropFile(page, "cut.glb", (await hopGlb()).slice(0, 3000));
  await expect(report).toContainText("cut.glb cannot be played");
  await expect(report.locator("table")).toHaveCount(0);
});
