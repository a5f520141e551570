// The core's own tables stand in tests/golden/core-tables.json; crates/wasm/tests/tables.rs holds it to them.
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { JOINT_PARENTS } from "../dist/adapter/rig.js";
import { JOINT_NAMES, POSE_LENGTH, REGION_NAMES, SHAPE_LENGTH } from "../dist/index.js";

describe("the tables of the package", () => {
  const file = new URL("../../../tests/golden/core-tables.json", import.meta.url);
  const tables = JSON.parse(readFileSync(file, "utf8")) as Record<string, unknown>;

  it("are the core's", () => {
    expect({
      joints: JOINT_NAMES,
      parents: JOINT_PARENTS,
      regions: REGION_NAMES,
      pose_length: POSE_LENGTH,
      shape_length: SHAPE_LENGTH,
    }).toEqual(tables);
  });
});
