//! Small bodies and data for the tests.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, REGION_COUNT, SHAPE_COUNT, SkinWeights};
use glam::Vec3;

/// A stick body with symmetric joints and `pairs` pairs of skin vertices, all belly.
pub fn symmetric_body(pairs: usize) -> BodyModel {
    let mut joint_template_m = [Vec3::ZERO; JOINT_COUNT];
    for joint in Joint::ALL {
        let side = if joint.mirrored() == joint {
            0.0
        } else if joint.name().starts_with("left") {
            0.12
        } else {
            -0.12
        };
        let depth = std::iter::successors(joint.parent(), |j| j.parent()).count();
        let up = if joint.name().contains("hip") || joint.name().contains("knee") {
            -1.0
        } else {
            1.0
        };
        joint_template_m[joint as usize] = Vec3::new(side, 1.0 + up * 0.1 * depth as f32, 0.0);
    }
    let template_m: Vec<Vec3> = (0..2 * pairs)
        .map(|i| {
            let side = if i % 2 == 0 { 0.1 } else { -0.1 };
            Vec3::new(side, 1.0 + 0.03 * (i / 2) as f32, 0.1)
        })
        .collect();
    let count = template_m.len();
    let mut region_weights = vec![vec![0.0; count]; REGION_COUNT];
    region_weights[1] = vec![1.0; count];
    BodyModel {
        name: "sticks".into(),
        copyright: String::new(),
        shape_dirs_m: vec![vec![Vec3::ZERO; count]; SHAPE_COUNT],
        joint_shape_dirs_m: vec![[Vec3::ZERO; JOINT_COUNT]; SHAPE_COUNT],
        faces: Vec::new(),
        pose_dirs_m: Vec::new(),
        joint_template_m,
        skin: vec![
            SkinWeights {
                joints: [0; 4],
                weights: [1.0, 0.0, 0.0, 0.0],
            };
            count
        ],
        thickness_template_m: vec![0.03; count],
        thickness_shape_dirs_m: vec![vec![0.0; count]; SHAPE_COUNT],
        region_weights,
        colors_srgba: Vec::new(),
        template_m,
    }
}
