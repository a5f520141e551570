// Every control that the page has is driven somewhere: a new one without a test fails here. And the
// controls that no other spec drives.
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { ROOT } from "./places.js";
import { dropFile, openDemo, test } from "./support.js";

/** Where each control is driven: a spec, and what stands in it where it is. */
const DRIVEN: Record<string, [spec: string, text: string]> = {
  "#actor-fourth": ["visitors", 'getByLabel("Fourth"'],
  "#actor-left": ["compare", 'actor(page, "Left")'],
  "#actor-right": ["compare", 'actor(page, "Right")'],
  "#actor-third": ["controls", 'getByLabel("Third"'],
  "#below-code": ["story", '"#below-code"'],
  "#benchmark-again": ["controls", '"Measure again"'],
  "#benchmark-copy": ["visitors", '"Copy as text"'],
  "#benchmark-holder": ["access", '"#benchmark-holder"'],
  "#benchmark-open": ["visitors", '"Run the benchmark on my machine"'],
  "#caption-close": ["controls", '"Close this caption"'],
  "#chapter-bodies": ["story", '"Five bodies"'],
  "#chapter-ghost": ["story", '"Measure"'],
  "#chapter-grab": ["story", '"Grab it"'],
  "#chapter-look": ["story", '"Compare"'],
  "#code-copy": ["compare", '"Copy the program"'],
  "#code-open": ["controls", '"Use it in your page"'],
  "#code-text": ["compare", '"#code-text"'],
  "#copy-text": ["trouble", "HTMLTextAreaElement"],
  "#dynamics": ["demo", '"Tissue dynamics"'],
  "#file": ["files", "filechooser"],
  "#frame-step": ["demo", '"Next frame"'],
  "#grab": ["by-hand", '"Grab the body"'],
  "#grip-chest": ["by-hand", '"Chest"'],
  "#grip-pelvis": ["by-hand", '"Pelvis"'],
  "#heat": ["demo", '"Heat map"'],
  "#height": ["demo", 'getByLabel("Height")'],
  "#hud-copy": ["demo", 'name: "Copy"'],
  "#hud-toggle": ["demo", '"Timings"'],
  "#keys-open": ["controls", '"Keys and gestures"'],
  "#lab-share": ["story", '"#lab-share"'],
  "#lab-leave": ["story", '"Back to the story"'],
  "#link-copy": ["compare", '"Link to this view"'],
  "#motion": ["demo", '{ name: "Motion" }'],
  "#name-left": ["compare", '"#name-left"'],
  "#name-right": ["controls", '"#name-right"'],
  "#open-file": ["files", '"Open a motion file"'],
  "#picture": ["compare", '"Picture"'],
  "#play": ["demo", '"Play"'],
  "#plots-toggle": ["compare", '"Plots"'],
  "#record": ["compare", '"Record"'],
  "#region": ["compare", '"Region of the plots"'],
  "#share-clip": ["story", '"#share-clip"'],
  "#share-code": ["story", '"#share-code"'],
  "#share-link": ["story", '"#share-link"'],
  "#share-picture": ["story", '"#share-picture"'],
  "#sheet-handle": ["demo", '"Show or hide the controls"'],
  "#shape-random": ["demo", '"Random body"'],
  "#shape-reset": ["demo", '"Average body"'],
  "#speed": ["demo", '"Playback speed"'],
  "#story-lab": ["story", '"Lab"'],
  "#story-play": ["story", '"Play"'],
  "#story-share": ["story", '"Share"'],
  "#strength-all": ["demo", 'getByLabel("Strength")'],
  "#swap": ["compare", '"Swap sides"'],
  "#tempo": ["demo", 'getByLabel("Tempo")'],
  "#time": ["demo", '"Time in the motion"'],
  "#trait-age": ["demo", '["age", "60"]'],
  "#trait-chest": ["demo", '["chest", "100"]'],
  "#trait-muscle": ["demo", '["muscle", "80"]'],
  "#trait-stature": ["demo", 'getByLabel("Stature")'],
  "#trait-weight": ["demo", 'getByLabel("Weight")'],
  "#divider": ["compare", '"#divider"'],
  "#view": ["keys", '"#view"'],
  "clothes=sportswear": ["keys", '"Sportswear"'],
  "clothes=unsupported": ["compare", '"Unsupported"'],
  "heat-of=error": ["compare", 'getByText("Error")'],
  "heat-of=offset": ["controls", 'getByText("Offset"'],
  "look=sculpture": ["story", '"Sculpture"'],
  "look=skin": ["story", '"Skin and cloth"'],
  "layout=one": ["keys", '"One"'],
  "layout=side": ["keys", '"Side by side"'],
  "layout=wipe": ["compare", '"Divider"'],
  "sex=female": ["keys", '"Female"'],
  "sex=male": ["demo", '"Male"'],
  "tissue-property=damping": ["demo", '"Damping"'],
  "tissue-property=gain": ["demo", '"Gain"'],
  "tissue-property=stiffness": ["demo", '"Stiffness"'],
  "Close in #benchmark-dialog": ["controls", "DIALOGS"],
  "Close in #code-dialog": ["controls", "DIALOGS"],
  "Close in #copy-dialog": ["controls", "DIALOGS"],
  "Close in #share-dialog": ["story", '"Close"'],
  "Close in #keys-dialog": ["controls", "DIALOGS"],
  "An avatar of your own": ["own", '"An avatar of your own"'],
  "Close this message": ["trouble", '"Close this message"'],
  "Try again": ["conditions", '"Try again"'],
  "a link": ["story", '"How to cite"'],
  "a name over an actor": ["keys", '"#names .name"'],
  "a region": ["demo", 'getByLabel("Belly")'],
  "a shape coefficient": ["demo", '"Shape 10"'],
  "summary Its joints": ["controls", "Its joints"],
  "summary Regions": ["demo", '"Regions"'],
  "summary Ten shape coefficients": ["demo", '"Ten shape coefficients"'],
};

/** What a list calls each control of the page at the moment. */
function controlsOf(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const all = [
      ...document.querySelectorAll<HTMLElement>(
        "button, select, input, textarea, summary, a[href], [tabindex='0'], [role=slider]",
      ),
    ];
    return all.map((control) => {
      const { id } = control;
      if (/^region-/.test(id)) return "a region";
      if (/^shape-\d+$/.test(id)) return "a shape coefficient";
      if (control.matches("#names .name")) return "a name over an actor";
      // The page's text, which links to parts of itself and to what lies beside it.
      if (control.closest(".links, .below") && control.matches("a, [role=region]")) return "a link";
      if (id) return `#${id}`;
      if (control.matches("input[type=radio]")) {
        const { name, value } = control as HTMLInputElement;
        return `${name}=${value}`;
      }
      const dialog = control.closest("dialog");
      if (dialog && control.matches(".close")) return `Close in #${dialog.id}`;
      const text = control.getAttribute("aria-label") ?? control.textContent?.trim() ?? "";
      return control.matches("summary") ? `summary ${text.replace(/ \(.*/, "")}` : text;
    });
  });
}

test("every control of the page is driven by a spec", async ({ page }) => {
  await page.route("**/methods/dmpl/*.onnx", (route) => route.abort());
  await openDemo(page, "?paused=1&view=side&motion=jump&caption=1&left=dmpl");
  await expect(page.getByRole("button", { name: "Try again" })).toBeVisible();
  const { hopFile } = await import("../hop-bvh.js");
  await dropFile(page, "nobody.bvh", hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box"));
  await expect(page.locator("#file-report summary")).toBeVisible();
  const found = new Set(await controlsOf(page));
  const driven = new Set(Object.keys(DRIVEN));
  expect([...found].filter((name) => !driven.has(name))).toEqual([]);
  expect([...driven].filter((name) => !found.has(name))).toEqual([]);
  const folder = join(ROOT, "tests", "browser");
  const specs = readdirSync(folder).filter((name) => name.endsWith(".spec.ts"));
  for (const [name, [spec, text]] of Object.entries(DRIVEN)) {
    expect(specs).toContain(`${spec}.spec.ts`);
    // In this file the table itself has the text once.
    const times = readFileSync(join(folder, `${spec}.spec.ts`), "utf8").split(text).length - 1;
    expect(times, `${name} in ${spec}.spec.ts`).toBeGreaterThan(spec === "controls" ? 1 : 0);
  }
});

const DIALOGS: [open: string, name: string][] = [
  ["Keys and gestures", "Keys and gestures"],
  ["Use it in your page", "Use it in your page"],
  ["Run the benchmark on my machine", "Methods on this machine"],
  ["Link to this view", "Copy it by hand"],
];

// In a page of its own: a script that runs before a page's own does so only where a page is loaded.
test("every dialog closes by its button, by Escape and by a click beside it", async ({ page }) => {
  await page.addInitScript(() => {
    Object.defineProperty(navigator, "clipboard", { value: undefined });
  });
  await openDemo(page, "?paused=1");
  for (const [opener, name] of DIALOGS) {
    const dialog = page.getByRole("dialog", { name });
    const ways = [
      () => dialog.getByRole("button", { name: "Close", exact: true }).click(),
      () => page.keyboard.press("Escape"),
      () => page.mouse.click(8, 320),
    ];
    for (const close of ways) {
      await page.getByRole("button", { name: opener, exact: true }).click();
      await expect(dialog).toBeVisible();
      // A click within stays.
      await dialog.getByRole("heading", { level: 2 }).click();
      await expect(dialog).toBeVisible();
      await close();
      await expect(dialog).toBeHidden();
    }
  }
});

test("the benchmark measures again, with the page still meanwhile", async ({ page }) => {
  await openDemo(page, "?paused=1");
  await page.keyboard.press("k");
  const again = page.getByRole("button", { name: "Measure again" });
  const note = page.locator("#benchmark-note");
  await expect(note).toContainText("medians of nine rounds", { timeout: 120_000 });
  const times = () => page.locator("#benchmark-table td:nth-child(2)").allTextContents();
  const first = await times();
  await again.click();
  await expect(again).toBeDisabled();
  await expect(note).toContainText(/round \d of 9/);
  await expect(note).toContainText("medians of nine rounds", { timeout: 120_000 });
  await expect(again).toBeEnabled();
  expect((await times()).length).toBe(first.length);
  expect(await times()).not.toEqual(first);
});

test("third and fourth actor, offset and error, name and joints", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&view=side&clip=one-leg-hop&heat=error");
  const names = page.locator("#names .name span");
  for (const [label, slot] of [
    ["DSNet (narrow)", "Third"],
    ["Casas & Otaduy (narrow)", "Fourth"],
  ] as const) {
    await page.getByLabel(slot, { exact: true }).selectOption({ label });
    await expect(names.last()).toHaveText(label);
  }
  await page.evaluate(() => window.dynaskinDemo?.seek(2.6));
  // Both move their skins, and not alike.
  await page.getByLabel("Third", { exact: true }).selectOption({ label: "Nobody" });
  await expect(names).toHaveCount(3);
  await page.locator("#heat-of").getByText("Offset", { exact: true }).click();
  await expect(page.locator("#legend-title")).toHaveText("Offset of the skin (mm)");
  expect(page.url()).toContain("heat=1");
  await page.locator("#layout").getByText("Divider").click();
  await page.locator("#name-right").hover();
  await page.mouse.down();
  await expect(page.locator("#name-right")).toHaveAttribute("aria-pressed", "true");
  await page.mouse.up();
  const { hopFile } = await import("../hop-bvh.js");
  await dropFile(page, "nobody.bvh", hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box"));
  const table = page.locator("#file-report table");
  await expect(table).toBeVisible();
  await page.getByText("Its joints").click();
  await expect(table).toBeHidden();
});

for (const [kind, label, frames] of [
  ["dsnet", "DSNet (narrow)", "62,417 frames"],
  ["casas-otaduy", "Casas & Otaduy (narrow)", "85,856 frames"],
] as const) {
  test(`${label} moves the skin as its networks say, and its caption is honest`, async ({
    reused: page,
  }) => {
    await openDemo(page, "?paused=1&motion=jump&clothes=unsupported");
    await page.getByLabel("Actor", { exact: true }).selectOption({ label });
    await expect(page.locator("#names .name span")).toHaveText(label);
    expect(page.url()).toContain(`right=${kind}`);
    const largestMm = await page.evaluate(() => {
      const demo = window.dynaskinDemo;
      let size = 0;
      for (const time of [1.7, 1.8, 1.9, 2]) {
        demo?.seek(time);
        for (const value of demo?.avatar?.offsets ?? []) size = Math.max(size, Math.abs(value));
      }
      return 1000 * size;
    });
    console.log(`${label}: ${largestMm.toFixed(1)} mm around a landing`);
    expect(largestMm).toBeGreaterThan(3);
    expect(largestMm).toBeLessThan(150);
    await expect(page.locator("#about-text")).toContainText("Narrow: it has fewer weights here");
    await expect(page.locator("#about-text")).toContainText(frames);
  });
}

for (const name of ["run-in-place", "shake-hips", "one-leg-hop"]) {
  test(`${name} by formula plays`, async ({ reused: page }) => {
    const problems = await openDemo(page, "?paused=1");
    await page.getByRole("combobox", { name: "Motion" }).selectOption(name);
    expect(page.url()).toContain(`motion=${name}`);
    const poses = await page.evaluate(() => {
      const demo = window.dynaskinDemo;
      return [1.5, 1.7, 1.9].map((time) => {
        demo?.seek(time);
        return [...(demo?.avatar?.skinMatrices.slice(0, 64) ?? [])].join();
      });
    });
    expect(new Set(poses).size).toBe(3);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
    const before = await time();
    await expect.poll(time).not.toBe(before);
    expect(problems).toEqual([]);
  });
}

test("a slider goes back to its usual value by a double click, and to its ends by keys", async ({
  reused: page,
}) => {
  await openDemo(page, "?paused=1");
  const strength = page.getByLabel("Strength");
  const now = () => page.evaluate(() => window.dynaskinDemo?.avatar?.strength);
  await strength.focus();
  await page.keyboard.press("End");
  expect(await now()).toBe(4);
  await expect(page.locator("#strength output")).toHaveText("400 %");
  await page.keyboard.press("Home");
  expect(await now()).toBe(0);
  await strength.dblclick();
  expect(await now()).toBe(1);
});

test("the caption of the first view says what differs and how well, until it is closed", async ({
  reused: page,
}) => {
  await openDemo(page, "?paused=1&view=side&motion=jump&caption=1");
  const caption = page.locator("#caption");
  await expect(caption).toContainText("One motion, two skins.");
  const bundle = JSON.parse(
    readFileSync(join(ROOT, "models", "female", "bundle.json"), "utf8"),
  ) as { training: { frames: number } };
  await expect(caption).toContainText(`${bundle.training.frames.toLocaleString("en")} frames`);
  await expect(caption).toContainText(/0\.\d mm off in the soft regions, plain skinning \d\.\d mm/);
  await page.locator("#swap").click();
  await expect(caption).toContainText("two ways to move the skin");
  await page.getByRole("button", { name: "Close this caption" }).click();
  await expect(caption).toBeHidden();
  expect(page.url()).toContain("caption=0");
});

test("the picture is described by what it shows", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&view=side&motion=walk");
  const view = page.locator("#view");
  await expect(view).toHaveAttribute(
    "aria-label",
    /^Walk · female body, moved by: Linear skinning, dynaskin\./,
  );
  await page.getByLabel("First", { exact: true }).selectOption({ label: "Spring bones" });
  await expect(view).toHaveAttribute("aria-label", /Spring bones, dynaskin/);
});
