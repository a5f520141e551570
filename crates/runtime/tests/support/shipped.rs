//! The models in `models/`, and motions for them.

#![allow(dead_code)] // Each test file uses its own part.

use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_runtime::{Avatar, Model};
use glam::Vec3;

/// The shipped model of that name.
pub fn model(name: &str) -> Arc<Model> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../models")
        .join(name);
    let mut read = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let bundle = read("bundle.json").expect("the bundle");
    Arc::new(Model::load(&bundle, &mut read).expect("a shipped model loads"))
}

/// An avatar of average shape.
pub fn avatar(model: &Arc<Model>) -> Avatar {
    Avatar::new(Arc::clone(model), &[0.0; 10]).expect("the average shape is a shape")
}

/// Five seconds of a motion.
pub fn clip(kind: ProceduralKind, avatar: &Avatar) -> Clip {
    let mut motion = Procedural::new(kind);
    motion.duration_seconds = 5.0;
    motion
        .clip(avatar.joints_rest_m())
        .expect("a usual motion can be made")
}

/// Length of the longest offset, in metres.
pub fn largest(offsets_m: &[Vec3]) -> f32 {
    offsets_m.iter().map(|o| o.length()).fold(0.0, f32::max)
}

/// Largest difference of two surfaces, in metres.
pub fn distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}
