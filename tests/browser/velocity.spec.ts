// Motion vectors with tissue, with WebGL; three's WebGLRenderer has none.
import { test } from "@playwright/test";
import { expectVelocity } from "./velocity.js";

for (const way of ["DynaSkin", "DynaSkin on the card", "attributes", "texture"]) {
  test(`babylon, ${way}: motion vectors follow the tissue`, ({ page }) =>
    expectVelocity(page, "babylon", way, false));
}
