import { defineConfig } from "vitest/config";

export default defineConfig({
  // The tests import `dynaskin` by name: the package as it is built.
  test: { include: ["tests/**/*.test.ts"], testTimeout: 60_000 },
});
