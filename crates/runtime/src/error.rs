//! The runtime's errors.

use thiserror::Error;

/// What can go wrong when a bundle is loaded or an avatar is stepped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RuntimeError {
    /// A clip whose features were asked for is not at the model's rate.
    #[error("clip `{name}` is at {got_hz} Hz; features need 60 Hz, so resample the clip first")]
    ClipRate {
        /// The clip's name.
        name: String,
        /// The clip's rate.
        got_hz: f64,
    },
    /// A pose holds NaN, an infinite number, or a quaternion that is not of unit length.
    #[error(
        "the pose's {place} is {value}; every number must be finite and every quaternion of unit \
         length (within 0.001), so normalise quaternions before handing them over"
    )]
    InvalidPose {
        /// The part of the pose: `root_translation_m` or a joint's name.
        place: String,
        /// What stands there.
        value: String,
    },
}

impl RuntimeError {
    /// A stable kebab-case name of the kind of error, as the SDK's `error.code` carries it.
    pub fn code(&self) -> &'static str {
        match self {
            Self::ClipRate { .. } => "clip-rate",
            Self::InvalidPose { .. } => "invalid-pose",
        }
    }
}
