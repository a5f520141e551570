//! A motion of the body's skeleton at a fixed frame rate.

use dynaskin_body::{Joint, Pose};
use glam::{DQuat, DVec3};

use crate::MotionError;

/// The rate at which simulator, training and runtime tick, in hertz.
pub const MODEL_RATE_HZ: f64 = 60.0;

/// Largest number of frames of a clip: more than two hours at 60 Hz, about 400 MB of poses.
pub const MAX_CLIP_FRAMES: usize = 500_000;

/// Poses at equal time steps.
#[derive(Clone, Debug)]
pub struct Clip {
    /// Name for people and files, such as `jump` or `16_04`.
    pub name: String,
    /// Frames per second, finite and above 0.
    pub rate_hz: f64,
    /// The poses, at least one.
    pub frames: Vec<Pose>,
}

impl Clip {
    /// Time from the first to the last frame in seconds.
    pub fn duration_seconds(&self) -> f64 {
        (self.frames.len().saturating_sub(1)) as f64 / self.rate_hz
    }

    /// The pose at `time_seconds` after the first frame, interpolated; clamped to the clip's ends.
    /// A clip without frames, which none of this crate's functions makes, rests.
    pub fn pose_at(&self, time_seconds: f64) -> Pose {
        let Some(last) = self.frames.len().checked_sub(1) else {
            return Pose::REST;
        };
        let position = (time_seconds * self.rate_hz).clamp(0.0, last as f64);
        let before = (position.floor() as usize).min(last);
        let after = (before + 1).min(last);
        self.frames[before].interpolated(&self.frames[after], position - before as f64)
    }

    /// The same motion at `rate_hz`: translations interpolated linearly, rotations by slerp.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a rate outside 1 to 1000 Hz, [`MotionError::EmptyClip`],
    /// [`MotionError::TooLong`].
    pub fn resampled(&self, rate_hz: f64) -> Result<Self, MotionError> {
        check_range("rate_hz", rate_hz, 1.0, 1000.0)?;
        self.sampled(rate_hz, 1.0)
    }

    /// The same motion `speed` times as fast, at the clip's own rate.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a speed outside 0.05 to 20, [`MotionError::EmptyClip`],
    /// [`MotionError::TooLong`].
    pub fn time_scaled(&self, speed: f64) -> Result<Self, MotionError> {
        check_range("speed", speed, 0.05, 20.0)?;
        self.sampled(self.rate_hz, speed)
    }

    fn sampled(&self, rate_hz: f64, speed: f64) -> Result<Self, MotionError> {
        if self.frames.is_empty() {
            return Err(MotionError::EmptyClip);
        }
        check_range("rate_hz of the clip", self.rate_hz, 1e-3, 1e5)?;
        // The last sample must not lie beyond the clip's end; rounding must not lose a frame that
        // falls exactly on it.
        let steps = (self.duration_seconds() / speed * rate_hz + 1e-6).floor();
        if steps >= MAX_CLIP_FRAMES as f64 {
            return Err(MotionError::TooLong {
                frames: steps + 1.0,
                limit: MAX_CLIP_FRAMES,
            });
        }
        Ok(Self {
            name: self.name.clone(),
            rate_hz,
            frames: (0..=steps as usize)
                .map(|frame| self.pose_at(frame as f64 / rate_hz * speed))
                .collect(),
        })
    }

    /// The motion of the mirror image (x to -x), left and right exchanged.
    pub fn mirrored(&self) -> Self {
        Self {
            name: self.name.clone(),
            rate_hz: self.rate_hz,
            frames: self.frames.iter().map(mirrored_pose).collect(),
        }
    }
}

fn mirrored_pose(pose: &Pose) -> Pose {
    let mut mirrored = Pose::REST;
    mirrored.root_translation_m = pose.root_translation_m * DVec3::new(-1.0, 1.0, 1.0);
    for joint in Joint::ALL {
        // A reflection keeps the axis component along its normal and turns the sense around.
        let q = pose.parent_from_joint[joint.mirrored() as usize];
        mirrored.parent_from_joint[joint as usize] = DQuat::from_xyzw(q.x, -q.y, -q.z, q.w);
    }
    mirrored
}

/// Refuses a parameter outside `low..=high` and NaN.
pub fn check_range(name: &'static str, got: f64, low: f64, high: f64) -> Result<(), MotionError> {
    if (low..=high).contains(&got) {
        Ok(())
    } else {
        Err(MotionError::Parameter {
            name,
            got,
            expected: format!("between {low} and {high}"),
        })
    }
}
