//! A jump between two frames of a motion file is a cut at any rate of the file.

// A failed step of a test is a failed test; skipped tests say so.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "support/shipped.rs"]
mod shipped;

use std::path::PathBuf;

use dynaskin_body::Pose;
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionFile, ProceduralKind};
use dynaskin_runtime::{Avatar, Settled};
use glam::DQuat;
use shipped::largest;

/// Rates of motion files.
const RATES_HZ: [f64; 9] = [24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0];

/// Plays a clip at 60 Hz; gives the frames that were cuts and the largest offset of each frame.
fn played(avatar: &mut Avatar, clip: &Clip) -> (Vec<usize>, Vec<f32>) {
    avatar.reset();
    let (mut cuts, mut sizes) = (Vec::new(), Vec::new());
    for (frame, pose) in clip.frames.iter().enumerate() {
        let report = avatar.step(pose, 1.0 / MODEL_RATE_HZ).unwrap();
        if report.settled == Some(Settled::Cut) {
            cuts.push(frame);
        }
        sizes.push(largest(avatar.offsets_rest_m()));
    }
    (cuts, sizes)
}

/// The clip with everything from `frame` on turned about the vertical and moved away.
fn broken_at(clip: &Clip, frame: usize, radians: f64) -> Clip {
    let mut clip = clip.clone();
    let turn = DQuat::from_rotation_y(radians);
    for pose in &mut clip.frames[frame..] {
        pose.parent_from_joint[0] = (turn * pose.parent_from_joint[0]).normalize();
    }
    clip
}

#[test]
fn a_jump_within_a_take_is_one_cut_at_every_rate() {
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    let take = shipped::clip(ProceduralKind::Walk, &avatar);
    for rate_hz in RATES_HZ {
        let file = take.resampled(rate_hz).unwrap();
        let frame = (2.0 * rate_hz) as usize;
        // From the least that is taken for a jump to about-turns.
        for radians in [1.5, 2.0, 2.97] {
            let clip = broken_at(&file, frame, radians);
            assert_eq!(clip.jumps(), [frame - 1], "{rate_hz} Hz, {radians}");
            let clip = clip.resampled(MODEL_RATE_HZ).unwrap();
            let (cuts, _) = played(&mut avatar, &clip);
            let expected = (frame as f64 / rate_hz * MODEL_RATE_HZ - 1e-3).ceil() as usize;
            assert_eq!(cuts, [expected], "{rate_hz} Hz, {radians}");
        }
        let (cuts, _) = played(&mut avatar, &file.resampled(MODEL_RATE_HZ).unwrap());
        assert_eq!(cuts, [0; 0], "{rate_hz} Hz");
    }
}

#[test]
fn a_calibration_frame_before_the_take_moves_nothing() {
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    let take = shipped::clip(ProceduralKind::ShakeHips, &avatar);
    for rate_hz in RATES_HZ {
        let mut file = take.resampled(rate_hz).unwrap();
        // The take begins in mid-motion, as takes do.
        file.frames.drain(..(2.0 * rate_hz) as usize);
        let (_, alone) = played(&mut avatar, &file.resampled(MODEL_RATE_HZ).unwrap());
        let mut calibration = Pose::REST;
        calibration.parent_from_joint[0] = DQuat::from_rotation_y(2.97);
        file.frames.insert(0, calibration);
        let (_, sizes) = played(&mut avatar, &file.resampled(MODEL_RATE_HZ).unwrap());
        let [most, alone] = [&sizes, &alone].map(|sizes| sizes.iter().copied().fold(0.0, f32::max));
        println!(
            "{rate_hz} Hz: {:.1} mm, alone {:.1} mm",
            1e3 * most,
            1e3 * alone
        );
        assert!(most <= 1.05 * alone, "{rate_hz} Hz: {most} m for {alone} m");
    }
}

#[test]
fn calibration_frame_turned_170_at_30() {
    let shared = std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let name = "calibration-frame-turned-170-at-30.bvh";
    let Ok(bytes) = std::fs::read(shared.join("cases/motions").join(name)) else {
        println!("skipped: calibration_frame_turned_170_at_30 needs ../shared/cases/motions");
        return;
    };
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    let file = MotionFile::parse(&bytes).unwrap();
    let found = file.clip(avatar.joints_rest_m()).unwrap();
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("jumps after frame 1:")),
        "{:?}",
        found.notes
    );
    let clip = found.clip;
    assert_eq!(clip.jumps(), [0]);
    let (_, sizes) = played(&mut avatar, &clip.resampled(MODEL_RATE_HZ).unwrap());
    let mut take = clip;
    take.frames.remove(0);
    let (_, alone) = played(&mut avatar, &take.resampled(MODEL_RATE_HZ).unwrap());
    let [most, alone] = [&sizes, &alone].map(|sizes| sizes.iter().copied().fold(0.0, f32::max));
    println!("{:.1} mm, alone {:.1} mm", 1e3 * most, 1e3 * alone);
    assert!(most <= 1.02 * alone, "{most} m for {alone} m");
}
