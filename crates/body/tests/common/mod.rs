//! Bodies for the tests.
#![allow(dead_code)]

use dynaskin_body::{BodyModel, JOINT_COUNT, SHAPE_COUNT, SkinWeights};
use glam::Vec3;

/// The committed bodies.
pub fn default_bodies() -> Vec<BodyModel> {
    ["female", "male"].map(|name| body(&glb(name))).to_vec()
}

pub fn body(glb: &[u8]) -> BodyModel {
    BodyModel::from_glb(glb).expect("the committed body is readable")
}

pub fn glb(name: &str) -> Vec<u8> {
    let path = format!(
        "{}/../../models/{name}/body.glb",
        env!("CARGO_MANIFEST_DIR")
    );
    std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A tetrahedron with every optional part, so that a file has a few kilobytes only.
pub fn tetrahedron() -> BodyModel {
    let template_m = vec![
        Vec3::new(0.0, 0.0, 0.0),
        Vec3::new(0.5, 0.0, 0.0),
        Vec3::new(0.0, 1.5, 0.0),
        Vec3::new(0.0, 0.0, 0.25),
    ];
    let count = template_m.len();
    let row = |x: f32| (0..count).map(|v| x * v as f32).collect::<Vec<f32>>();
    BodyModel {
        name: "tetrahedron".into(),
        copyright: "nobody's".into(),
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        shape_dirs_m: (0..SHAPE_COUNT)
            .map(|k| vec![Vec3::new(0.01, 0.002 * k as f32, -0.003); count])
            .collect(),
        pose_dirs_m: Vec::new(),
        joint_template_m: std::array::from_fn(|j| Vec3::new(0.0, 0.05 * j as f32, 0.01)),
        joint_shape_dirs_m: (0..SHAPE_COUNT)
            .map(|k| [Vec3::new(0.0, 0.001 * k as f32, 0.0); JOINT_COUNT])
            .collect(),
        skin: vec![
            SkinWeights {
                joints: [3, 1, 0, 0],
                weights: [0.75, 0.25, 0.0, 0.0],
            };
            count
        ],
        thickness_template_m: row(0.01),
        thickness_shape_dirs_m: (0..SHAPE_COUNT).map(|k| row(0.0002 * k as f32)).collect(),
        region_weights: (0..6).map(|_| row(0.05)).collect(),
        colors_srgba: vec![[200, 120, 40, 255]; count],
        template_m,
    }
}
