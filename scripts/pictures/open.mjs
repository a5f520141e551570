// The built demo as a browser shows it, ready for pictures.

/** The story's clock goes on by this much from picture to picture, so that the tissue swings as it does at 60 Hz. */
const TICK_SECONDS = 1 / 60;

/** Opens the demo at an address and waits until all of it is on the screen; `isStill`: in a page that does not play. */
export async function open(browser, url, query, viewport, isStill = false) {
  const page = await browser.newPage({
    viewport,
    reducedMotion: isStill ? "reduce" : "no-preference",
  });
  await page.goto(`${url}?resolution=full&${query}`);
  await page.waitForFunction(
    () =>
      window.dynaskinDemo?.ready && document.getElementById("loading").classList.contains("done"),
    null,
    { timeout: 600_000 },
  );
  // It fades, slowly where pictures are drawn in software.
  await page.addStyleTag({ content: ".loading { display: none !important }" });
  await page.waitForTimeout(1500);
  return page;
}

/** Goes on in the story by its own clock, draws, and waits until that is on the screen. */
export async function advance(page, seconds) {
  await page.evaluate(
    ([count, step]) => {
      for (let tick = 0; tick < count; tick += 1) window.dynaskinDemo.advanceStory(step);
      window.dynaskinDemo.draw();
      return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    },
    [Math.round(seconds / TICK_SECONDS), TICK_SECONDS],
  );
}
