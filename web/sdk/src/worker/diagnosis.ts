// Why a worker's script did not run. Browsers fire an `error` event without a word; the reasons lie in the page.
import { DynaSkinError } from "../error.js";

/** A page that does not answer about itself must not keep an error waiting. */
const ASKING_MS = 2000;

/** Looks for the reasons, from before a worker is made until it answers. */
export class StartWatch {
  /** The address that the page's content security policy kept the worker from. */
  #forbidden: string | null = null;
  readonly #page = (globalThis as { document?: Document }).document;
  readonly #script: string | null;

  /** `script` is the worker's address, where the page named one. */
  constructor(script: string | null) {
    this.#script = script;
    this.#page?.addEventListener("securitypolicyviolation", this);
  }

  /** @internal */
  handleEvent({ effectiveDirective, blockedURI }: SecurityPolicyViolationEvent): void {
    if (effectiveDirective === "worker-src") this.#forbidden = blockedURI;
  }

  /** Ends the looking. */
  stop(): void {
    this.#page?.removeEventListener("securitypolicyviolation", this);
  }

  /** The error for a worker that never ran. */
  async explain(): Promise<DynaSkinError> {
    if (this.#forbidden !== null) {
      return notStarted(
        `The page's content security policy forbids it (${this.#forbidden}): worker-src must allow 'self', or ` +
          "blob: where the worker is made of a blob.",
      );
    }
    const script = this.#script === null ? null : await headersOf(this.#script);
    if (script && (!script.ok || isHtml(script.headers))) {
      return notStarted(
        `${this.#script} is not there: the server answered ${script.status}` +
          `${isHtml(script.headers) ? " and a web page" : ""}. Copy dynaskin/worker/thread to that place.`,
      );
    }
    const isIsolating = await this.#hasEmbedderPolicy();
    if (isIsolating && !(script && embedderPolicy(script.headers))) {
      return notStarted(
        "The page has the header Cross-Origin-Embedder-Policy, and browsers then want the same header on the answer " +
          "with the worker's script: let the server send it with JavaScript as well.",
      );
    }
    return notStarted(
      "The browser did not say why. Its script, or a file that it imports, was not found or is no JavaScript; the " +
        "bundler must have copied worker/thread.js.",
    );
  }

  /** An isolated page has the policy; another one may have it, too, which only its own headers tell. */
  async #hasEmbedderPolicy(): Promise<boolean> {
    if ((globalThis as { crossOriginIsolated?: boolean }).crossOriginIsolated) return true;
    const address = this.#page?.location?.href;
    const page = address === undefined ? null : await headersOf(address);
    return page !== null && embedderPolicy(page.headers);
  }
}

/** What the server says of a file; null where it cannot be asked. */
async function headersOf(address: string): Promise<Response | null> {
  try {
    return await fetch(address, { method: "HEAD", signal: AbortSignal.timeout(ASKING_MS) });
  } catch {
    return null;
  }
}

const isHtml = (headers: Headers) => /^text\/html\b/.test(headers.get("content-type") ?? "");
const embedderPolicy = (headers: Headers) =>
  /require-corp|credentialless/.test(headers.get("cross-origin-embedder-policy") ?? "");

function notStarted(why: string): DynaSkinError {
  return new DynaSkinError("worker", `The worker could not be started. ${why}`);
}
