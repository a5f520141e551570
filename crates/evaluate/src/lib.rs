//! Evaluation of trained networks: writes bundles with their model card, measures them on clips that they
//! were not trained on, and compares them with each other.
//!
//! Everything here plays the exported files through the runtime and knows methods only by name.

mod bundle;
mod card;
mod facts;
mod linear;
mod method;
mod placement;
mod player;
mod report;
pub mod study;

pub use bundle::{BundleParts, write_bundle};
pub use card::model_card;
pub use facts::TrainingFacts;
pub use linear::LinearDecoder;
pub use method::Method;
pub use placement::{Placement, PlacementErrors, evaluate_placements};
pub use player::Player;
pub use report::{Errors, Report, SetReport, evaluate};
