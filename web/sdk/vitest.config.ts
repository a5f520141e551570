import { defineConfig } from "vitest/config";

export default defineConfig({
  // Hooks bind avatars, which a busy machine takes its time for. The tests import `dynaskin` by name: the package as it is built.
  test: { include: ["tests/**/*.test.ts"], testTimeout: 60_000, hookTimeout: 60_000 },
});
