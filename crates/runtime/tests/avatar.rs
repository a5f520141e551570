//! The avatar on a made-up bundle: parity with plain tract, invariance, the display's rate,
//! controls, and input that must not disturb it.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use dynaskin_body::{Pose, Region};
use dynaskin_runtime::features::{FeatureKind, Materials, clip_features};
use dynaskin_runtime::{Avatar, Model, RuntimeError, Settled};
use glam::{DQuat, DVec3, Vec3};
use support::{SMALL, kind, pose_at};
use tract_onnx::prelude::*;

const DT: f64 = 1.0 / 60.0;
const SHAPE: [f32; 10] = [0.5, -1.0, 0.2, 0.0, 0.3, 0.0, 0.0, -0.4, 0.0, 1.0];

fn avatar() -> Avatar {
    Avatar::new(support::model(), &SHAPE).unwrap()
}

fn largest(offsets: &[Vec3]) -> f32 {
    offsets.iter().map(|o| o.length()).fold(0.0, f32::max)
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max)
}

/// The networks run by tract's own ONNX front end, tick by tick.
struct PlainTract {
    predictor: Arc<TypedRunnableModel>,
    decoder: Arc<TypedRunnableModel>,
    hidden: Tensor,
    cell: Tensor,
}

impl PlainTract {
    fn new() -> Self {
        let plan = |bytes: Vec<u8>| {
            let model = tract_onnx::onnx().model_for_read(&mut &bytes[..]).unwrap();
            model.into_typed().unwrap().into_runnable().unwrap()
        };
        Self {
            predictor: plan(support::predictor_onnx()),
            decoder: plan(support::decoder_onnx()),
            hidden: Tensor::zero::<f32>(&[1, SMALL.cells]).unwrap(),
            cell: Tensor::zero::<f32>(&[1, SMALL.cells]).unwrap(),
        }
    }

    fn tick(&mut self, features: &[f32]) -> Vec<f32> {
        let features = Tensor::from_shape(&[1, features.len()], features).unwrap();
        let inputs = tvec!(
            features.into_tvalue(),
            self.hidden.clone().into_tvalue(),
            self.cell.clone().into_tvalue()
        );
        let outputs = self.predictor.run(inputs).unwrap();
        self.hidden = outputs[0].clone().into_tensor();
        self.cell = outputs[2].clone().into_tensor();
        list(&outputs[1])
    }

    fn decode(&self, latent: &[f32]) -> Vec<f32> {
        let latent = Tensor::from_shape(&[1, SMALL.latents], latent).unwrap();
        list(&self.decoder.run(tvec!(latent.into_tvalue())).unwrap()[0])
    }
}

fn list(value: &TValue) -> Vec<f32> {
    value
        .to_plain_array_view::<f32>()
        .unwrap()
        .iter()
        .copied()
        .collect()
}

#[test]
fn offsets_are_those_of_plain_tract_one_tick_later() {
    let mut avatar = avatar();
    let joints_m = *avatar.joints_rest_m();
    let rest_features = {
        let clip = still_clip(Pose::REST, 1);
        clip_features(
            FeatureKind::Inertial,
            &clip.frames,
            clip.rate_hz,
            &joints_m,
            &SHAPE,
            &Materials::default(),
        )
        .unwrap()
    };
    let mut plain = PlainTract::new();
    let mut latent = vec![];
    for _ in 0..120 {
        latent = plain.tick(&rest_features);
    }
    let rest_m = plain.decode(&latent);

    let frames: Vec<Pose> = (0..300).map(|tick| pose_at(f64::from(tick) * DT)).collect();
    let clip = dynaskin_motion::Clip {
        name: "made up".to_owned(),
        rate_hz: 60.0,
        frames,
    };
    let features = clip_features(
        FeatureKind::Inertial,
        &clip.frames,
        clip.rate_hz,
        &joints_m,
        &SHAPE,
        &Materials::default(),
    )
    .unwrap();
    let mut plain = PlainTract::new();
    let mut worst = 0.0_f32;
    let mut seen = 0.0_f32;
    let mut latent_before = vec![];
    for (tick, row) in features.chunks(FeatureKind::Inertial.count()).enumerate() {
        if tick == 0 {
            for _ in 0..120 {
                latent_before = plain.tick(row);
            }
        }
        let latent = if tick == 0 {
            latent_before.clone()
        } else {
            plain.tick(row)
        };
        avatar.step(&clip.frames[tick], DT).unwrap();
        let raw_m = plain.decode(&latent_before);
        for (slot, &vertex) in avatar.model().soft_vertices().iter().enumerate() {
            let soft = avatar.model().body().softness(vertex as usize) > 0.0;
            for axis in 0..3 {
                let got = avatar.offsets_rest_m()[vertex as usize][axis];
                let number = 3 * slot + axis;
                let expected = if soft {
                    raw_m[number] - rest_m[number]
                } else {
                    0.0
                };
                worst = worst.max((got - expected).abs());
                seen = seen.max(expected.abs());
            }
        }
        latent_before = latent;
    }
    println!("largest offset {seen} m, largest difference to plain tract {worst:e} m");
    assert!(seen > 0.005, "the made-up motion moves nothing: {seen}");
    assert!(worst <= 1e-6, "{worst}");
}

fn still_clip(pose: Pose, frames: usize) -> dynaskin_motion::Clip {
    dynaskin_motion::Clip {
        name: "still".to_owned(),
        rate_hz: 60.0,
        frames: vec![pose; frames],
    }
}

#[test]
fn motion_moved_by_10_m_and_turned_by_90_degrees_gives_the_same_offsets() {
    let mut here = avatar();
    let mut there = avatar();
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let pelvis_m = here.joints_rest_m()[0].as_dvec3();
    let mut seen = 0.0_f32;
    for tick in 0..300 {
        let pose = pose_at(f64::from(tick) * DT);
        let mut moved = pose.clone();
        moved.root_translation_m =
            turn * (pose.root_translation_m + pelvis_m) - pelvis_m + DVec3::new(10.0, 0.0, 0.0);
        moved.parent_from_joint[0] = turn * moved.parent_from_joint[0];
        here.step(&pose, DT).unwrap();
        there.step(&moved, DT).unwrap();
        seen = seen.max(largest(here.offsets_rest_m()));
        assert!(distance(here.offsets_rest_m(), there.offsets_rest_m()) <= 1e-5);
    }
    assert!(seen > 0.005);
}

/// Steps through 4 s of motion at the time steps `dts` gives; gives the time and the offsets of
/// each step.
fn played(mut dts: impl FnMut() -> f64) -> Vec<(f64, Vec<Vec3>)> {
    let mut avatar = avatar();
    let mut time = 0.0;
    avatar.step(&pose_at(time), 0.0).unwrap();
    let mut samples = vec![(time, avatar.offsets_rest_m().to_vec())];
    while time < 4.0 {
        let dt = dts();
        time += dt;
        let report = avatar.step(&pose_at(time), dt).unwrap();
        assert_eq!(report.settled, None, "at {time} s");
        samples.push((time, avatar.offsets_rest_m().to_vec()));
    }
    samples
}

#[test]
fn the_motion_does_not_depend_on_the_display_rate() {
    let reference = played(|| DT);
    let size = reference
        .iter()
        .map(|(_, o)| largest(o))
        .fold(0.0, f32::max);
    let compare = |name: &str, samples: Vec<(f64, Vec<Vec3>)>, limit: f32| {
        let mut worst = 0.0_f32;
        for (time, offsets) in &samples[1..] {
            let tick = ((time / DT).floor() as usize).min(reference.len() - 2);
            let t = (time / DT - tick as f64) as f32;
            let (a, b) = (&reference[tick].1, &reference[tick + 1].1);
            let expected: Vec<Vec3> = a.iter().zip(b).map(|(a, b)| a.lerp(*b, t)).collect();
            worst = worst.max(distance(offsets, &expected));
        }
        let percent = 100.0 * worst / size;
        println!("{name}: differs by {percent:.1} % of the largest offset");
        assert!(percent <= limit, "{name}: {worst} m of {size} m");
    };
    for (rate, limit) in [
        (24.0, 12.0),
        (30.0, 8.0),
        (50.0, 4.0),
        (120.0, 1.0),
        (144.0, 2.0),
        (240.0, 1.0),
    ] {
        compare(&format!("{rate} Hz"), played(|| 1.0 / rate), limit);
    }
    let mut seed = 1_u32;
    let jitter = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.004 + 0.03 * f64::from(seed) / f64::from(u32::MAX)
    };
    compare("steps of 4 to 34 ms", played(jitter), 4.0);
}

#[test]
fn standing_still_in_the_rest_pose_is_the_plain_surface() {
    let mut avatar = avatar();
    for _ in 0..10 {
        avatar.step(&Pose::REST, DT).unwrap();
    }
    assert!(largest(avatar.offsets_rest_m()) < 1e-6);
    for tick in 0..120 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    assert!(largest(avatar.offsets_rest_m()) > 0.002);
    // Back to rest without a cut, then stand.
    let end = pose_at(119.0 * DT);
    for tick in 1..=60 {
        let pose = end.interpolated(&Pose::REST, f64::from(tick) / 60.0);
        avatar.step(&pose, DT).unwrap();
    }
    for _ in 0..240 {
        avatar.step(&Pose::REST, DT).unwrap();
    }
    let left = largest(avatar.offsets_rest_m());
    assert!(left < 1e-5, "{left}");
}

#[test]
fn the_first_frame_starts_settled_and_a_teleport_does_not_pop() {
    let mut avatar = avatar();
    let report = avatar.step(&pose_at(1.0), DT).unwrap();
    assert_eq!(report.settled, Some(Settled::FirstPose));
    let first = avatar.offsets_rest_m().to_vec();
    avatar.step(&pose_at(1.0), DT).unwrap();
    assert!(distance(&first, avatar.offsets_rest_m()) < 1e-5);

    for _ in 0..30 {
        avatar.step(&pose_at(1.0), DT).unwrap();
    }
    let before = avatar.offsets_rest_m().to_vec();
    let mut far = pose_at(1.0);
    far.root_translation_m.x += 5.0;
    let report = avatar.step(&far, DT).unwrap();
    assert_eq!(report.settled, Some(Settled::Cut));
    for _ in 0..10 {
        assert!(distance(&before, avatar.offsets_rest_m()) < 1e-4);
        let report = avatar.step(&far, DT).unwrap();
        assert_eq!(report.settled, None);
    }
}

#[test]
fn a_ride_at_constant_velocity_moves_nothing() {
    let mut avatar = avatar();
    avatar.step(&Pose::REST, DT).unwrap();
    for tick in 1..200 {
        let mut pose = Pose::REST;
        pose.root_translation_m.z = 15.0 * f64::from(tick) * DT;
        avatar.step(&pose, DT).unwrap();
        assert!(largest(avatar.offsets_rest_m()) < 1e-5);
    }
}

#[test]
fn a_pause_keeps_the_surface_and_a_stall_settles_it() {
    let mut avatar = avatar();
    for tick in 0..60 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    let before = avatar.offsets_rest_m().to_vec();
    for _ in 0..5 {
        let report = avatar.step(&pose_at(59.0 * DT), 0.0).unwrap();
        assert_eq!((report.ticks, report.settled), (0, None));
        assert_eq!(avatar.offsets_rest_m(), before);
    }
    let report = avatar.step(&pose_at(60.0 * DT), DT).unwrap();
    assert_eq!((report.ticks, report.settled), (1, None));
    let report = avatar.step(&pose_at(9.0), 8.0).unwrap();
    assert_eq!((report.ticks, report.settled), (0, Some(Settled::Stall)));
}

#[test]
fn bad_poses_and_steps_leave_the_avatar_as_it_was() {
    let mut disturbed = avatar();
    let mut calm = avatar();
    for tick in 0..100 {
        let pose = pose_at(f64::from(tick) * DT);
        let mut bad = pose.clone();
        bad.parent_from_joint[5].y = f64::NAN;
        let error = disturbed.step(&bad, DT).unwrap_err();
        assert_eq!(kind(&error), "InvalidPose");
        assert!(error.to_string().contains("right_knee"), "{error}");
        let mut long = pose.clone();
        long.parent_from_joint[3] *= 2.0;
        assert!(matches!(
            disturbed.step(&long, DT),
            Err(RuntimeError::InvalidPose { .. })
        ));
        for lost_m in [f64::INFINITY, f64::NAN, -1e300] {
            let mut lost = pose.clone();
            lost.root_translation_m.y = lost_m;
            let error = disturbed.step(&lost, DT).unwrap_err();
            assert!(error.to_string().contains("root_translation_m"), "{error}");
        }
        for dt in [f64::NAN, -DT, f64::INFINITY] {
            let error = disturbed.step(&pose, dt).unwrap_err();
            assert_eq!(kind(&error), "InvalidTimeStep");
        }
        disturbed.step(&pose, DT).unwrap();
        calm.step(&pose, DT).unwrap();
        assert_eq!(disturbed.offsets_rest_m(), calm.offsets_rest_m());
        assert_eq!(disturbed.skin_matrices(), calm.skin_matrices());
    }
}

#[test]
fn bad_shapes_and_gains_are_refused() {
    assert_eq!(
        kind(&Avatar::new(support::model(), &[0.0; 3]).unwrap_err()),
        "InvalidShape"
    );
    let mut avatar = avatar();
    for shape in [vec![0.0; 11], vec![f32::NAN; 10], vec![9.0; 10]] {
        assert_eq!(kind(&avatar.set_shape(&shape).unwrap_err()), "InvalidShape");
        assert_eq!(avatar.shape(), &SHAPE);
    }
    for gain in [-0.1, f32::NAN, 1000.0] {
        assert_eq!(
            kind(&avatar.set_strength(gain).unwrap_err()),
            "InvalidControl"
        );
        let error = avatar.set_region_gain(Region::Belly, gain).unwrap_err();
        assert!(error.to_string().contains("belly"), "{error}");
    }
}

#[test]
fn gains_scale_their_region_and_bone_never_moves() {
    let mut avatar = avatar();
    for tick in 0..90 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    let full = avatar.offsets_rest_m().to_vec();
    let ring = 5 * SMALL.segments..6 * SMALL.segments;
    let belly = ring
        .max_by(|&a, &b| full[a].length().total_cmp(&full[b].length()))
        .unwrap();
    let both = 7 * SMALL.segments;
    let skull = 11 * SMALL.segments;
    assert!(full[belly].length() > 1e-3);
    assert!(avatar.model().soft_vertices().contains(&(skull as u32)));
    assert_eq!(full[skull], Vec3::ZERO);

    avatar.set_region_gain(Region::Belly, 0.0).unwrap();
    assert_eq!(avatar.offsets_rest_m()[belly], Vec3::ZERO);
    assert!(avatar.offsets_rest_m()[both].distance(full[both] * 0.5) < 1e-6);
    avatar.set_region_gain(Region::Belly, 1.0).unwrap();
    avatar.set_strength(0.5).unwrap();
    assert!(avatar.offsets_rest_m()[belly].distance(full[belly] * 0.5) < 1e-6);
    avatar.set_strength(1.0).unwrap();
    assert_eq!(avatar.offsets_rest_m(), full);

    avatar.set_enabled(false);
    assert_eq!(largest(avatar.offsets_rest_m()), 0.0);
    avatar.step(&pose_at(1.5), DT).unwrap();
    assert_eq!(largest(avatar.offsets_rest_m()), 0.0);
    avatar.set_enabled(true);
    let report = avatar.step(&pose_at(91.0 * DT), DT).unwrap();
    assert!(report.settled.is_some());
    assert!(largest(avatar.offsets_rest_m()) > 0.0);
}

#[test]
fn positions_and_normals_are_those_of_the_deformed_mesh() {
    let mut avatar = avatar();
    for tick in 0..90 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    let shaped = avatar.model().body().shaped(&SHAPE);
    let mut sums = vec![Vec3::ZERO; shaped.positions_m.len()];
    for face in &avatar.model().body().faces {
        let [a, b, c] = face.map(|v| avatar.positions_rest_m()[v as usize]);
        for &corner in face {
            sums[corner as usize] += (b - a).cross(c - a);
        }
    }
    for (vertex, sum) in sums.iter().enumerate() {
        let expected = shaped.positions_m[vertex] + avatar.offsets_rest_m()[vertex];
        assert!(avatar.positions_rest_m()[vertex].distance(expected) < 1e-6);
        assert!(avatar.normals_rest()[vertex].distance(sum.normalize()) < 1e-4);
    }
}

#[test]
fn a_shape_change_in_mid_motion_is_shown_and_does_not_kick() {
    let mut avatar = avatar();
    for _ in 0..30 {
        avatar.step(&Pose::REST, DT).unwrap();
    }
    let before = avatar.positions_rest_m().to_vec();
    avatar.set_shape(&[1.0; 10]).unwrap();
    assert!(distance(&before, avatar.positions_rest_m()) > 0.01);
    for _ in 0..5 {
        avatar.step(&Pose::REST, DT).unwrap();
    }
    // The features' β changed, so the tissue drifts to the new shape's rest, without a jolt.
    for _ in 0..240 {
        avatar.step(&Pose::REST, DT).unwrap();
    }
    assert!(largest(avatar.offsets_rest_m()) < 1e-5);
}

#[test]
fn skinning_follows_the_matrices() {
    let mut avatar = avatar();
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(1.0, 0.0, 2.0);
    pose.parent_from_joint[0] = DQuat::from_rotation_y(std::f64::consts::PI);
    avatar.step(&pose, DT).unwrap();
    let rest_m = avatar.positions_rest_m()[3];
    let pelvis_m = avatar.joints_rest_m()[0];
    let (positions_m, normals) = avatar.skin();
    let turned = Vec3::new(-1.0, 1.0, -1.0) * (rest_m - pelvis_m);
    let expected = pelvis_m + turned + Vec3::new(1.0, 0.0, 2.0);
    assert!(positions_m[3].distance(expected) < 1e-5);
    assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4));
}

#[test]
fn a_body_without_networks_is_plainly_skinned() {
    let model = Arc::new(Model::body_only(Arc::new(support::body())));
    let mut avatar = Avatar::new(model, &SHAPE).unwrap();
    for tick in 0..10 {
        avatar.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    assert_eq!(largest(avatar.offsets_rest_m()), 0.0);
    let shaped = avatar.model().body().shaped(&SHAPE);
    assert!(distance(avatar.positions_rest_m(), &shaped.positions_m) < 1e-6);
}

#[test]
fn the_stopwatch_is_read_in_order() {
    let mut avatar = avatar();
    let mut now = 0.0;
    let mut stopwatch = || {
        now += 1.0;
        now
    };
    avatar.step(&pose_at(0.0), DT).unwrap();
    let report = avatar.step_timed(&pose_at(DT), DT, &mut stopwatch).unwrap();
    let seconds = report.seconds;
    for stage in [
        seconds.features,
        seconds.predict,
        seconds.decode,
        seconds.apply,
        seconds.skin,
    ] {
        assert_eq!(stage, 1.0);
    }
}

#[test]
fn known_offsets_are_shown_on_a_body_alone_with_the_surface_that_networks_give() {
    let mut moving = avatar();
    for tick in 0..30 {
        moving.step(&pose_at(f64::from(tick) * DT), DT).unwrap();
    }
    let known: Vec<f32> = moving
        .offsets_rest_m()
        .iter()
        .flat_map(Vec3::to_array)
        .collect();
    let body = Arc::new(Model::body_only(Arc::new(support::body())));
    let mut plain = Avatar::new(body, &SHAPE).unwrap();
    plain.show_offsets(&known).unwrap();
    assert!(largest(plain.offsets_rest_m()) > 1e-4);
    assert!(distance(plain.positions_rest_m(), moving.positions_rest_m()) < 1e-6);
    assert!(distance(plain.normals_rest(), moving.normals_rest()) < 1e-4);

    let shown = plain.positions_rest_m().to_vec();
    let spoilt = {
        let mut spoilt = known.clone();
        spoilt[4] = f32::NAN;
        spoilt
    };
    for bad in [&known[1..], &spoilt[..], &[]] {
        let error = plain.show_offsets(bad).unwrap_err();
        assert_eq!(error.code(), "argument", "{error}");
    }
    assert_eq!(plain.positions_rest_m(), shown);
    assert!(moving.show_offsets(&known).is_err());
}
