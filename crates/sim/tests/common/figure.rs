//! A body model small enough for a test: an ellipsoid trunk on a standing person's joints.
#![allow(dead_code, unreachable_pub, missing_docs)]

use std::f32::consts::{PI, TAU};

use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, REGION_COUNT, Region, SHAPE_COUNT, SkinWeights,
};
use glam::Vec3;

const RINGS: u32 = 16;
const SEGMENTS: u32 = 20;

/// Rest joints of a person of 1.6 m standing in an A-pose on y = 0.
fn joints_m() -> [Vec3; JOINT_COUNT] {
    let left = |x, y, z| Vec3::new(x, y, z);
    let of = |joint| match joint {
        Joint::Pelvis => left(0.0, 0.90, 0.0),
        Joint::LeftHip => left(0.09, 0.84, 0.0),
        Joint::Spine1 => left(0.0, 1.00, -0.01),
        Joint::LeftKnee => left(0.13, 0.46, 0.0),
        Joint::Spine2 => left(0.0, 1.12, -0.01),
        Joint::LeftAnkle => left(0.16, 0.08, -0.03),
        Joint::Spine3 => left(0.0, 1.2, -0.01),
        Joint::LeftFoot => left(0.18, 0.02, 0.09),
        Joint::Neck => left(0.0, 1.36, 0.0),
        Joint::LeftCollar => left(0.07, 1.3, 0.0),
        Joint::Head => left(0.0, 1.45, 0.02),
        Joint::LeftShoulder => left(0.16, 1.3, 0.0),
        Joint::LeftElbow => left(0.33, 1.12, 0.0),
        Joint::LeftWrist => left(0.48, 0.97, 0.08),
        Joint::LeftHand => left(0.53, 0.92, 0.11),
        _ => Vec3::ZERO,
    };
    std::array::from_fn(|index| {
        let joint = Joint::ALL[index];
        let here = of(joint);
        if here != Vec3::ZERO {
            here
        } else {
            of(joint.mirrored()) * Vec3::new(-1.0, 1.0, 1.0)
        }
    })
}

/// The figure: the first shape coefficient makes its trunk wider and its tissue deeper.
pub fn figure() -> BodyModel {
    let mut template_m = vec![Vec3::new(0.0, 1.45, 0.0), Vec3::new(0.0, 0.75, 0.0)];
    for ring in 1..RINGS {
        let polar = PI * ring as f32 / RINGS as f32;
        for segment in 0..SEGMENTS {
            let turn = TAU * segment as f32 / SEGMENTS as f32;
            template_m.push(Vec3::new(
                0.17 * polar.sin() * turn.cos(),
                1.1 + 0.35 * polar.cos(),
                0.13 * polar.sin() * turn.sin(),
            ));
        }
    }
    let at = |ring: u32, segment: u32| 2 + (ring - 1) * SEGMENTS + segment % SEGMENTS;
    let mut faces = Vec::new();
    for segment in 0..SEGMENTS {
        faces.push([0, at(1, segment + 1), at(1, segment)]);
        faces.push([1, at(RINGS - 1, segment), at(RINGS - 1, segment + 1)]);
        for ring in 1..RINGS - 1 {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    let count = template_m.len();
    let mut region_weights = vec![vec![0.0; count]; REGION_COUNT];
    for (vertex, p) in template_m.iter().enumerate() {
        let fade = |y: f32| (1.0 - (p.y - y).abs() / 0.12).clamp(0.0, 1.0);
        region_weights[Region::Chest as usize][vertex] = fade(1.24);
        region_weights[Region::Belly as usize][vertex] = fade(1.04).min(1.0 - fade(1.24));
    }
    let wider = template_m
        .iter()
        .map(|p| Vec3::new(p.x, 0.0, p.z) * 0.08)
        .collect();
    let still = vec![Vec3::ZERO; count];
    let mut shape_dirs_m = vec![wider];
    shape_dirs_m.resize(SHAPE_COUNT, still);
    let mut thickness_shape_dirs_m = vec![vec![0.006; count]];
    thickness_shape_dirs_m.resize(SHAPE_COUNT, vec![0.0; count]);
    BodyModel {
        name: "figure".to_owned(),
        copyright: String::new(),
        skin: template_m.iter().map(|p| skin_at(p.y)).collect(),
        template_m,
        faces,
        shape_dirs_m,
        pose_dirs_m: Vec::new(),
        joint_template_m: joints_m(),
        joint_shape_dirs_m: vec![[Vec3::ZERO; JOINT_COUNT]; SHAPE_COUNT],
        thickness_template_m: vec![0.04; count],
        thickness_shape_dirs_m,
        region_weights,
        colors_srgba: Vec::new(),
    }
}

/// Pelvis below, the lowest spine joint above, blended over 20 cm.
fn skin_at(y: f32) -> SkinWeights {
    let upper = ((y - 0.95) / 0.2).clamp(0.0, 1.0);
    let (first, second) = if upper > 0.5 { (3, 0) } else { (0, 3) };
    let most = upper.max(1.0 - upper);
    SkinWeights {
        joints: [first, second, 0, 0],
        weights: [most, 1.0 - most, 0.0, 0.0],
    }
}
