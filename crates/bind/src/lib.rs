//! Binds a body's soft tissue to the skin of somebody else's avatar: no painting, no list of bones.
//!
//! An [`Avatar`] (from a GLB or VRM file, or from an engine's arrays) and a body give a [`Binding`]: the
//! bones that turn the body's joints, the body's shape under the avatar's skin, and a row for each vertex
//! that moves. `docs/own-avatar.md` of the repository tells how.

mod align;
mod avatar;
mod basis;
mod bind;
mod bind_pose;
mod binding;
mod bones;
mod correspond;
mod drape;
mod error;
mod file;
mod fit;
mod gltf;
mod inpaint;
mod limbs;
mod nameless;
mod parts;
mod proportions;
mod report;
mod rig;
mod rows;
mod samples;
mod skin;
mod surface;

pub use avatar::{Avatar, Influences, MAX_INFLUENCES, MAX_VERTICES, Node, SkinnedMesh};
pub use bind::{BindOptions, Bound, bind};
pub use binding::{Binding, Fingerprint, MeshBinding, Rows};
pub use dynaskin_skeleton::{JOINT_COUNT, Joint};
pub use error::BindError;
pub use file::BINDING_VERSION;
pub use proportions::{
    GUARDED_CROWN_TO_SHOULDER, LEAST_HIP_HEIGHT, LEAST_STATURE_M, MOST_CROWN_TO_SHOULDER,
    Proportions,
};
pub use report::{CLOSE_M, MeshReport, RegionOff, Report};
pub use rig::{Bone, Rig, Turned};
