//! Checks of the poses that a host hands in.

use dynaskin_body::{Joint, Pose};

use crate::RuntimeError;

/// Whether `pose` can be used.
///
/// # Errors
/// [`RuntimeError::InvalidPose`], naming the first part that cannot.
pub fn check(pose: &Pose) -> Result<(), RuntimeError> {
    if pose.is_valid() {
        return Ok(());
    }
    let invalid = |place: &str, value: String| {
        Err(RuntimeError::InvalidPose {
            place: place.to_owned(),
            value,
        })
    };
    if !pose.root_translation_m.is_finite() {
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
