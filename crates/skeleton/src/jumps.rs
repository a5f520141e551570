//! Limits beyond which a change between two poses is a cut, or a time step a stall.
//!
//! The clock of the tissue and the conditioner before it share them.

/// Longest time step whose ticks are run, in seconds: 15 ticks. A longer one is a stall (hidden
/// tab, debugger), after which the tissue starts settled.
pub const MAX_STEP_SECONDS: f64 = 0.25;

/// Change of the root's velocity (m/s) from one step to the next that counts as a cut. A change
/// and not the velocity itself, so that riding a fast vehicle is no cut. The largest change in
/// 170 captured clips of sport and dance (CMU, 60 Hz) is 3.6 m/s.
pub const CUT_VELOCITY_CHANGE_M_S: f64 = 8.0;

/// Change of a joint's angular velocity (rad/s) from one step to the next that counts as a cut.
/// The largest in those clips is 52 rad/s, of a shoulder.
pub const CUT_ANGULAR_VELOCITY_CHANGE_RAD_S: f64 = 60.0;

/// Shortest step over which velocities are judged, in seconds: hosts report steps of almost zero.
pub const MIN_CUT_STEP_SECONDS: f64 = 1.0 / 240.0;
