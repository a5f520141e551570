//! The tables that the TypeScript package repeats, in `tests/golden/core-tables.json`: the package's
//! tests hold its own to the same file (`web/sdk/tests/tables.test.ts`).

use dynaskin_body::{JOINT_COUNT, Joint, Region, SHAPE_COUNT};
use serde_json::{Value, json};

fn tables() -> Value {
    let parent = |joint: Joint| joint.parent().map_or(-1, |parent| parent as i64);
    json!({
        "joints": Joint::ALL.map(Joint::name),
        "parents": Joint::ALL.map(parent),
        "regions": Region::ALL.map(Region::name),
        // Translation, then a quaternion for each joint.
        "pose_length": 3 + 4 * JOINT_COUNT,
        "shape_length": SHAPE_COUNT,
    })
}

#[test]
fn the_tables_that_typescript_repeats_are_the_cores() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/golden/core-tables.json"
    );
    let file = std::fs::read(path).expect("core-tables.json");
    let file: Value = serde_json::from_slice(&file).expect("JSON");
    assert_eq!(file, tables(), "{path} should hold\n{:#}", tables());
}
