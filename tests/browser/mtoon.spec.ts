// Materials of three-vrm, with WebGLRenderer.
import { test } from "@playwright/test";
import { expectMToon } from "./mtoon.js";

test("MToon and its outlines take the tissue", ({ page }) => expectMToon(page, false));
