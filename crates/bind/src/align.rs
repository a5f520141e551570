//! Rotations that bring the body's bones into the pose in which an avatar was bound.
//!
//! World rotations by joint: pelvis, trunk and head by the yaw from hip to hip, limbs by the smallest
//! swing onto the avatar's bones, down the chain. No bone's axes are needed, and T-pose and A-pose are alike.

use dynaskin_skeleton::{JOINT_COUNT, Joint};
use glam::{DQuat, DVec3, Vec3};

use crate::bones::Bones;

/// The bones that are swung onto the avatar's: a joint and the next one of its limb, left.
const SWUNG: [(Joint, Joint); 4] = [
    (Joint::LeftShoulder, Joint::LeftElbow),
    (Joint::LeftElbow, Joint::LeftWrist),
    (Joint::LeftHip, Joint::LeftKnee),
    (Joint::LeftKnee, Joint::LeftAnkle),
];

/// Rotations `avatar_from_body[joint]`, from the body's rest pose to the avatar's bind pose.
pub fn alignment(bones: &Bones, body_joints_m: &[Vec3; JOINT_COUNT]) -> [DQuat; JOINT_COUNT] {
    let yaw = DQuat::from_rotation_arc(DVec3::X, bones.left());
    // Half a turn has no shortest arc: about the way up.
    let yaw = if bones.left().x < -0.999_999 {
        DQuat::from_rotation_y(std::f64::consts::PI)
    } else {
        yaw
    };
    let mut turns = [yaw; JOINT_COUNT];
    for joint in Joint::ALL {
        let Some(parent) = joint.parent() else {
            continue;
        };
        let inherited = turns[parent as usize];
        turns[joint as usize] = match next_of(joint) {
            Some(next) => {
                let rest = body_joints_m[next as usize] - body_joints_m[joint as usize];
                let bone = bones.place_m(joint).zip(bones.place_m(next));
                let bone = bone
                    .map(|(from, to)| to - from)
                    .and_then(DVec3::try_normalize);
                let rest = (inherited * rest.as_dvec3()).try_normalize();
                match rest.zip(bone) {
                    Some((rest, bone)) => DQuat::from_rotation_arc(rest, bone) * inherited,
                    None => inherited,
                }
            }
            // Soles stand on the floor whatever way the shins lean.
            None if matches!(joint, Joint::LeftAnkle | Joint::RightAnkle) => yaw,
            None => inherited,
        };
    }
    turns
}

/// The joint at the end of a bone that is swung.
fn next_of(joint: Joint) -> Option<Joint> {
    SWUNG.into_iter().find_map(|(from, to)| {
        if joint == from {
            Some(to)
        } else {
            (joint == from.mirrored()).then(|| to.mirrored())
        }
    })
}
