//! A body's soft tissue on the skin of somebody else's avatar, as it is stored and played.
//!
//! `dynaskin-bind` finds a [`Binding`]: the bones that turn the body's joints, the body's shape under the
//! avatar's skin, and a row for each vertex that moves. Here is what a frame needs of it: [`Rig`] makes
//! the body's pose of the avatar's bones, [`Player`] the avatar's surface of the body's.

mod binding;
mod error;
mod file;
mod player;
mod report;
mod rig;
mod vertex_stage;

pub use binding::{Binding, Fingerprint, MeshBinding, Rows, fingerprint_of_body};
pub use binding::{fingerprint_of_mesh, row_turn};
pub use error::BindingError;
pub use file::BINDING_VERSION;
pub use player::{Change, Player, Surface};
pub use report::{CLOSE_M, MeshReport, Proportions, RegionOff, Report};
pub use rig::{Bone, Rig, SkinJoint, Turned, rotation_of};
pub use vertex_stage::{SOURCES_PER_LINE, VERTEX_NUMBERS};
