//! Clothes that are painted on a body's surface: how a painter's two colours are told apart, where their hem runs,
//! and how cloth spans what is under it.
//!
//! Surfaces are arrays: no file, no body model, no graphics card. Positions are metres in the rest pose.

mod drape;
pub mod hem;
mod pocket;
mod tones;

pub use drape::Drape;
pub use tones::Tones;
