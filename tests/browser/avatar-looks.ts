import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** An engine with one of its renderers. */
export interface Stage {
  engine: "three" | "babylon";
  webgpu: boolean;
}

interface Difference {
  moved: number;
  wrong: number;
}

/** What `compareLooks` in avatar/looks.js gives. */
interface Looks {
  looks: Record<string, Difference>;
  pick: Difference & { hit: number };
  pictures: Record<string, string>;
}

interface Clones extends Difference {
  firstIsLeft: number;
  secondIsLeft: number;
  pictures: Record<string, string>;
}

interface Refusals {
  said: Record<string, string>;
  left: number;
  isSameGeometry: boolean;
}

/** Opens a page of an engine; gives what calls a function of `avatar/looks.js`, and the page's errors. */
async function open(page: Page, { engine, webgpu }: Stage) {
  const problems = await openModules(page, "avatar-looks");
  const address = `/tests/browser/avatar/looks-${engine}.js`;
  await page.evaluate(
    async ([module, name, gpu]) => {
      const looks = await import(location.origin + module);
      await (name === "three" ? looks.startThree(gpu) : looks.startBabylon(gpu));
    },
    [address, engine, webgpu] as const,
  );
  const call = (name: string, ...args: unknown[]): Promise<unknown> =>
    page.evaluate(
      async ([module, fn, values]) => (await import(location.origin + module))[fn](...values),
      [address, name, args] as const,
    );
  return { problems, call };
}

function keep({ engine, webgpu }: Stage, pictures: Record<string, string>): void {
  mkdirSync(PICTURES, { recursive: true });
  for (const [name, url] of Object.entries(pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    const file = `avatar-${engine}-${webgpu ? "webgpu" : "webgl"}-${name}.png`;
    writeFileSync(join(PICTURES, file), png);
  }
}

const percent = (share: number) => `${(share * 100).toFixed(2)} %`;

/** Surface, outline, shadow, morph targets and rays take the tissue, and nothing else. */
export async function expectLooks(page: Page, stage: Stage): Promise<void> {
  const { problems, call } = await open(page, stage);
  const { looks, pick, pictures } = (await call("compareLooks")) as Looks;
  keep(stage, pictures);
  for (const [look, { moved, wrong }] of Object.entries(looks)) {
    console.log(`${look}: ${percent(moved)} differ from plain, ${percent(wrong)} are wrong`);
  }
  console.log(`rays: ${pick.hit} hit, to ${pick.moved} m from plain, ${pick.wrong} m are wrong`);
  expect(problems).toEqual([]);
  for (const [look, { moved, wrong }] of Object.entries(looks)) {
    expect(moved, look).toBeGreaterThan(0.002);
    expect(wrong, look).toBeLessThan(0.0002);
  }
  expect(pick.hit).toBeGreaterThan(100);
  expect(pick.moved).toBeGreaterThan(0.003);
  expect(pick.wrong).toBeLessThan(1e-5);
}

/** Clones move by themselves. */
export async function expectClones(page: Page, stage: Stage): Promise<void> {
  const { problems, call } = await open(page, stage);
  const clones = (await call("compareClones")) as Clones;
  keep(stage, clones.pictures);
  expect(problems).toEqual([]);
  expect(clones.firstIsLeft).toBe(0);
  expect(clones.moved).toBeGreaterThan(0.002);
  expect(clones.wrong).toBeLessThan(0.0002);
  expect(clones.secondIsLeft).toBe(0);
}

interface Writes {
  looks: Record<string, Difference & { left: number }>;
  clone: Difference & { firstIsPlain: number; again: number; shadowAgain: number };
  notes: string[];
  isUntouched: boolean;
  isGivenBack: boolean;
  counts: unknown[];
  pictures: Record<string, string>;
}

/** The vertex stage shows what attributes show, gives everything back, and clones keep apart. */
export async function expectWrites(page: Page, stage: Stage): Promise<void> {
  const { problems, call } = await open(page, stage);
  const { looks, clone, notes, pictures, ...rest } = (await call("compareWrites")) as Writes;
  keep(stage, pictures);
  console.log(JSON.stringify({ looks, clone, ...rest }));
  expect(problems).toEqual([]);
  for (const [look, { moved, wrong, left }] of Object.entries(looks)) {
    expect(moved, look).toBeGreaterThan(0.002);
    expect(wrong, look).toBeLessThan(0.0002);
    expect(left, look).toBe(0);
  }
  expect(clone.moved).toBeGreaterThan(0.002);
  expect(clone.wrong).toBeLessThan(0.0002);
  expect(clone.firstIsPlain).toBeLessThan(0.0002);
  expect(clone.again).toBeLessThan(0.0002);
  expect(clone.shadowAgain).toBeLessThan(0.0002);
  expect(notes.join(" ")).toMatch(/Rays|Picking/);
  expect(rest.isUntouched).toBe(true);
  expect(rest.isGivenBack).toBe(true);
  expect(rest.counts[1]).toEqual(rest.counts[0]);
}

/** What a vertex stage cannot draw is refused with a sentence, and nothing changes. */
export async function expectRefusedWrites(page: Page, stage: Stage): Promise<void> {
  const { problems, call } = await open(page, stage);
  const { said, isSame } = (await call("refuseWrites")) as {
    said: Record<string, string>;
    isSame: boolean;
  };
  expect(problems).toEqual([]);
  if (stage.webgpu) {
    expect(said.renderer).toMatch(/^argument: .*Leave write out/);
  } else {
    expect(said.way).toMatch(/^argument: .*"attributes" or "texture"/);
    expect(said.shader).toMatch(/^argument: .*own.*ShaderMaterial.*exclude it/);
    expect(said.later).toMatch(/^argument: .*own.*ShaderMaterial/);
  }
  expect(isSame).toBe(true);
}

/** What cannot be bound or played is refused with a sentence, and nothing changes. */
export async function expectRefusals(page: Page, stage: Stage): Promise<void> {
  const { problems, call } = await open(page, stage);
  const { said, left, isSameGeometry } = (await call("refuse")) as Refusals;
  expect(problems).toEqual([]);
  expect(said.undeclared).toMatch(/^adult: .*depicts/);
  expect(said.bones).toMatch(/^humanoid: .*x/);
  expect(said.child).toMatch(/^adult: .*m tall/);
  expect(said.another).toMatch(/^binding: .*Bind this avatar again/);
  expect(said.numbers).toMatch(/^avatar: .*vertex 2.* no usable number/);
  expect(left).toBe(0);
  expect(isSameGeometry).toBe(true);
}

/** Cycles in one call of the page. */
const BATCH = 20;
/** JavaScript's own caches fill for some hundred cycles, and later shrink again. */
const SETTLING = 100;
const CYCLES = 200;
/** JavaScript's own caches and compiled code may grow by so much in 200 cycles. */
const MOST_HEAP_GROWTH = 2 ** 20;

/** Binding or reading what was bound, playing and disposing 200 times leaves nothing behind. */
export async function expectFlatMemory(page: Page, stage: Stage, binds: boolean): Promise<void> {
  const { problems, call } = await open(page, stage);
  const session = await page.context().newCDPSession(page);
  const heap = async () => {
    await session.send("HeapProfiler.collectGarbage");
    const { usedSize } = (await session.send("Runtime.getHeapUsage")) as { usedSize: number };
    return usedSize;
  };
  const start = performance.now();
  const cycles = async (count: number) => {
    let left: unknown;
    for (let done = 0; done < count; done += BATCH) left = await call("cycle", BATCH, binds);
    return left;
  };
  const before = await cycles(SETTLING);
  const heapBefore = await heap();
  const after = await cycles(CYCLES);
  const grown = (await heap()) - heapBefore;
  const seconds = ((performance.now() - start) / 1000).toFixed(0);
  console.log(`${CYCLES} cycles in ${seconds} s: ${JSON.stringify(after)}, heap + ${grown} bytes`);
  expect(problems).toEqual([]);
  expect(after).toEqual(before);
  expect(grown).toBeLessThan(MOST_HEAP_GROWTH);
}
