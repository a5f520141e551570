//! Clips as a page would have been given them: through a source of poses and the runtime's conditioning,
//! with the offsets of the clean motion.
//!
//! A network that learned from clean poses takes what a tracker's noise and a held pose leave behind for
//! motion. One that has seen it learns what to leave out.

use dynaskin_body::Pose;
use dynaskin_conditioning::{Conditioner, PoseSource};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_pose_sources::{Frame, Made, Noise, Source, Steps, Truth};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// Frames a second of the page's display: one a tick, so that nothing but the source is learned.
const DISPLAY_HZ: f64 = MODEL_RATE_HZ;
/// Time in which clocks are being found, in seconds: not used to find by how much poses come late.
const FINDING_SECONDS: f64 = 1.0;
/// By how much conditioned poses may be later than the playhead says, in ticks.
const LATE_TICKS: std::ops::RangeInclusive<f64> = -1.0..=4.0;
/// Steps in which that is looked for, in ticks.
const LATE_STEP: f64 = 0.125;
/// White noise, in degrees of every joint, and millimetres of the root per degree.
const WHITE_DEGREES: [f64; 2] = [0.05, 0.5];
const WHITE_MM_PER_DEGREE: f64 = 4.0;

/// A motion as it was given, and the places in the clean one that its ticks stand for.
#[derive(Clone, Debug)]
pub struct Given {
    /// Conditioned poses, one a tick.
    pub motion: Clip,
    /// Place of each tick in the clean clip, in its frames.
    pub frames: Vec<f64>,
}

/// A source drawn by `seed`, and what the page is told about it.
fn drawn(seed: u64) -> (Source, PoseSource) {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let live = |rate_hz, jitter_seconds, noise| Source {
        name: "",
        made: Made::Live(rate_hz, jitter_seconds),
        display_hz: DISPLAY_HZ,
        noise,
        steps: Steps::Exact,
    };
    let shown = |made, noise| Source {
        made,
        ..live(DISPLAY_HZ, 0.0, noise)
    };
    let degrees = rng.random_range(WHITE_DEGREES[0]..WHITE_DEGREES[1]);
    let white = Noise::White(degrees, 1e-3 * WHITE_MM_PER_DEGREE * degrees);
    let jitter_seconds = rng.random_range(0.0..0.008);
    match rng.random_range(0..8) {
        0 => (live(30.0, 0.0, Noise::None), PoseSource::Display),
        1 => (live(30.0, jitter_seconds, Noise::None), PoseSource::Display),
        2 => (live(30.0, jitter_seconds, white), PoseSource::Tracker),
        3 => (live(30.0, 0.0, Noise::Raw), PoseSource::Tracker),
        4 => (live(30.0, 0.0, Noise::Smoothed), PoseSource::Tracker),
        5 => (shown(Made::File(30.0), Noise::None), PoseSource::Display),
        _ => (shown(Made::EveryFrame, white), PoseSource::Tracker),
    }
}

/// A clip through a source drawn by `seed`. None where the source or the conditioning broke it in two: a
/// network begins anew there.
pub fn given(clip: &Clip, seed: u64) -> Option<Given> {
    let (source, told) = drawn(seed);
    let truth = Truth::middle(clip.name.clone(), clip.clone(), f64::INFINITY);
    let (times, poses) = conditioned(&source.frames(&truth, seed), told)?;
    let ticks = (times.last()? * MODEL_RATE_HZ).floor() as usize + 1;
    let frames: Vec<Pose> = (0..ticks)
        .map(|tick| pose_at(&times, &poses, tick as f64 / MODEL_RATE_HZ))
        .collect();
    let late = lateness(clip, &frames);
    let last = clip.frames.len() as f64 - 1.0;
    Some(Given {
        frames: (0..ticks)
            .map(|tick| (tick as f64 - late).clamp(0.0, last))
            .collect(),
        motion: Clip {
            frames,
            ..clip.clone()
        },
    })
}

/// Where the playhead stood in each of the page's frames, in seconds, and the pose there.
fn conditioned(given: &[Frame], told: PoseSource) -> Option<(Vec<f64>, Vec<Pose>)> {
    let mut conditioner = Conditioner::default();
    conditioner.set_source(told);
    let (mut times, mut poses) = (Vec::new(), Vec::<Pose>::new());
    let mut playhead = 0.0;
    for frame in given {
        let now = conditioner.push(&frame.pose, frame.dt_seconds);
        if now.cut {
            return None;
        }
        playhead += now.dt_seconds;
        // Where the playhead waits, the pose that it waits at counts.
        if times.last().is_some_and(|last| playhead <= last + 1e-9) {
            times.pop();
            poses.pop();
        }
        times.push(playhead);
        poses.push(now.pose);
    }
    Some((times, poses))
}

fn pose_at(times: &[f64], poses: &[Pose], time: f64) -> Pose {
    let after = times.partition_point(|t| *t <= time + 1e-9);
    let before = after.saturating_sub(1);
    match poses.get(after) {
        Some(next) if time > times[before] => {
            let share = (time - times[before]) / (times[after] - times[before]);
            let mut pose = poses[before].clone();
            pose.root_translation_m = pose.root_translation_m.lerp(next.root_translation_m, share);
            for (now, next) in pose
                .parent_from_joint
                .iter_mut()
                .zip(next.parent_from_joint)
            {
                *now = now.slerp(next, share);
            }
            pose
        }
        _ => poses[before].clone(),
    }
}

/// By how many ticks `given` is later than the clip: where the joints differ least.
fn lateness(clip: &Clip, given: &[Pose]) -> f64 {
    let first = (FINDING_SECONDS * MODEL_RATE_HZ) as usize;
    let first = first.min(given.len() / 2);
    let off = |late: f64| -> f64 {
        let ticks = given.iter().enumerate().skip(first).step_by(3);
        ticks
            .map(|(tick, pose)| {
                let seconds = (tick as f64 - late).max(0.0) / MODEL_RATE_HZ;
                let clean = clip.pose_at(seconds);
                let moved = (pose.root_translation_m - clean.root_translation_m).length_squared();
                let pairs = pose.parent_from_joint.iter().zip(clean.parent_from_joint);
                moved + pairs.map(|(a, b)| 1.0 - a.dot(b).powi(2)).sum::<f64>()
            })
            .sum()
    };
    let steps = ((LATE_TICKS.end() - LATE_TICKS.start()) / LATE_STEP) as usize;
    let all = (0..=steps).map(|step| LATE_TICKS.start() + step as f64 * LATE_STEP);
    let best = all.min_by(|a, b| off(*a).total_cmp(&off(*b)));
    best.unwrap_or(0.0)
}

impl Given {
    /// Numbers of the clean clip, `[frame][number]` flat, at this motion's ticks (Catmull-Rom).
    pub fn labels(&self, clean: &[f32], width: usize) -> Vec<f32> {
        let last = (clean.len() / width).saturating_sub(1);
        let mut labels = Vec::with_capacity(self.frames.len() * width);
        for &frame in &self.frames {
            let whole = (frame.floor() as usize).min(last);
            let t = (frame - whole as f64) as f32;
            let at = |step: isize| whole.saturating_add_signed(step).min(last) * width;
            let (t2, t3) = (t * t, t * t * t);
            let weights = [
                0.5 * (-t3 + 2.0 * t2 - t),
                0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
                0.5 * (-3.0 * t3 + 4.0 * t2 + t),
                0.5 * (t3 - t2),
            ];
            let starts = [at(-1), at(0), at(1), at(2)];
            for number in 0..width {
                let parts = weights.iter().zip(starts);
                labels.push(
                    parts
                        .map(|(weight, start)| weight * clean[start + number])
                        .sum(),
                );
            }
        }
        labels
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn swinging(seconds: f64) -> Clip {
        let frames = (0..(seconds * MODEL_RATE_HZ) as usize).map(|frame| {
            let t = frame as f64 / MODEL_RATE_HZ;
            let mut pose = Pose::REST;
            pose.root_translation_m.y = 0.06 * (9.0 * t).sin();
            for (joint, turn) in pose.parent_from_joint.iter_mut().enumerate().skip(1) {
                *turn = DQuat::from_rotation_x(0.3 * (5.0 * t + joint as f64).sin());
            }
            pose
        });
        Clip {
            name: "swinging".into(),
            rate_hz: MODEL_RATE_HZ,
            frames: frames.collect(),
        }
    }

    #[test]
    fn labels_belong_to_the_poses_that_were_given() {
        let clip = swinging(6.0);
        let clean: Vec<f32> = (clip.frames.iter())
            .flat_map(|pose| [pose.root_translation_m.y as f32, 1.0])
            .collect();
        let mut kinds = 0;
        for seed in 0..24 {
            let Some(given) = given(&clip, seed) else {
                continue;
            };
            kinds += 1;
            let labels = given.labels(&clean, 2);
            assert_eq!(labels.len(), 2 * given.motion.frames.len());
            assert!(
                given.motion.frames.len() > 300,
                "{}",
                given.motion.frames.len()
            );
            let mut squares = 0.0;
            let ticks = given.motion.frames.iter().enumerate().skip(60);
            for (tick, pose) in ticks {
                assert!((labels[2 * tick + 1] - 1.0).abs() < 1e-5);
                squares += (pose.root_translation_m.y - f64::from(labels[2 * tick])).powi(2);
            }
            let rms_m = (squares / (given.motion.frames.len() - 60) as f64).sqrt();
            let (source, told) = drawn(seed);
            // A tick amiss would be 6 mm.
            assert!(rms_m < 3e-3, "{source:?} {told:?}: {rms_m} m");
        }
        assert!(kinds > 16, "{kinds}");
        let still = given(&swinging(6.0), 3).map(|given| given.motion.frames.len());
        assert_eq!(
            still,
            given(&swinging(6.0), 3).map(|given| given.motion.frames.len())
        );
    }
}
