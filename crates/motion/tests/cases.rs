//! The small files of the shared folder that went wrong once, each with what is right; those about the
//! zero pose are in `zero_pose.rs`, what is played of the calibration frame in the runtime's tests.

// A failed step of a test is a failed test; skipped tests say so.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::PathBuf;

use common::female_joints_m;
use dynaskin_body::Joint;
use dynaskin_motion::{
    AnimationChoice, Clip, FileClip, GltfMotion, MotionError, MotionFile, ReadOptions,
};

fn bytes(name: &str) -> Option<Vec<u8>> {
    let shared = std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let bytes = std::fs::read(shared.join("cases/motions").join(name)).ok();
    if bytes.is_none() {
        println!("skipped: {name} needs ../shared/cases/motions");
    }
    bytes
}

fn read(name: &str, options: &ReadOptions) -> Option<FileClip> {
    let motion = MotionFile::parse_with(&bytes(name)?, options);
    let motion = motion.unwrap_or_else(|error| panic!("{name}: {error}"));
    let clip = motion.clip(&female_joints_m());
    Some(clip.unwrap_or_else(|error| panic!("{name}: {error}")))
}

/// Largest angle between the rotations of two clips, and largest distance between their roots.
#[track_caller]
fn check_same(clip: &Clip, control: &Clip) {
    assert_eq!(clip.rate_hz, control.rate_hz);
    assert_eq!(clip.frames.len(), control.frames.len());
    for (frame, (pose, expected)) in clip.frames.iter().zip(&control.frames).enumerate() {
        let off_m = pose
            .root_translation_m
            .distance(expected.root_translation_m);
        assert!(off_m < 1e-4, "frame {frame}: {off_m} m");
        for joint in Joint::ALL {
            let [a, b] = [pose, expected].map(|pose| pose.parent_from_joint[joint as usize]);
            let degrees = 2.0 * a.dot(b).abs().min(1.0).acos().to_degrees();
            assert!(degrees < 0.01, "frame {frame}, {}: {degrees}", joint.name());
        }
    }
}

/// The same joints and the same poses as the file with plain names.
fn check_names(name: &str) {
    let control = read("names-01-plain-control.bvh", &ReadOptions::default());
    let (Some(found), Some(control)) = (read(name, &ReadOptions::default()), control) else {
        return;
    };
    let joints = |found: &FileClip| -> Vec<Joint> {
        let report = found.report.as_ref().unwrap();
        report.mapped.iter().map(|(joint, _)| *joint).collect()
    };
    assert_eq!(joints(&found), joints(&control));
    assert_eq!(found.notes, control.notes);
    check_same(&found.clip, &control.clip);
}

#[test]
fn names_01_plain_control() {
    let Some(found) = read("names-01-plain-control.bvh", &ReadOptions::default()) else {
        return;
    };
    let report = found.report.unwrap();
    assert_eq!(report.missing, [Joint::LeftHand, Joint::RightHand]);
    assert_eq!(report.unmapped, [] as [&str; 0]);
}

#[test]
fn names_02_motionbuilder_character1() {
    check_names("names-02-motionbuilder-character1.bvh");
}

#[test]
fn names_08_blender_duplicate_001() {
    check_names("names-08-blender-duplicate-001.bvh");
}

#[test]
fn names_09_ipi_lthigh_lshin() {
    check_names("names-09-ipi-lthigh-lshin.bvh");
}

#[test]
fn names_11_lower_case_joints_lhip_lknee() {
    check_names("names-11-lower-case-joints-lhip-lknee.bvh");
}

#[test]
fn names_12_character_creator_cc_base() {
    check_names("names-12-character-creator-cc-base.bvh");
}

#[test]
fn names_20_kinect_v1_hipcenter() {
    check_names("names-20-kinect-v1-hipcenter.bvh");
}

#[test]
fn names_25_makehuman_default_upperleg01_l() {
    check_names("names-25-makehuman-default-upperleg01-l.bvh");
}

#[test]
fn glb_with_a_t_pose_for_its_first_clip() {
    let name = "glb-tpose-clip-first.glb";
    let Some(bytes) = bytes(name) else { return };
    let animations = GltfMotion::animations(&bytes).unwrap();
    assert!(animations.len() >= 2, "{animations:?}");
    assert_eq!(animations[0].moving_joints, 0);
    assert!(animations[1].moving_joints > 0, "{animations:?}");
    let found = read(name, &ReadOptions::default()).unwrap();
    assert_eq!(found.clip.name, animations[1].name);
    assert!(found.clip.duration_seconds() > 1.0);
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains(&animations[0].name)),
        "{:?}",
        found.notes
    );
    for choice in [
        AnimationChoice::Index(0),
        AnimationChoice::Name(animations[0].name.clone()),
    ] {
        let options = ReadOptions {
            animation: Some(choice),
            ..ReadOptions::default()
        };
        let held = read(name, &options).unwrap();
        assert_eq!(held.clip.name, animations[0].name);
        let [first, .., last] = &held.clip.frames[..] else {
            assert_eq!(held.clip.frames.len(), 1);
            continue;
        };
        assert_eq!(first, last);
    }
    let options = ReadOptions {
        animation: Some(AnimationChoice::Name("no such".to_owned())),
        ..ReadOptions::default()
    };
    let error = MotionFile::parse_with(&bytes, &options).unwrap_err();
    assert!(
        matches!(error, MotionError::UnknownAnimation { .. }),
        "{error}"
    );
    assert!(error.to_string().contains(&animations[1].name), "{error}");
}

#[test]
fn npz_control_amass_156() {
    let Some(found) = read("control_amass_156.npz", &ReadOptions::default()) else {
        return;
    };
    assert_eq!(found.clip.rate_hz, 60.0);
    assert_eq!(found.notes, [] as [&str; 0]);
}

#[test]
fn npz_without_a_rate_takes_the_callers() {
    let control = read("control_amass_156.npz", &ReadOptions::default());
    let (Some(bytes), Some(control)) = (bytes("no_rate.npz"), control) else {
        return;
    };
    let error = MotionFile::parse(&bytes).unwrap_err().to_string();
    assert!(error.contains("option `rate`"), "{error}");
    let options = ReadOptions {
        rate_hz: Some(control.clip.rate_hz),
        ..ReadOptions::default()
    };
    check_same(&read("no_rate.npz", &options).unwrap().clip, &control.clip);
}

#[test]
fn npz_with_its_rate_as_fps() {
    let usual = ReadOptions::default();
    let control = read("control_amass_156.npz", &usual);
    if let (Some(found), Some(control)) = (read("fps_key.npz", &usual), control) {
        check_same(&found.clip, &control.clip);
    }
}

#[test]
fn npz_with_y_up_that_does_not_say_it() {
    let usual = ReadOptions::default();
    let control = read("control_amass_156.npz", &usual);
    let (Some(found), Some(control)) = (read("y_up_not_said.npz", &usual), control) else {
        return;
    };
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("stands along y")),
        "{:?}",
        found.notes
    );
    let rest_m = female_joints_m();
    for (pose, expected) in found.clip.frames.iter().zip(&control.clip.frames) {
        let [height_m, wanted_m] = [pose, expected].map(|pose| {
            let world = pose.world_joints(&rest_m);
            world.position_m[Joint::Head as usize].y
        });
        assert!(
            (height_m - wanted_m).abs() < 0.02,
            "{height_m} for {wanted_m}"
        );
    }
}
