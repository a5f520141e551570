//! Bodies with pose correctives: the surface is that of the papers' Eq. 2, and other bodies stay as
//! they were. `web/sdk/tests/pose-correctives.test.ts` compares the WebAssembly with the same file.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::PathBuf;
use std::sync::Arc;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, SkinMatrices};
use dynaskin_runtime::{Avatar, Crowd, Model};
use glam::{DMat3, Vec3};
use serde::{Deserialize, Serialize};
use support::{SMALL, corrected_body_of, model_with, numbers, pose_at};

const DT: f64 = 1.0 / 60.0;
const SHAPE: [f32; 10] = [0.6, -0.4, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, -0.1, 0.3];

/// The made-up body with correctives, as its file has them.
fn corrected() -> BodyModel {
    let body = corrected_body_of(SMALL);
    BodyModel::from_glb(&body.to_glb().unwrap()).unwrap()
}

/// The skin in the world by the equations, written out: template, shape, correctives, offsets, blend.
fn reference(body: &BodyModel, pose: &Pose, corrects: bool, offsets_m: &[Vec3]) -> Vec<Vec3> {
    let shaped = body.shaped(&SHAPE);
    let mut factors = Vec::new();
    for rotation in &pose.parent_from_joint[1..JOINT_COUNT] {
        let difference = (DMat3::from_quat(*rotation) - DMat3::IDENTITY).transpose();
        factors.extend(difference.to_cols_array());
    }
    let matrices = SkinMatrices::new(pose, &shaped.joints_m);
    (0..body.vertex_count())
        .map(|vertex| {
            let mut rest_m = shaped.positions_m[vertex].as_dvec3();
            if corrects {
                for (factor, dirs) in factors.iter().zip(&body.pose_dirs_m) {
                    rest_m += *factor * dirs[vertex].as_dvec3();
                }
            }
            let rest_m = rest_m.as_vec3() + offsets_m[vertex];
            matrices
                .blended(&body.skin[vertex])
                .transform_point3(rest_m)
        })
        .collect()
}

fn worst_m(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max)
}

#[test]
fn the_skin_is_that_of_the_equations_with_and_without_tissue() {
    let body = corrected();
    let models = [
        Arc::new(Model::body_only(Arc::new(body.clone()))),
        model_with(SMALL, body.clone()),
    ];
    for model in models {
        let mut avatar = Avatar::new(model, &SHAPE).unwrap();
        assert!(avatar.pose_correctives());
        let mut corrects = true;
        for tick in 0..90 {
            let pose = pose_at(f64::from(tick) * DT);
            if tick % 30 == 20 {
                corrects = !corrects;
                avatar.set_pose_correctives(corrects);
                assert_eq!(avatar.pose_correctives(), corrects);
            }
            avatar.step(&pose, DT).unwrap();
            let offsets_m = avatar.offsets_rest_m().to_vec();
            let expected = reference(&body, &pose, corrects, &offsets_m);
            let worst_m = worst_m(&expected, avatar.skin().0);
            assert!(worst_m <= 1e-5, "tick {tick}: {worst_m} m");
            let plain = reference(&body, &pose, false, &offsets_m);
            let moved = self::worst_m(&expected, &plain);
            assert_eq!(moved > 1e-3, corrects, "tick {tick}: {moved} m");
        }
    }
}

#[test]
fn normals_are_those_of_the_corrected_surface() {
    let body = corrected();
    let mut avatar = Avatar::new(model_with(SMALL, body.clone()), &SHAPE).unwrap();
    for tick in 0..20 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    let expected = dynaskin_body::vertex_normals(avatar.positions_rest_m(), &body.faces);
    assert!(worst_m(&expected, avatar.normals_rest()) < 1e-4);
}

#[test]
fn what_is_shown_follows_switches_shapes_and_pauses_at_once() {
    let body = corrected();
    let mut avatar = Avatar::new(model_with(SMALL, body.clone()), &[0.0; 10]).unwrap();
    let mut pose = Pose::REST;
    for tick in 0..20 {
        pose = pose_at(f64::from(tick) * DT);
        avatar.step(&pose, DT).unwrap();
    }
    let shows = |avatar: &mut Avatar, pose: &Pose, corrects: bool| {
        let offsets_m = avatar.offsets_rest_m().to_vec();
        let expected = reference(&body, pose, corrects, &offsets_m);
        let worst_m = worst_m(&expected, avatar.skin().0);
        assert!(worst_m <= 1e-5, "{worst_m} m");
    };
    avatar.set_shape(&SHAPE).unwrap();
    // Matrices follow with the next step, which may take no time.
    avatar.step(&pose, 0.0).unwrap();
    shows(&mut avatar, &pose, true);
    avatar.set_pose_correctives(false);
    shows(&mut avatar, &pose, false);
    avatar.set_pose_correctives(true);
    shows(&mut avatar, &pose, true);
    avatar.set_max_strain(Some(0.6)).unwrap();
    shows(&mut avatar, &pose, true);
    avatar.set_enabled(false);
    assert!(
        avatar
            .offsets_rest_m()
            .iter()
            .all(|offset| *offset == Vec3::ZERO)
    );
    shows(&mut avatar, &pose, true);
    let other = pose_at(0.7);
    avatar.step(&other, 0.0).unwrap();
    shows(&mut avatar, &other, true);
    // Out of sight the surface stays, and comes back with the pose.
    let before = avatar.positions_rest_m().to_vec();
    avatar.set_visible(false);
    avatar.step(&pose_at(0.9), DT).unwrap();
    assert_eq!(avatar.positions_rest_m(), before);
    avatar.set_visible(true);
    avatar.step(&pose, DT).unwrap();
    shows(&mut avatar, &pose, true);
}

#[test]
fn a_restored_avatar_and_one_of_a_crowd_show_the_same() {
    let model = model_with(SMALL, corrected());
    let mut avatar = Avatar::new(Arc::clone(&model), &SHAPE).unwrap();
    let mut member = Avatar::new(Arc::clone(&model), &SHAPE).unwrap();
    let mut crowd = Crowd::new(Arc::clone(&model)).unwrap();
    for tick in 0..30 {
        let pose = pose_at(f64::from(tick) * DT);
        avatar.step(&pose, DT).unwrap();
        crowd
            .step_all(&mut [&mut member], &[pose], DT, &mut || 0.0)
            .unwrap();
    }
    assert!(worst_m(avatar.positions_rest_m(), member.positions_rest_m()) < 1e-6);
    let mut again = Avatar::new(model, &[0.0; 10]).unwrap();
    again.restore(&avatar.save()).unwrap();
    assert_eq!(avatar.positions_rest_m(), again.positions_rest_m());
    assert_eq!(avatar.normals_rest(), again.normals_rest());
}

#[test]
fn offsets_of_the_host_are_shown_on_the_corrected_surface() {
    let body = corrected();
    let mut avatar =
        Avatar::new(Arc::new(Model::body_only(Arc::new(body.clone()))), &SHAPE).unwrap();
    let pose = pose_at(0.4);
    avatar.step(&pose, DT).unwrap();
    let offsets: Vec<f32> = numbers(3, 3 * body.vertex_count())
        .iter()
        .map(|number| 0.01 * number)
        .collect();
    avatar.show_offsets(&offsets).unwrap();
    let offsets_m: Vec<Vec3> = offsets
        .as_chunks::<3>()
        .0
        .iter()
        .map(|xyz| Vec3::from_array(*xyz))
        .collect();
    let expected = reference(&body, &pose, true, &offsets_m);
    assert!(worst_m(&expected, avatar.skin().0) <= 1e-5);
}

#[test]
fn a_body_without_them_has_none_to_switch() {
    let mut avatar = Avatar::new(support::model(), &SHAPE).unwrap();
    assert!(!avatar.pose_correctives());
    avatar.set_pose_correctives(true);
    assert!(!avatar.pose_correctives());
}

/// What the WebAssembly is compared with.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Golden {
    shape: Vec<f32>,
    /// As JavaScript gives them: translation, then x, y, z, w of each joint.
    poses: Vec<Vec<f64>>,
    /// By the equations, `[pose][vertex][axis]` flattened, metres, rounded to 0.1 µm.
    skinned_m: Vec<Vec<f64>>,
}

impl Golden {
    fn of(body: &BodyModel) -> Self {
        let poses: Vec<Pose> = [0.0, 0.31, 0.92].map(pose_at).to_vec();
        let still = vec![Vec3::ZERO; body.vertex_count()];
        let skinned = poses.iter().map(|pose| {
            let world_m = reference(body, pose, true, &still);
            let numbers = world_m.iter().flat_map(|at| at.to_array());
            numbers
                .map(|x| (f64::from(x) * 1e7).round() / 1e7)
                .collect()
        });
        let numbers = |pose: &Pose| {
            let turns = Joint::ALL.map(|joint| pose.parent_from_joint[joint as usize].to_array());
            let root = pose.root_translation_m.to_array();
            root.into_iter()
                .chain(turns.into_iter().flatten())
                .collect()
        };
        Self {
            shape: SHAPE.to_vec(),
            skinned_m: skinned.collect(),
            poses: poses.iter().map(numbers).collect(),
        }
    }
}

/// With `DYNASKIN_WRITE_GOLDEN=1` in the environment the files are written anew: after a change of the
/// body's format, and never to make a test pass.
#[test]
fn the_stored_body_and_its_skin_are_the_equations() {
    let file = |name: &str| {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../tests/golden/{name}"))
    };
    let (glb, json) = (file("pose-correctives.glb"), file("pose-correctives.json"));
    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        let body = corrected();
        std::fs::write(&glb, body.to_glb().unwrap()).unwrap();
        let golden = serde_json::to_string(&Golden::of(&body)).unwrap() + "\n";
        std::fs::write(&json, golden).unwrap();
    }
    let body = BodyModel::from_glb(&std::fs::read(&glb).unwrap()).unwrap();
    let stored: Golden = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let got = Golden::of(&body);
    assert_eq!(stored.poses.len(), got.poses.len());
    let mut avatar =
        Avatar::new(Arc::new(Model::body_only(Arc::new(body))), &stored.shape).unwrap();
    for (seconds, stored) in [0.0, 0.31, 0.92].into_iter().zip(&stored.skinned_m) {
        avatar.step(&pose_at(seconds), DT).unwrap();
        let skinned = avatar.skin().0.iter().flat_map(|at| at.to_array());
        let worst_m = skinned
            .zip(stored)
            .map(|(a, b)| (f64::from(a) - b).abs())
            .fold(0.0, f64::max);
        assert!(worst_m <= 1e-5, "{worst_m} m");
    }
}
