//! Motions whose pose is known at every instant.

use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_motion::Clip;
use glam::{DQuat, DVec3};

/// Frames to either side that the pose between two frames is made of.
const TAPS: i64 = 8;

/// A motion whose pose is known at every instant.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Name in tables.
    pub name: String,
    /// How long it is.
    pub seconds: f64,
    clip: Clip,
    /// Where in the clip it starts, in seconds.
    start: f64,
}

impl Truth {
    /// The first pose of a clip, held for so many seconds.
    pub fn still(name: &str, mut clip: Clip, seconds: f64) -> Self {
        clip.frames.truncate(1);
        Self {
            name: name.to_owned(),
            seconds,
            clip,
            start: 0.0,
        }
    }

    /// The middle `seconds` of a clip, or all of it where it is shorter.
    pub fn middle(name: String, mut clip: Clip, seconds: f64) -> Self {
        for frame in 1..clip.frames.len() {
            let (before, rest) = clip.frames.split_at_mut(frame);
            let rotations = rest[0].parent_from_joint.iter_mut();
            for (now, before) in rotations.zip(before[frame - 1].parent_from_joint) {
                if now.dot(before) < 0.0 {
                    *now = -*now;
                }
            }
        }
        // Files say 1 / 0.0166667 Hz.
        clip.rate_hz = clip.rate_hz.round();
        let start = (0.5 * (clip.duration_seconds() - seconds)).max(0.0);
        let start = (start * clip.rate_hz).floor() / clip.rate_hz;
        Self {
            seconds: seconds.min(clip.duration_seconds()),
            name,
            clip,
            start,
        }
    }

    /// The pose at `time`, which is that of the clip's frames at theirs and limited in band between
    /// them: a windowed sinc over root and quaternions.
    pub fn at(&self, time: f64) -> Pose {
        let position = (self.start + time) * self.clip.rate_hz;
        let frame = (position + 1e-6).floor();
        let part = position - frame;
        let last = self.clip.frames.len() as i64 - 1;
        let at = |index: i64| &self.clip.frames[(frame as i64 + index).clamp(0, last) as usize];
        if part.abs() < 2e-6 {
            return at(0).clone();
        }
        let mut pose = Pose::REST;
        let (mut root_m, mut sum) = (DVec3::ZERO, 0.0);
        let mut rotations = [DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0); JOINT_COUNT];
        for tap in 1 - TAPS..=TAPS {
            let x = std::f64::consts::PI * (part - tap as f64);
            let weight = x.sin() / x * (0.5 * x / TAPS as f64).cos().powi(2);
            sum += weight;
            root_m += weight * at(tap).root_translation_m;
            for (whole, part) in rotations.iter_mut().zip(at(tap).parent_from_joint) {
                *whole += part * weight;
            }
        }
        pose.root_translation_m = root_m / sum;
        pose.parent_from_joint = rotations.map(DQuat::normalize);
        pose
    }
}
