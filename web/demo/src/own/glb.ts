/** What the page asks of a GLB before three.js reads it. */
export interface GlbHeader {
  skins?: unknown[];
  extensionsRequired?: unknown[];
}

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const HEADER_BYTES = 20;

/** The JSON of a GLB or VRM; null for anything else. */
export async function readGlbHeader(file: Blob): Promise<GlbHeader | null> {
  const head = new DataView(await file.slice(0, HEADER_BYTES).arrayBuffer());
  if (head.byteLength < HEADER_BYTES || head.getUint32(0, true) !== MAGIC) return null;
  if (head.getUint32(16, true) !== JSON_CHUNK) return null;
  const end = HEADER_BYTES + head.getUint32(12, true);
  try {
    const json: unknown = JSON.parse(await file.slice(HEADER_BYTES, end).text());
    return typeof json === "object" ? (json as GlbHeader | null) : null;
  } catch {
    return null;
  }
}
