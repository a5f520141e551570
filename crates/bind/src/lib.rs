//! Binds a body's soft tissue to the skin of somebody else's avatar, without painting or a list of bones.
//!
//! From an [`Avatar`] (a GLB or VRM file, or an engine's arrays) and a body it makes a [`Binding`]: the
//! bones that drive the body's joints, the body's shape under the avatar's skin, and a row for each vertex
//! that moves. See `docs/own-avatar.md` in the repository.

mod align;
mod avatar;
mod basis;
mod bind;
mod bind_pose;
mod bones;
mod correspond;
mod double_motion;
mod drape;
mod engine;
mod error;
mod fit;
mod gltf;
mod inpaint;
mod limbs;
mod matched;
mod nameless;
mod parts;
mod proportions;
mod rig;
mod rows;
mod samples;
mod skin;
mod surface;
mod transfer;

pub use avatar::{Avatar, Influences, MAX_INFLUENCES, MAX_VERTICES, Node, SkinnedMesh};
pub use bind::{BindOptions, Bound, bind, bind_watched};
pub use dynaskin_binding::{
    BINDING_VERSION, Binding, BindingError, Bone, CLOSE_M, Fingerprint, MeshBinding, MeshReport,
    Player, Proportions, RegionOff, Report, Rig, Rows, SkinJoint, Surface, Turned,
};
pub use dynaskin_skeleton::{JOINT_COUNT, Joint};
pub use engine::EngineMesh;
pub use error::BindError;
pub use proportions::{
    GUARDED_CROWN_TO_SHOULDER, LEAST_HIP_HEIGHT, LEAST_STATURE_M, MOST_CROWN_TO_SHOULDER,
};
pub use transfer::{Transfer, check_adult, transfer};
