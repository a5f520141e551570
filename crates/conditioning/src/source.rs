//! The presets of pose sources.

use crate::smoother::Tuning;

/// Where poses come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// The page's own animation, or poses held over several frames of the display. If every frame
    /// brings a new pose nothing is changed; repeated poses are resampled to their source's clock,
    /// with a latency of one of its intervals.
    #[default]
    Display,
    /// A body tracker, such as a webcam: noise is removed, with a latency of one and a half intervals.
    Tracker,
    /// Poses from a network: evened out with a latency of one interval and the jitter; noise is not removed.
    Network,
    /// Nothing is conditioned: every pose counts as new, at the time of its step.
    AsGiven,
}

impl PoseSource {
    pub(crate) fn tuning(self) -> Option<Tuning> {
        match self {
            Self::Tracker => Some(Tuning {
                root_noise_m_rad: 0.23,
                joint_noise_rad: (0.02_f64.to_radians(), 0.8_f64.to_radians()),
                stillness: 1.0,
                lag: 0.44,
                alertness: 0.35,
                trust: 1.0,
            }),
            Self::Display | Self::Network | Self::AsGiven => None,
        }
    }

    pub(crate) fn lag(self) -> f64 {
        self.tuning().map_or(0.0, |tuning| tuning.lag)
    }
}
