import { DynaSkinError } from "./error.js";

/**
 * Whether `integrity` is a hash as HTML writes it: `sha256-` and 32 bytes in base64.
 *
 * @internal
 */
export function isIntegrity(integrity: unknown): integrity is string {
  return typeof integrity === "string" && /^sha256-[A-Za-z0-9+/]{43}=$/.test(integrity);
}

/**
 * @throws DynaSkinError `bundle` where bundle.json has another hash, or where the page cannot compute
 *   one: browsers hash only in pages from https: or localhost.
 * @internal
 */
export async function checkIntegrity(bundle: Uint8Array, integrity: string): Promise<void> {
  const subtle = globalThis.crypto?.subtle;
  if (!subtle) {
    throw new DynaSkinError(
      "bundle",
      "integrity cannot be checked: browsers compute hashes only in pages from https: or localhost.",
    );
  }
  const hash = new Uint8Array(await subtle.digest("SHA-256", bundle as Uint8Array<ArrayBuffer>));
  const got = `sha256-${btoa(String.fromCharCode(...hash))}`;
  if (got === integrity) return;
  throw new DynaSkinError(
    "bundle",
    `bundle.json is not the one expected: its integrity is ${got}, expected ${integrity}.`,
  );
}
