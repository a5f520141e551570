//! Which procedural motion a clip resembles.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::{female_joints_m, joints_m};
use dynaskin_body::{Pose, SHAPE_COUNT};
use dynaskin_motion::{Bvh, Clip, MotionError, Procedural, ProceduralKind, retarget};

fn nearest(clip: &Clip) -> ProceduralKind {
    ProceduralKind::nearest(clip, &female_joints_m()).unwrap()
}

#[test]
fn each_motion_is_nearest_to_itself_at_any_tempo_on_any_body_and_mirrored() {
    let heavy = joints_m("male", &[2.0; SHAPE_COUNT]);
    for kind in ProceduralKind::ALL {
        for tempo in [0.8, 1.0, 1.25] {
            let mut motion = Procedural::new(kind);
            motion.tempo_hz *= tempo;
            motion.height_m *= 0.8;
            let clip = motion.clip(&heavy).unwrap();
            assert_eq!(nearest(&clip), kind, "{tempo}");
            assert_eq!(nearest(&clip.mirrored()), kind, "{tempo}, mirrored");
            let turned = clip.resampled(30.0).unwrap();
            assert_eq!(nearest(&turned), kind, "{tempo}, at 30 Hz");
        }
    }
}

#[test]
fn clips_without_movement_are_taken_and_none_is_refused() {
    let mut clip = Clip {
        name: String::new(),
        rate_hz: 60.0,
        frames: vec![Pose::REST],
    };
    assert_eq!(nearest(&clip), ProceduralKind::ShakeHips);
    clip.frames = vec![Pose::REST; 90];
    assert_eq!(nearest(&clip), ProceduralKind::ShakeHips);
    clip.frames.clear();
    let refused = ProceduralKind::nearest(&clip, &female_joints_m());
    assert!(matches!(refused, Err(MotionError::EmptyClip)));
}

/// Captures of which the motion's name is known.
#[test]
fn captures_are_nearest_to_what_they_are_called() {
    let folder = common::poses::shared().join("mocap/train");
    if !folder.is_dir() {
        println!(
            "skipped: captures_are_nearest_to_what_they_are_called needs ../shared/mocap/train"
        );
        return;
    }
    use ProceduralKind::{JumpingJacks, OneLegHop, RunInPlace, Walk};
    // How many of them have to be found: some runs are jogs, some walks are brisk.
    for (category, kind, part) in [
        ("walk", Walk, 0.9),
        ("run", RunInPlace, 0.7),
        ("jumping jacks", JumpingJacks, 1.0),
        ("hop / one leg", OneLegHop, 1.0),
    ] {
        let list = std::fs::read_to_string(folder.join("README.md")).unwrap();
        let (mut found, mut count) = (0, 0);
        for line in list.lines() {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let [_, file, _, of, ..] = cells[..] else {
                continue;
            };
            if of != category || !file.ends_with(".bvh") {
                continue;
            }
            let bvh = Bvh::parse(&std::fs::read(folder.join(file)).unwrap()).unwrap();
            let (clip, _) = retarget(&bvh, &female_joints_m()).unwrap();
            count += 1;
            found += usize::from(nearest(&clip) == kind);
        }
        println!("{category}: {found} of {count}");
        assert!(count > 0, "{category}");
        assert!(
            found as f64 >= part * count as f64,
            "{category}: {found} of {count}"
        );
    }
}
