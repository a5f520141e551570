//! Conditions poses that are held over several frames of the display, late, early, or noisy.
//!
//! Tissue is driven by second differences of poses, so a pose that is shown twice acts as a stop and a
//! jolt. A [`Conditioner`] stands between a host and the tissue's clock. It detects poses that
//! repeat and estimates the interval at which the source makes new ones. It places every pose on that
//! clock and returns the pose at a playhead that moves evenly behind it. If every frame brings a new
//! pose, poses pass through unchanged, bit for bit.

mod clock;
mod conditioner;
mod cut;
mod diagnosis;
mod frames;
mod path;
mod skips;
mod smoother;
mod source;

pub use conditioner::{Conditioned, Conditioner};
pub use cut::{SNAP_JOINTS_SHARE, SNAP_TURN_RAD_S, START_RAD_S, Suddenness};
pub use diagnosis::Diagnosis;
pub use source::PoseSource;
