//! Binds a body's soft tissue to the skin of somebody else's avatar.

mod align;
mod avatar;
mod basis;
mod bind_pose;
mod bones;
mod error;
mod fit;
mod gltf;
mod limbs;
mod nameless;
mod parts;
mod proportions;
mod samples;
mod skin;
mod surface;

pub use avatar::{Avatar, Influences, MAX_INFLUENCES, MAX_VERTICES, Node, SkinnedMesh};
pub use dynaskin_skeleton::{JOINT_COUNT, Joint};
pub use error::BindError;
pub use proportions::Proportions;
