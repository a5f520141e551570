//! Checks of the poses that a host hands in.

use dynaskin_body::{Joint, Pose};

use crate::RuntimeError;

/// Farthest a body may stand from the origin, in metres: at a thousand kilometres, the single
/// precision of the surface is coarser than the body.
const MAX_TRANSLATION_M: f64 = 1e6;

/// Whether `pose` can be used.
///
/// # Errors
/// [`RuntimeError::InvalidPose`], naming the first part that cannot.
pub fn check(pose: &Pose) -> Result<(), RuntimeError> {
    let place = pose.root_translation_m;
    let near = place.is_finite() && place.abs().max_element() <= MAX_TRANSLATION_M;
    if near && pose.is_valid() {
        return Ok(());
    }
    let invalid = |place: &str, value: String| {
        Err(RuntimeError::InvalidPose {
            place: place.to_owned(),
            value,
        })
    };
    if !near {
        return invalid("root_translation_m", pose.root_translation_m.to_string());
    }
    for joint in Joint::ALL {
        let mut probe = Pose::REST;
        probe.parent_from_joint[joint as usize] = pose.parent_from_joint[joint as usize];
        if !probe.is_valid() {
            let value = pose.parent_from_joint[joint as usize].to_string();
            return invalid(joint.name(), value);
        }
    }
    Ok(())
}

/// `pose`, if it can be used, with quaternions of exactly unit length: forward kinematics would
/// scale bones by the deviation, and differences in time would see that as motion.
///
/// # Errors
/// [`RuntimeError::InvalidPose`].
pub fn checked(pose: &Pose) -> Result<Pose, RuntimeError> {
    check(pose)?;
    Ok(normalized(pose))
}

/// `pose` with quaternions of exactly unit length.
pub fn normalized(pose: &Pose) -> Pose {
    let mut pose = pose.clone();
    for rotation in &mut pose.parent_from_joint {
        *rotation = rotation.normalize();
    }
    pose
}
