import { resolve } from "node:path";

/** The repository. */
export const ROOT = resolve(import.meta.dirname, "..", "..");
/** The first of the ports in a row that the tests serve on; another one where these are taken. */
const FIRST_PORT = Number(process.env.DYNASKIN_TEST_PORT ?? 5191);
/** The built demo page. */
export const DEMO_URL = `http://localhost:${FIRST_PORT}/`;
/** The repository's files as they lie; `/blank` is an empty page to import modules into. */
export const REPOSITORY_URL = `http://127.0.0.1:${FIRST_PORT + 1}`;
/** The built example pages. */
export const EXAMPLES_URL = `http://localhost:${FIRST_PORT + 2}/`;
/** The motion files beside the clone, which tests may use and must not need. */
export const SHARED = process.env.DYNASKIN_SHARED ?? resolve(ROOT, "..", "shared");
/** Where pictures for a person to look at go. */
export const PICTURES = resolve(ROOT, "test-results", "pictures");
