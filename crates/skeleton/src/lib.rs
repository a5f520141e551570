//! The skeleton of dynaskin: SMPL's joints, poses, forward kinematics, the causal kinematics
//! shared by the simulator and the networks' features, and blends of the joints' motions.
//!
//! Conventions: metres, radians, seconds; right-handed, +Y up, facing +Z, the body's left at +X.
//! A joint's rest frame is aligned with the model's axes.

mod dual_quat;
mod joint;
mod jumps;
mod kinematics;
mod limit;
mod pose;

pub use dual_quat::{DualQuat, Skinning};
pub use joint::{JOINT_COUNT, Joint};
pub use jumps::{
    CUT_ANGULAR_VELOCITY_CHANGE_RAD_S, CUT_VELOCITY_CHANGE_M_S, MAX_STEP_SECONDS,
    MIN_CUT_STEP_SECONDS,
};
pub use kinematics::{
    GRAVITY_M_S2, JointMotion, Kinematics, MODEL_RATE_HZ, Past, rotation_vector, second_difference,
};
pub use limit::{SoftLimit, soft_clip, soft_limited};
pub use pose::{Pose, WorldJoints};
