//! A motion of the body's skeleton at a fixed frame rate.

use dynaskin_body::Pose;

/// The rate at which simulator, training and runtime tick, in hertz.
pub const MODEL_RATE_HZ: f64 = 60.0;

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
    pub fn pose_at(&self, time_seconds: f64) -> Pose {
        let last = self.frames.len() - 1;
        let position = (time_seconds * self.rate_hz).clamp(0.0, last as f64);
        let before = (position.floor() as usize).min(last);
        let after = (before + 1).min(last);
        self.frames[before].interpolated(&self.frames[after], position - before as f64)
    }
}
