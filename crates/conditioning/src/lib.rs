//! Poses as they come: held over several frames of the display, late, early, and with noise.
//!
//! Tissue is driven by second differences of poses, so a pose that is shown twice is a stop and a
//! blow. A [`Conditioner`] stands between a host and the tissue's clock. It notices poses that
//! repeat and finds the interval at which the source makes new ones. It places every pose on that
//! clock and gives the pose at a playhead that runs evenly behind it. Where every frame brings a new
//! pose nothing is changed, to the bit.

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
