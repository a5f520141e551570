//! Fits of sequences whose truth is known.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::File;
use std::path::Path;

use common::{female, rest_mesh};
use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, Pose, Region, SHAPE_COUNT, SkinMatrices, skin_linear,
};
use dynaskin_fit::{
    Case, CheckOptions, FitError, FitOptions, FittedSequence, Joints, Objective, Rigidity,
    ScanOptions, ScanUnit, Scans, check_fit, fit_sequence,
};
use dynaskin_motion::{Amass, Procedural, ProceduralKind, UpAxis};
use dynaskin_sim::ClipData;
use glam::{DQuat, DVec3, Vec3};

const SHAPE: [f32; SHAPE_COUNT] = [1.2, -0.8, 0.5, 1.0, -0.4, 0.3, 0.0, -0.6, 0.2, 0.9];

/// Index of the region that is moved by hand.
const BELLY: usize = Region::Belly as usize;

/// A wild pose: every joint turned by up to 0.6 rad, the body turned about and lying aside.
fn wild_pose(seed: f64) -> Pose {
    let mut pose = Pose::REST;
    for joint in Joint::ALL {
        let k = joint as usize as f64 + seed;
        let axis = DVec3::new((k * 1.7).sin(), (k * 2.3).cos(), (k * 3.1).sin());
        let most = if joint == Joint::Pelvis { 4.0 } else { 0.6 };
        pose.parent_from_joint[joint as usize] =
            DQuat::from_scaled_axis(axis.normalize() * most * (k * 5.3).sin());
    }
    pose.root_translation_m = DVec3::new(3.0 * seed, 0.4, -2.0);
    pose
}

fn posed(body: &BodyModel, pose: &Pose, offsets_m: &[Vec3]) -> Vec<Vec3> {
    let shaped = body.shaped(&SHAPE);
    let mut rest_m = shaped.positions_m.clone();
    body.add_pose_correctives(pose, &mut rest_m);
    for (rest, offset) in rest_m.iter_mut().zip(offsets_m) {
        *rest += *offset;
    }
    let matrices = SkinMatrices::new(pose, &shaped.joints_m);
    let mut world_m = vec![Vec3::ZERO; rest_m.len()];
    skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
    world_m
}

fn scans(body: &BodyModel, frames: Vec<Vec<Vec3>>, rate_hz: f64) -> Scans<'_> {
    let options = ScanOptions {
        unit: Some(ScanUnit::Metre),
        up: Some(UpAxis::Y),
        rate_hz,
        key: String::new(),
        sequence: None,
    };
    Scans::new(Path::new("truth"), body, frames.concat(), &options).unwrap()
}

#[track_caller]
fn check_pose(got: &Pose, expected: &Pose, angle_degrees: f64) {
    let distance_m = got.root_translation_m.distance(expected.root_translation_m);
    assert!(distance_m < 1e-3, "root {distance_m} m off");
    for joint in Joint::ALL {
        let (a, b) = (
            got.parent_from_joint[joint as usize],
            expected.parent_from_joint[joint as usize],
        );
        let angle = a.angle_between(b).to_degrees();
        assert!(angle < angle_degrees, "{}: {angle}°", joint.name());
    }
}

fn largest_mm(offsets_m: &[Vec3], expected_m: &[Vec3]) -> f32 {
    offsets_m
        .iter()
        .zip(expected_m)
        .map(|(a, b)| 1e3 * a.distance(*b))
        .fold(0.0, f32::max)
}

#[test]
fn wild_poses_are_found_without_a_pose_before_them() {
    let body = female();
    let none = vec![Vec3::ZERO; body.vertex_count()];
    // Each frame is another pose: no frame helps the next one.
    let poses = [0.3, 1.4, 2.2, 5.1].map(wild_pose);
    let frames = poses.iter().map(|pose| posed(&body, pose, &none)).collect();
    let scans = scans(&body, frames, 60.0);
    for objective in [Objective::Unposed, Objective::Posed] {
        let options = FitOptions {
            objective,
            ..FitOptions::for_body(&body)
        };
        let fitted = fit_sequence(&body, &scans, &options, |_| {}).unwrap();
        for (got, expected) in fitted.shape.iter().zip(SHAPE) {
            assert!(
                (got - expected).abs() < 0.02,
                "{objective:?} {:?}",
                fitted.shape
            );
        }
        for (frame, pose) in fitted.frames.iter().zip(&poses) {
            check_pose(&frame.pose, pose, 0.2);
            assert!(largest_mm(&frame.offsets_rest_m, &none) < 0.5);
        }
    }
}

#[test]
fn stray_vertices_pull_at_nothing_but_themselves() {
    let body = female();
    let none = vec![Vec3::ZERO; body.vertex_count()];
    let pose = wild_pose(0.7);
    let mut mesh = posed(&body, &pose, &none);
    for vertex in (0..body.vertex_count()).step_by(97) {
        mesh[vertex] += Vec3::new(0.3, -0.5, 0.8);
    }
    let options = FitOptions::for_body(&body);
    let fitted = fit_sequence(&body, &scans(&body, vec![mesh], 60.0), &options, |_| {}).unwrap();
    check_pose(&fitted.frames[0].pose, &pose, 1.0);
}

/// Hops with tissue that swings, through the simulator: the whole way as `dynaskin fit-check` goes.
#[test]
fn soft_tissue_of_a_hop_is_recovered() {
    let body = female();
    let joints_m = body.shaped(&SHAPE).joints_m;
    let mut motion = Procedural::new(ProceduralKind::Hop)
        .clip(&joints_m)
        .unwrap();
    // The second landing.
    motion.frames.drain(..75);
    motion.frames.truncate(12);
    let options = CheckOptions {
        shape: SHAPE,
        cases: vec![Case::Dynamic, Case::Noise],
        objectives: vec![Objective::Unposed],
        joints: vec![Joints::Fitted],
        joint_shift_m: 0.01,
        rigidity: Rigidity::Body,
        seed: 3,
    };
    let reports = check_fit(&body, &motion, &options, |_, _, _| {}).unwrap();
    let [clean, noisy] = &reports[..] else {
        panic!("two cases give two reports");
    };
    assert!(
        clean.true_soft_offset_mm > 2.0,
        "{}",
        clean.true_soft_offset_mm
    );
    assert!(
        clean.angle_median_degrees < 0.5,
        "{}",
        clean.angle_median_degrees
    );
    assert!(clean.offset_mm < 0.5, "{}", clean.offset_mm);
    assert!(clean.shape_rms < 0.1, "{}", clean.shape_rms);
    assert!(
        noisy.angle_median_degrees < 1.0,
        "{}",
        noisy.angle_median_degrees
    );
    // The noise itself is 1.6 mm long on average.
    assert!(noisy.offset_mm < 2.5, "{}", noisy.offset_mm);
}

/// Joints that lie aside from where β puts them.
fn aside_m() -> [Vec3; JOINT_COUNT] {
    std::array::from_fn(|joint| {
        let k = joint as f32;
        let direction = Vec3::new((k * 2.0).sin(), (k * 1.4).cos(), (k * 0.6).sin());
        match joint {
            // The root's translation makes up for the pelvis.
            0 => Vec3::ZERO,
            _ => 0.01 * direction.normalize(),
        }
    })
}

#[test]
fn joints_are_found_where_they_bend() {
    finds_joints(&female(), 20);
}

#[test]
fn joints_are_found_under_pose_correctives() {
    finds_joints(&with_smooth_correctives(female()), 10);
}

/// Fits so many poses with joints 1 cm aside.
fn finds_joints(body: &BodyModel, count: u32) {
    let mut shaped = body.shaped(&SHAPE);
    for (joint_m, aside_m) in shaped.joints_m.iter_mut().zip(aside_m()) {
        *joint_m += aside_m;
    }
    let poses: Vec<Pose> = std::iter::once(Pose::REST)
        .chain((1..count).map(|k| wild_pose(0.37 * f64::from(k))))
        .collect();
    let mut frames = Vec::new();
    for pose in &poses {
        let matrices = SkinMatrices::new(pose, &shaped.joints_m);
        let mut rest_m = shaped.positions_m.clone();
        body.add_pose_correctives(pose, &mut rest_m);
        let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
        skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
        frames.push(world_m);
    }
    let scans = scans(body, frames, 60.0);
    let fit = |joints| {
        let options = FitOptions {
            joints,
            ..FitOptions::for_body(body)
        };
        fit_sequence(body, &scans, &options, |_| {}).unwrap()
    };
    let largest_mm = |fitted: &FittedSequence| {
        let offsets = fitted.frames.iter().flat_map(|frame| &frame.offsets_rest_m);
        1e3 * offsets.map(|offset| offset.length()).fold(0.0, f32::max)
    };
    let fitted = fit(Joints::Fitted);
    let by_shape_m = body.shaped(&fitted.shape).joints_m;
    let errors_mm: Vec<f32> = (1..JOINT_COUNT)
        .map(|joint| {
            let place_m = by_shape_m[joint] + fitted.joint_offsets_m[joint];
            1e3 * place_m.distance(shaped.joints_m[joint])
        })
        .collect();
    // Of 10 mm. Collars, which carry little skin of their own, keep most.
    let mean_mm = errors_mm.iter().sum::<f32>() / errors_mm.len() as f32;
    assert!(mean_mm < 3.0, "{errors_mm:?}");
    assert!(errors_mm.iter().all(|mm| *mm < 6.0), "{errors_mm:?}");
    for (frame, pose) in fitted.frames.iter().zip(&poses) {
        check_pose(&frame.pose, pose, 2.0);
    }
    let (found_mm, body_mm) = (largest_mm(&fitted), largest_mm(&fit(Joints::Body)));
    assert!(found_mm < 0.5 * body_mm, "{found_mm} {body_mm}");
    // Given, they are as good, and nothing is fitted.
    let given = fit(Joints::Given(fitted.joint_offsets_m));
    assert_eq!(given.joint_offsets_m, fitted.joint_offsets_m);
    assert!(largest_mm(&given) < 0.5 * body_mm);
}

/// A body whose surface is corrected by the pose, as SMPL's is.
fn with_correctives(mut body: BodyModel) -> BodyModel {
    body.pose_dirs_m = (0..9 * (JOINT_COUNT - 1))
        .map(|row| {
            (0..body.vertex_count())
                .map(|vertex| {
                    let k = (row * 31 + vertex * 7) as f32;
                    let near = body.skin[vertex].joints[0] as usize == 1 + row / 9;
                    let size_m = if near { 0.01 } else { 0.0 };
                    Vec3::new(k.sin(), (k * 1.3).cos(), (k * 0.7).sin()) * size_m
                })
                .collect()
        })
        .collect();
    body
}

/// Correctives that swell the skin around each joint as a whole, so that they look like turns of bones.
fn with_smooth_correctives(mut body: BodyModel) -> BodyModel {
    body.pose_dirs_m = (0..9 * (JOINT_COUNT - 1))
        .map(|row| {
            let joint_m = body.joint_template_m[1 + row / 9];
            let phase = row as f32 * 2.4;
            let direction = Vec3::new(phase.sin(), (phase + 1.0).sin(), (phase + 2.0).sin());
            let places = body.template_m.iter();
            places
                .map(|place_m| {
                    let share = (-(place_m.distance(joint_m) / 0.1).powi(2)).exp();
                    0.006 * share * direction
                })
                .collect()
        })
        .collect();
    body
}

#[test]
fn pose_correctives_are_taken_off() {
    let body = with_correctives(female());
    let none = vec![Vec3::ZERO; body.vertex_count()];
    let pose = wild_pose(0.2);
    let frames = vec![posed(&body, &pose, &none)];
    let options = FitOptions {
        shape: Some(SHAPE),
        ..FitOptions::for_body(&body)
    };
    let fitted = fit_sequence(&body, &scans(&body, frames, 60.0), &options, |_| {}).unwrap();
    check_pose(&fitted.frames[0].pose, &pose, 0.05);
    assert!(largest_mm(&fitted.frames[0].offsets_rest_m, &none) < 0.1);
}

#[test]
fn rigidity_is_learned_where_the_body_tells_none() {
    let soft = female();
    let mut body = female();
    body.region_weights.clear();
    let poses: Vec<Pose> = (0..5).map(|k| wild_pose(0.1 * f64::from(k))).collect();
    // Every region swings in its own time.
    let offsets: Vec<Vec<Vec3>> = (0..5)
        .map(|k| {
            let swing = |region: usize| 0.02 * (k as f32 * 1.9 + region as f32 * 2.3).sin();
            (0..body.vertex_count())
                .map(|vertex| {
                    let weights = soft.region_weights.iter().enumerate();
                    Vec3::Y * weights.map(|(r, w)| swing(r) * w[vertex]).sum::<f32>()
                })
                .collect()
        })
        .collect();
    let frames = poses.iter().zip(&offsets);
    let frames = frames
        .map(|(pose, offsets)| posed(&body, pose, offsets))
        .collect();
    let options = FitOptions {
        shape: Some(SHAPE),
        ..FitOptions::for_body(&body)
    };
    assert_eq!(options.rigidity, Rigidity::Data);
    let fitted = fit_sequence(&body, &scans(&body, frames, 60.0), &options, |_| {}).unwrap();
    let mut sum_mm = 0.0;
    for (frame, offsets) in fitted.frames.iter().zip(&offsets) {
        let errors = frame.offsets_rest_m.iter().zip(offsets);
        sum_mm += 1e3 * errors.map(|(a, b)| a.distance(*b)).sum::<f32>();
    }
    let mean_mm = sum_mm / (5 * body.vertex_count()) as f32;
    assert!(mean_mm < 1.0, "{mean_mm}");
    let mean = |wanted: fn(f32) -> bool| {
        let chosen: Vec<f64> = (0..body.vertex_count())
            .filter(|&vertex| wanted(soft.softness(vertex)))
            .map(|vertex| fitted.rigidity[vertex])
            .collect();
        chosen.iter().sum::<f64>() / chosen.len() as f64
    };
    let (rigid, moving) = (mean(|s| s < 0.01), mean(|s| s > 0.9));
    assert!(rigid > 0.5 && moving < 0.1 * rigid, "{rigid} {moving}");
}

fn two_frames(body: &BodyModel, rate_hz: f64) -> (Vec<Pose>, FittedSequence) {
    let offsets: Vec<Vec3> = (0..body.vertex_count())
        .map(|vertex| Vec3::Z * 0.01 * body.region_weights[BELLY][vertex])
        .collect();
    let none = vec![Vec3::ZERO; body.vertex_count()];
    let poses = vec![Pose::REST, wild_pose(0.05)];
    let frames = vec![
        posed(body, &poses[0], &none),
        posed(body, &poses[1], &offsets),
    ];
    let options = FitOptions::for_body(body);
    let fitted = fit_sequence(body, &scans(body, frames, rate_hz), &options, |_| {}).unwrap();
    (poses, fitted)
}

#[test]
fn a_fit_is_read_as_a_motion_and_as_a_clip_for_training() {
    let body = female();
    let (poses, fitted) = two_frames(&body, 30.0);
    let folder = tempfile::tempdir().unwrap();
    let npz = folder.path().join("fit.npz");
    fitted.write_npz(&npz).unwrap();
    let file = Amass::read(File::open(&npz).unwrap()).unwrap();
    assert_eq!((file.rate_hz, file.up), (30.0, UpAxis::Y));
    let clip = file.clip(&body.shaped(&fitted.shape).joints_m);
    // The fit's own place, not another floor.
    for (got, expected) in clip.frames.iter().zip(&poses) {
        check_pose(got, expected, 1.0);
    }

    // At 60 Hz: a frame between the two, with half of the offset.
    let path = folder.path().join("wild__me.safetensors");
    let data = fitted
        .clip_data(&body, &"0".repeat(64), "wild__me")
        .unwrap();
    data.write(&path).unwrap();
    let data = ClipData::read(&path).unwrap();
    assert_eq!((data.frame_count(), data.rate_hz), (3, 60.0));
    let slot = (0..data.vertices.len())
        .find(|&slot| body.region_weights[BELLY][data.vertices[slot] as usize] > 0.99)
        .unwrap();
    for (frame, expected_m) in [(0, 0.0), (1, 0.005), (2, 0.01)] {
        let offset = data.offset_rest_m(frame, slot);
        assert!(
            (offset - Vec3::Z * expected_m).length() < 1e-3,
            "{frame}: {offset}"
        );
    }
}

#[test]
fn offsets_can_count_from_the_subjects_own_surface() {
    let body = female();
    // A nose that no shape coefficient makes: it is there in every frame.
    let own: Vec<Vec3> = rest_mesh(&body)
        .iter()
        .map(|p| Vec3::Z * 0.01 * (1.0 - 8.0 * p.distance(Vec3::new(0.0, 1.0, 0.1))).max(0.0))
        .collect();
    let frames: Vec<_> = [Pose::REST, wild_pose(0.02)]
        .iter()
        .map(|pose| posed(&body, pose, &own))
        .collect();
    let scans = scans(&body, frames, 60.0);
    let largest = |own_surface| {
        let options = FitOptions {
            own_surface,
            ..FitOptions::for_body(&body)
        };
        let fitted = fit_sequence(&body, &scans, &options, |_| {}).unwrap();
        largest_mm(
            &fitted.frames[1].offsets_rest_m,
            &vec![Vec3::ZERO; own.len()],
        )
    };
    assert!(largest(false) > 5.0);
    assert!(largest(true) < 1.0);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let body = female();
    let mesh = rest_mesh(&body);
    let one = |mesh: Vec<Vec3>| scans(&body, vec![mesh], 60.0);
    let usual = FitOptions::for_body(&body);
    // The right number of vertices in another order.
    let shuffled: Vec<Vec3> = (0..mesh.len()).map(|i| mesh[i * 13 % mesh.len()]).collect();
    let error = fit_sequence(&body, &one(shuffled), &usual, |_| {}).unwrap_err();
    assert!(matches!(error, FitError::NoFit { frame: 0, .. }), "{error}");
    let refusals = [
        FitOptions {
            shape: Some([f32::NAN; SHAPE_COUNT]),
            ..usual.clone()
        },
        FitOptions {
            joints: Joints::Given([Vec3::splat(f32::NAN); JOINT_COUNT]),
            ..usual.clone()
        },
        FitOptions {
            rigidity: Rigidity::Given(vec![1.0; 3]),
            ..usual.clone()
        },
        FitOptions {
            rigidity: Rigidity::Given(vec![0.0; mesh.len()]),
            ..usual.clone()
        },
    ];
    for options in refusals {
        let error = fit_sequence(&body, &one(mesh.clone()), &options, |_| {}).unwrap_err();
        assert!(matches!(error, FitError::Parameter { .. }), "{error}");
    }
    let mut bare = female();
    bare.region_weights.clear();
    let options = FitOptions {
        rigidity: Rigidity::Body,
        ..usual
    };
    let error = fit_sequence(&bare, &one(mesh), &options, |_| {}).unwrap_err();
    assert!(error.to_string().contains("--rigidity data"), "{error}");
}
