// One visit of the built demo with an empty cache on a slow network.

/** Chromium's "Fast 4G": DevTools takes a tenth off the rates and adds latency for its own way there. */
const FAST_4G = {
  offline: false,
  latency: 60 * 2.75,
  downloadThroughput: ((9 * 1000 * 1000) / 8) * 0.9,
  uploadThroughput: ((1.5 * 1000 * 1000) / 8) * 0.9,
};
const VIEWPORT = { width: 1280, height: 720 };
const LIMIT_MS = 60_000;

/** Runs in the page before its own scripts: notes when what is waited for has come, in ms since the visit began. */
function watch() {
  const seen = { poster: null, moving: null, networks: null };
  window.firstViewSeen = seen;
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      if (entry.identifier === "poster") seen.poster ??= entry.renderTime || entry.loadTime;
    }
  }).observe({ type: "element", buffered: true });
  let last = null;
  const look = () => {
    const demo = window.dynaskinDemo;
    const now = demo?.timeSeconds ?? null;
    // What the last picture was of has been drawn by now.
    if (now !== null && last !== null && now > last && last > 0) {
      seen.moving ??= performance.now();
      // A build without a poster shows a body for the first time.
      seen.poster ??= seen.moving;
    }
    last = now;
    // A build with a baked loop says itself when that moves.
    const [mark] = performance.getEntriesByName("dynaskin: the body moves");
    if (mark) seen.moving = Math.min(seen.moving ?? mark.startTime, mark.startTime);
    if (demo?.ready) seen.networks ??= performance.now();
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

/**
 * When the poster was painted, the body moved and its networks were there, in seconds since the visit began (null:
 * not within a minute), and the bytes that came until then.
 *
 * @param {import("@playwright/test").Browser} browser
 * @param {string} address
 */
export async function measureFirstView(browser, address) {
  const context = await browser.newContext({ viewport: VIEWPORT });
  try {
    const page = await context.newPage();
    const session = await context.newCDPSession(page);
    await session.send("Network.enable");
    await session.send("Network.setCacheDisabled", { cacheDisabled: false });
    await session.send("Network.emulateNetworkConditions", FAST_4G);
    await page.addInitScript(watch);
    await page.goto(address, { waitUntil: "commit" });
    await page
      .waitForFunction(
        () => window.firstViewSeen?.networks !== null && window.firstViewSeen?.moving !== null,
        null,
        { timeout: LIMIT_MS },
      )
      .catch(() => {});
    const seen = await page.evaluate(() => window.firstViewSeen);
    const bytes = await page.evaluate(() =>
      ["navigation", "resource"]
        .flatMap((type) => performance.getEntriesByType(type))
        .reduce((sum, { transferSize }) => sum + transferSize, 0),
    );
    const asSeconds = (ms) => (ms === null ? null : ms / 1000);
    return {
      poster: asSeconds(seen.poster),
      moving: asSeconds(seen.moving),
      networks: asSeconds(seen.networks),
      bytes,
    };
  } finally {
    await context.close();
  }
}
