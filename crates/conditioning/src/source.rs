//! What is known of a source beforehand.

use crate::smoother::Tuning;

/// Where poses come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// The page's own animation, or poses held over several frames of the display. Where every frame
    /// brings a new pose nothing is changed; poses that repeat are put on their source's clock,
    /// one of its intervals late.
    #[default]
    Display,
    /// A tracker of bodies, such as a webcam's: noise is taken off, which costs two intervals.
    Tracker,
    /// Poses from a network: evened out over what its jitter needs, noise left alone.
    Network,
    /// Nothing is conditioned: every pose is taken as one that is new, at the time its step says.
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
