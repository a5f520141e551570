//! Avatars that are skinned with dual quaternions: the skin is that of the equations, and everything in the rest
//! pose stays as with linear skinning. `web/sdk/tests/skinning.test.ts` compares the WebAssembly with the same file.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose};
use dynaskin_runtime::{Avatar, Crowd, Model, Skinning};
use glam::{DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use support::{SMALL, corrected_body_of, model_with, pose_at};

const DT: f64 = 1.0 / 60.0;
const SHAPE: [f32; 10] = [0.6, -0.4, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, -0.1, 0.3];
const SCALE: f64 = 1.7;

/// A pose whose joints are turned far, some by more than half a turn from the pelvis.
fn far_pose(phase: f64) -> Pose {
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(0.4, 0.2 * phase, -0.7);
    for joint in Joint::ALL {
        let at = f64::from(joint as u8) + phase;
        let axis = DVec3::new(at.sin(), 1.0, (2.0 * at).cos()).normalize();
        pose.parent_from_joint[joint as usize] =
            DQuat::from_axis_angle(axis, 2.4 * (1.3 * at).sin());
    }
    pose
}

/// The skin in the world by the equations in double precision: each joint's motion as a dual quaternion, their mean
/// on the side of the heaviest, and the rest positions in the avatar's size.
fn reference(avatar: &Avatar, pose: &Pose, scale: f64) -> Vec<Vec3> {
    let joints_m = avatar.joints_rest_m();
    let mut pose = pose.clone();
    // Translations of poses are in metres of the world.
    pose.root_translation_m /= scale;
    let world = pose.world_joints(joints_m);
    let motions: [(DQuat, DQuat); JOINT_COUNT] = std::array::from_fn(|joint| {
        let real = world.rotation[joint];
        let half = 0.5 * scale * (world.position_m[joint] - real * joints_m[joint].as_dvec3());
        (real, DQuat::from_xyzw(half.x, half.y, half.z, 0.0) * real)
    });
    let skin = &avatar.model().body().skin;
    let all = avatar.positions_rest_m().iter().zip(skin);
    all.map(|(rest, skin)| {
        let pivot = motions[usize::from(skin.joints[0])].0;
        let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let (mut real, mut dual) = (zero, zero);
        for (&joint, &weight) in skin.joints.iter().zip(&skin.weights) {
            let motion = motions[usize::from(joint)];
            let side = if motion.0.dot(pivot) < 0.0 { -1.0 } else { 1.0 };
            real += motion.0 * (side * f64::from(weight));
            dual += motion.1 * (side * f64::from(weight));
        }
        let reciprocal = real.length().recip();
        let (real, dual) = (real * reciprocal, dual * reciprocal);
        let moved = (dual * real.conjugate()) * 2.0;
        let turned = real * (scale * rest.as_dvec3());
        (turned + DVec3::new(moved.x, moved.y, moved.z)).as_vec3()
    })
    .collect()
}

fn worst_m(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn the_skin_is_that_of_the_equations_with_tissue_correctives_and_scale() {
    for scale in [1.0, 0.1, SCALE] {
        let model = model_with(SMALL, corrected_body_of(SMALL));
        let mut avatar = Avatar::new(model, &SHAPE).unwrap();
        assert_eq!(avatar.skinning(), Skinning::Linear);
        avatar.set_scale(scale).unwrap();
        avatar.set_skinning(Skinning::DualQuaternion);
        let mut largest_m = 0.0_f32;
        for tick in 0..60 {
            let pose = far_pose(0.02 * f64::from(tick));
            avatar.step(&pose, DT).unwrap();
            let expected = reference(&avatar, &pose, scale);
            let error_m = worst_m(&expected, avatar.skin().0);
            assert!(error_m <= 1e-5, "scale {scale}, tick {tick}: {error_m} m");
            let offsets = avatar.offsets_rest_m().iter();
            largest_m = offsets
                .map(|offset| offset.length())
                .fold(largest_m, f32::max);
        }
        assert!(largest_m > 1e-3, "no tissue moved: {largest_m} m");
    }
}

#[test]
fn it_may_be_switched_in_mid_motion_and_the_surface_at_rest_does_not_care() {
    let model = model_with(SMALL, corrected_body_of(SMALL));
    let mut linear = Avatar::new(Arc::clone(&model), &SHAPE).unwrap();
    let mut switched = Avatar::new(Arc::clone(&model), &SHAPE).unwrap();
    let mut crowd = Crowd::new(model).unwrap();
    for tick in 0..40 {
        let pose = far_pose(0.02 * f64::from(tick));
        let is_dual = tick % 4 > 1;
        switched.set_skinning(if is_dual {
            Skinning::DualQuaternion
        } else {
            Skinning::Linear
        });
        linear.step(&pose, DT).unwrap();
        crowd
            .step_all(&mut [&mut switched], &[pose], DT, &mut || 0.0)
            .unwrap();
        assert!(worst_m(linear.positions_rest_m(), switched.positions_rest_m()) < 1e-6);
        assert_eq!(linear.skin_matrices(), switched.skin_matrices());
        let apart_m = worst_m(linear.skin().0, switched.skin().0);
        assert_eq!(apart_m > 0.005, is_dual, "tick {tick}: {apart_m} m");
    }
    // The way of skinning is the host's, not the state's.
    let state = switched.save();
    linear.set_skinning(Skinning::DualQuaternion);
    switched.set_skinning(Skinning::Linear);
    linear.restore(&state).unwrap();
    assert_eq!(linear.skinning(), Skinning::DualQuaternion);
    assert!(worst_m(linear.skin().0, switched.skin().0) > 0.005);
}

#[test]
fn normals_turn_with_the_skin() {
    let model = model_with(SMALL, corrected_body_of(SMALL));
    let mut avatar = Avatar::new(model, &SHAPE).unwrap();
    avatar.set_skinning(Skinning::DualQuaternion);
    let mut pose = pose_at(0.4);
    // Where all joints are turned as one, the surface's own normals are known.
    pose.parent_from_joint[1..].fill(DQuat::IDENTITY);
    avatar.step(&pose, DT).unwrap();
    let turn = pose.parent_from_joint[0].as_quat();
    let expected: Vec<Vec3> = avatar
        .normals_rest()
        .iter()
        .map(|normal| turn * *normal)
        .collect();
    assert!(worst_m(&expected, avatar.skin().1) < 1e-5);
    avatar.step(&far_pose(0.3), DT).unwrap();
    let (_, normals) = avatar.skin();
    assert!(
        normals
            .iter()
            .all(|normal| (normal.length() - 1.0).abs() < 1e-5)
    );
}

/// What the WebAssembly is compared with.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Golden {
    shape: Vec<f32>,
    scale: f64,
    /// As JavaScript gives them: translation, then x, y, z, w of each joint.
    poses: Vec<Vec<f64>>,
    /// By the equations, `[pose][vertex][axis]` flattened, metres, rounded to 0.1 µm.
    skinned_m: Vec<Vec<f64>>,
}

const PHASES: [f64; 3] = [0.0, 0.9, 2.2];

impl Golden {
    fn of(body: BodyModel) -> Self {
        let model = Arc::new(Model::body_only(Arc::new(body)));
        let mut avatar = Avatar::new(model, &SHAPE).unwrap();
        avatar.set_scale(SCALE).unwrap();
        let poses = PHASES.map(far_pose);
        let skinned = poses.iter().map(|pose| {
            avatar.step(pose, DT).unwrap();
            let world_m = reference(&avatar, pose, SCALE);
            let numbers = world_m.iter().flat_map(|at| at.to_array());
            numbers
                .map(|x| (f64::from(x) * 1e7).round() / 1e7)
                .collect()
        });
        let numbers = |pose: &Pose| {
            let turns = pose.parent_from_joint.map(|turn| turn.to_array());
            let root = pose.root_translation_m.to_array();
            root.into_iter()
                .chain(turns.into_iter().flatten())
                .collect()
        };
        Self {
            shape: SHAPE.to_vec(),
            scale: SCALE,
            skinned_m: skinned.collect(),
            poses: poses.iter().map(numbers).collect(),
        }
    }
}

/// With `DYNASKIN_WRITE_GOLDEN=1` in the environment the file is written anew: after a change of the body's format,
/// and never to make a test pass.
#[test]
fn the_stored_skin_is_the_equations() {
    let file = |name: &str| {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../tests/golden/{name}"))
    };
    let glb = std::fs::read(file("pose-correctives.glb")).unwrap();
    let body = BodyModel::from_glb(&glb).unwrap();
    let json = file("dual-quaternions.json");
    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        let golden = serde_json::to_string(&Golden::of(body.clone())).unwrap() + "\n";
        std::fs::write(&json, golden).unwrap();
    }
    let stored: Golden = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((stored.scale, stored.poses.len()), (SCALE, PHASES.len()));
    let model = Arc::new(Model::body_only(Arc::new(body)));
    let mut avatar = Avatar::new(model, &stored.shape).unwrap();
    avatar.set_scale(SCALE).unwrap();
    avatar.set_skinning(Skinning::DualQuaternion);
    for (phase, stored) in PHASES.into_iter().zip(&stored.skinned_m) {
        avatar.step(&far_pose(phase), DT).unwrap();
        let skinned = avatar.skin().0.iter().flat_map(|at| at.to_array());
        let worst_m = skinned
            .zip(stored)
            .map(|(a, b)| (f64::from(a) - b).abs())
            .fold(0.0, f64::max);
        assert!(worst_m <= 1e-5, "{worst_m} m");
    }
}
