//! What the tests of this crate share.

use std::fs;
use std::path::Path;

use dynaskin_body::{BodyModel, SHAPE_COUNT};
use glam::Vec3;

/// The shipped female body.
pub fn female() -> BodyModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb");
    BodyModel::from_glb(&fs::read(path).unwrap()).unwrap()
}

/// Its surface at rest, in metres.
pub fn rest_mesh(body: &BodyModel) -> Vec<Vec3> {
    body.shaped(&[0.0; SHAPE_COUNT]).positions_m
}
