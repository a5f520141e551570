//! The run time of dynaskin: a skeleton's motion in, offsets of the soft tissue out.

mod error;
pub mod features;
mod pose;

pub use error::RuntimeError;
