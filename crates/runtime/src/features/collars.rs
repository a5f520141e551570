//! Collars that turn, as features.

use dynaskin_skeleton::{Joint, Pose};

/// Each collar and the shoulder that it carries.
const SIDES: [[Joint; 2]; 2] = [
    [Joint::LeftCollar, Joint::LeftShoulder],
    [Joint::RightCollar, Joint::RightShoulder],
];

/// `pose` with the shoulders' rotations counted from the trunk. The collars keep theirs.
///
/// Where an upper arm points tells most about its tissue, and rigs differ in how collar and shoulder share
/// it. What the collar does besides draws the skin of arms and chest.
pub(super) fn arms_against_trunk(mut pose: Pose) -> Pose {
    for [collar, shoulder] in SIDES {
        let [trunk_from_collar, collar_from_arm] =
            [collar, shoulder].map(|joint| pose.parent_from_joint[joint as usize]);
        pose.parent_from_joint[shoulder as usize] =
            (trunk_from_collar * collar_from_arm).normalize();
    }
    pose
}

/// The same with the collars at rest, for networks that learned from collars that keep still: the same
/// movement of an arm gives the same features, however a rig shares it.
pub(super) fn folded(pose: Pose) -> Pose {
    let mut pose = arms_against_trunk(pose);
    for [collar, _] in SIDES {
        pose.parent_from_joint[collar as usize] = glam::DQuat::IDENTITY;
    }
    pose
}
