/** Timings of so many files are kept: the page's own, both bodies' and every method's. */
const FILES = 1000;

performance.setResourceTimingBufferSize(FILES);

/**
 * Kilobytes of everything that the page has fetched so far, itself included: as it was sent, and as the
 * page uses it where the server packs.
 */
export function downloadFacts(): [name: string, value: string][] {
  const entries = [
    ...performance.getEntriesByType("navigation"),
    ...performance.getEntriesByType("resource"),
  ] as PerformanceResourceTiming[];
  const kilobytes = (size: (entry: PerformanceResourceTiming) => number) => {
    const bytes = entries.reduce((sum, entry) => sum + size(entry), 0);
    return `${Math.round(bytes / 1000).toLocaleString("en")} KB`;
  };
  return [
    ["downloads", kilobytes(({ encodedBodySize }) => encodedBodySize)],
    ["unpacked", kilobytes(({ decodedBodySize }) => decodedBodySize)],
  ];
}
