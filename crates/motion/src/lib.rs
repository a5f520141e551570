//! Motion clips for the body's skeleton: readers, procedural test motions, retargeting, resampling.

mod clip;

pub use clip::{Clip, MODEL_RATE_HZ};
