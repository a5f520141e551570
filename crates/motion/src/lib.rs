//! Motion clips for the body's skeleton: readers, procedural motions, retargeting and resampling;
//! and a body that is moved by hand.

#[cfg(feature = "amass")]
mod amass;
mod bvh;
mod clip;
mod error;
mod file;
mod glb;
mod interpolate;
mod nearest;
mod options;
mod other_kind;
mod procedural;
mod puppet;
mod retarget;

#[cfg(feature = "amass")]
pub use amass::Amass;
pub use bvh::{Bvh, BvhJoint, Channel, MAX_BVH_JOINTS, MAX_JOINT_CHANNELS};
pub use clip::{Clip, MAX_CLIP_FRAMES};
pub use dynaskin_skeleton::MODEL_RATE_HZ;
pub use error::MotionError;
pub use file::{FileClip, MotionFile};
pub use glb::{AnimationInfo, GltfMotion};
pub use options::{AnimationChoice, ReadOptions, UpAxis, find_named};
pub use procedural::{Procedural, ProceduralKind};
pub use puppet::{Grip, Puppet};
pub use retarget::{
    Drive, JointReport, LengthUnit, Mapping, SourceMotion, World, retarget, retarget_watched,
};
