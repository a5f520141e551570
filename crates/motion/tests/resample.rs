//! Keys below 60 a second, and cuts: what a clip is between the frames of its file.

// A failed step of a test is a failed test; skipped tests say so.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::PathBuf;

use common::{MIXAMO, female_joints_m, source_bvh};
use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{Bvh, Clip, MODEL_RATE_HZ, retarget};
use glam::{DQuat, DVec3};

/// A pelvis that goes in circles and a knee that swings, of frequencies that bodies have.
fn smooth(seconds: f64) -> Pose {
    let mut pose = Pose::REST;
    let phase = 2.0 * std::f64::consts::PI * 1.5 * seconds;
    pose.root_translation_m = DVec3::new(0.2 * phase.sin(), 0.1 * (2.0 * phase).cos(), seconds);
    let axis = DVec3::new(1.0, 0.3, -0.2).normalize();
    pose.parent_from_joint[Joint::LeftKnee as usize] =
        DQuat::from_axis_angle(axis, 0.8 * phase.sin());
    pose
}

fn sampled(rate_hz: f64, seconds: f64) -> Clip {
    Clip {
        name: String::new(),
        rate_hz,
        frames: (0..=(seconds * rate_hz) as usize)
            .map(|frame| smooth(frame as f64 / rate_hz))
            .collect(),
    }
}

fn knee(pose: &Pose) -> DQuat {
    pose.parent_from_joint[Joint::LeftKnee as usize]
}

fn degrees(a: DQuat, b: DQuat) -> f64 {
    2.0 * a.dot(b).abs().min(1.0).acos().to_degrees()
}

#[test]
fn between_slow_keys_lies_the_motion_that_was_sampled() {
    for (rate_hz, turn_limit, place_limit_m) in [
        (24.0, 0.35, 2e-3),
        (25.0, 0.3, 2e-3),
        (30.0, 0.12, 8e-4),
        (48.0, 0.02, 1e-4),
        (50.0, 0.02, 1e-4),
    ] {
        let clip = sampled(rate_hz, 3.0).resampled(MODEL_RATE_HZ).unwrap();
        // The ends have neighbours on one side only.
        let inside = 12..clip.frames.len() - 12;
        let (mut turn, mut place_m) = (0.0_f64, 0.0_f64);
        for frame in inside {
            let truth = smooth(frame as f64 / MODEL_RATE_HZ);
            let pose = &clip.frames[frame];
            turn = turn.max(degrees(knee(pose), knee(&truth)));
            place_m = place_m.max(pose.root_translation_m.distance(truth.root_translation_m));
        }
        println!("{rate_hz} Hz: {turn:.4} degrees, {place_m:.6} m");
        assert!(
            turn < turn_limit && place_m < place_limit_m,
            "{rate_hz} Hz: {turn}, {place_m}"
        );
    }
}

/// Speed and acceleration on both sides of a key, from poses a hair apart.
#[test]
fn there_are_no_corners_at_the_keys() {
    let clip = sampled(30.0, 2.0);
    let h = 1e-4;
    let place = |seconds: f64| clip.pose_at(seconds).root_translation_m;
    let turn = |seconds: f64| knee(&clip.pose_at(seconds)).to_scaled_axis();
    for value in [&place as &dyn Fn(f64) -> DVec3, &turn] {
        for key in 6..54 {
            let at = f64::from(key) / 30.0;
            let speed = |from: f64| (value(from + h) - value(from)) / h;
            let jump = speed(at) - speed(at - h);
            assert!(jump.length() < 0.02, "frame {key}: speed jumps by {jump}");
            let acceleration =
                |mid: f64| (value(mid + h) - 2.0 * value(mid) + value(mid - h)) / (h * h);
            let [before, after] = [acceleration(at - 2.0 * h), acceleration(at + 2.0 * h)];
            // The largest is near 70 rad/s², and goes on changing over the 0.4 ms in between.
            assert!(
                (before - after).length() < 0.5,
                "frame {key}: {before} {after}"
            );
        }
    }
}

#[test]
fn a_file_keeps_its_last_frame_and_its_length() {
    for (written, frames, seconds) in [
        ("0.033333", 151, 5.0),
        ("0.0333333", 151, 5.0),
        ("0.0333", 151, 5.0),
        ("0.008333", 601, 5.0),
        ("0.00833333", 601, 5.0),
        ("0.0083", 601, 5.0),
        ("0.041667", 121, 5.0),
        ("0.0166667", 301, 5.0),
        ("0.016667", 301, 5.0),
        ("0.04", 126, 5.0),
    ] {
        let poses: Vec<Vec<f64>> = (0..frames)
            .map(|frame| {
                vec![
                    0.0,
                    0.0,
                    0.0,
                    0.0,
                    30.0 * f64::from(frame) / f64::from(frames - 1),
                ]
            })
            .collect();
        let text = source_bvh(&MIXAMO, 1.0, &poses).replace("0.0333333", written);
        let bvh = Bvh::parse(text.as_bytes()).unwrap();
        let (clip, _) = retarget(&bvh, &female_joints_m()).unwrap();
        let last = clip.frames.last().unwrap().clone();
        let at_60 = clip.resampled(MODEL_RATE_HZ).unwrap();
        assert_eq!(at_60.frames.len(), 301, "{written}");
        assert!(
            (at_60.duration_seconds() - seconds).abs() < 1e-9,
            "{written}"
        );
        let end = at_60.frames.last().unwrap();
        let off = degrees(end.parent_from_joint[0], last.parent_from_joint[0]);
        assert!(off < 1e-3, "{written}: {off}");
    }
}

#[test]
fn a_jump_is_held_and_made_in_one_step() {
    for rate_hz in [24.0, 25.0, 30.0, 50.0, 60.0, 100.0, 120.0] {
        let mut clip = sampled(rate_hz, 2.0);
        let frame = clip.frames.len() / 2;
        let away = DQuat::from_rotation_y(2.9);
        for pose in &mut clip.frames[frame..] {
            pose.parent_from_joint[0] = away;
            pose.root_translation_m.x += 3.0;
        }
        assert_eq!(clip.jumps(), [frame - 1]);
        let at_60 = clip.resampled(MODEL_RATE_HZ).unwrap();
        let between = at_60.frames.iter().filter(|pose| {
            let turn = degrees(pose.parent_from_joint[0], DQuat::IDENTITY);
            (1.0..165.0).contains(&turn)
        });
        assert_eq!(between.count(), 0, "{rate_hz} Hz");
        let jump = (0..at_60.frames.len() - 1).find(|frame| {
            let [a, b] = [&at_60.frames[*frame], &at_60.frames[*frame + 1]];
            (b.root_translation_m - a.root_translation_m).x > 2.5
        });
        let jump = jump.unwrap_or_else(|| panic!("{rate_hz} Hz: no jump in one step"));
        assert_eq!(at_60.jumps(), [jump], "{rate_hz} Hz");
        // A clip made twice as fast still has it.
        assert_eq!(
            clip.time_scaled(2.0).unwrap().jumps().len(),
            1,
            "{rate_hz} Hz"
        );
    }
}

#[test]
fn captures_have_no_jumps_down_to_12_frames_a_second() {
    let shared = std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let Ok(folder) = std::fs::read_dir(shared.join("mocap/train")) else {
        println!(
            "skipped: captures_have_no_jumps_down_to_12_frames_a_second needs ../shared/mocap/train"
        );
        return;
    };
    let mut paths: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bvh"));
    paths.sort();
    let mut found = Vec::new();
    for path in &paths {
        let bvh = Bvh::parse(&std::fs::read(path).unwrap()).unwrap();
        let (clip, _) = retarget(&bvh, &female_joints_m()).unwrap();
        for every in [1, 2, 3, 4, 5] {
            let slower = Clip {
                name: String::new(),
                rate_hz: clip.rate_hz / every as f64,
                frames: clip.frames.iter().step_by(every).cloned().collect(),
            };
            for jump in slower.jumps() {
                found.push(format!("{} by {every}: frame {jump}", path.display()));
            }
        }
    }
    // The first step of one clip, which begins in mid-motion, is as far at 20 frames a second as jumps are.
    found.retain(|found| !found.ends_with("05_02.bvh by 3: frame 0"));
    assert_eq!(found, [] as [&str; 0]);
}
