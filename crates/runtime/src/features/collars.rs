//! Collars that turn, as the tissue is told of them.

use dynaskin_skeleton::{Joint, Pose};

/// Each collar and the shoulder that it carries.
const SIDES: [[Joint; 2]; 2] = [
    [Joint::LeftCollar, Joint::LeftShoulder],
    [Joint::RightCollar, Joint::RightShoulder],
];

/// `pose` with its collars at rest and their turn added to the shoulders', so that the upper arms turn
/// against the trunk as before.
///
/// Rigs differ in how collar and shoulder share an arm's movement, and the same movement has to give the
/// same features: captures that networks learn from do it all at the shoulder. Soft tissue depends little on
/// the sharing: with both collars lowered by 40 degrees a simulated chest lies 0.8 mm elsewhere.
pub(super) fn folded(mut pose: Pose) -> Pose {
    for [collar, shoulder] in SIDES {
        let [trunk_from_collar, collar_from_arm] =
            [collar, shoulder].map(|joint| pose.parent_from_joint[joint as usize]);
        pose.parent_from_joint[shoulder as usize] =
            (trunk_from_collar * collar_from_arm).normalize();
        pose.parent_from_joint[collar as usize] = glam::DQuat::IDENTITY;
    }
    pose
}
