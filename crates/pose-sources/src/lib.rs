//! Simulated pose sources as pages receive them: held over frames of the display, late, jittered, noisy.
//!
//! A [`Truth`] is a motion whose pose is known at every instant. A [`Source`] plays it as a tracker, a network,
//! a file or a page's own animation would. Benches and training use them.

mod source;
mod truth;

pub use source::{Frame, Made, Noise, Source, Steps};
pub use truth::Truth;
