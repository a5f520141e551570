//! What trained networks are worth: bundles written with their model card, measured on clips that they
//! have not learned from, and compared with each other.
//!
//! Everything here plays the exported files through the runtime and knows no method but by name.

mod bundle;
mod card;
mod method;
mod placement;
mod player;
mod report;
pub mod study;

pub use bundle::{BundleParts, TrainingFacts, write_bundle};
pub use card::model_card;
pub use method::Method;
pub use placement::{Placement, PlacementErrors, evaluate_placements};
pub use player::Player;
pub use report::{Errors, LinearDecoder, Report, SetReport, evaluate};
