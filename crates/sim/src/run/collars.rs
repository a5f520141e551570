//! The same motion on rigs whose collars turn.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use dynaskin_motion::Clip;
use glam::{DQuat, DVec3, Vec3};

/// What a rig lets collars (clavicles) do of what the arms do.
///
/// The skeleton of the CMU captures keeps its collars still and turns the whole arm at the shoulder.
/// Mixamo's, VRM's, SMPL's and Xsens's share the raise and the swing of an arm between both joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollarHabit {
    /// The collar's share of the swing that brings the upper arm from straight sideways to where it is.
    pub share: f64,
    /// By how much collars are lowered besides, in radians.
    pub lowered: f64,
}

/// Each collar, its shoulder, the elbow after it, and which way is sideways.
const SIDES: [(Joint, Joint, Joint, DVec3); 2] = [
    (
        Joint::LeftCollar,
        Joint::LeftShoulder,
        Joint::LeftElbow,
        DVec3::X,
    ),
    (
        Joint::RightCollar,
        Joint::RightShoulder,
        Joint::RightElbow,
        DVec3::NEG_X,
    ),
];

impl CollarHabit {
    /// `clip` on a rig of this habit. The upper arms turn against the trunk as before, and the shoulder
    /// joints move with the collars. `joints_rest_m` are the rest joints of the clip's body, metres.
    pub fn applied(&self, clip: &Clip, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        Clip {
            frames: clip
                .frames
                .iter()
                .map(|pose| self.pose(pose, joints_rest_m))
                .collect(),
            ..clip.clone()
        }
    }

    fn pose(&self, pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Pose {
        let mut turned = pose.clone();
        for (collar, shoulder, elbow, sideways) in SIDES {
            let at = |joint: Joint| joints_rest_m[joint as usize].as_dvec3();
            let local = |joint: Joint| pose.parent_from_joint[joint as usize];
            let trunk_from_arm = local(collar) * local(shoulder);
            let arm = trunk_from_arm * (at(elbow) - at(shoulder)).normalize_or(sideways);
            let swing = DQuat::from_rotation_arc(sideways, arm.normalize());
            let lowered = DQuat::from_rotation_z(-self.lowered * sideways.x);
            let trunk_from_collar = lowered * DQuat::IDENTITY.slerp(swing, self.share);
            turned.parent_from_joint[collar as usize] = trunk_from_collar;
            turned.parent_from_joint[shoulder as usize] =
                (trunk_from_collar.conjugate() * trunk_from_arm).normalize();
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collars_take_their_share_and_arms_turn_as_before() {
        let mut joints_rest_m = [Vec3::ZERO; JOINT_COUNT];
        joints_rest_m[Joint::LeftShoulder as usize] = Vec3::new(0.2, 1.4, 0.0);
        joints_rest_m[Joint::LeftElbow as usize] = Vec3::new(0.4, 1.2, 0.0);
        joints_rest_m[Joint::RightShoulder as usize] = Vec3::new(-0.2, 1.4, 0.0);
        joints_rest_m[Joint::RightElbow as usize] = Vec3::new(-0.4, 1.2, 0.0);
        let habit = CollarHabit {
            share: 0.3,
            lowered: 0.1,
        };
        let rest = habit.pose(&Pose::REST, &joints_rest_m);
        // The arm hangs 45 degrees below sideways: 0.3 of that and the rest of the lowering.
        for (collar, side) in [(Joint::LeftCollar, 1.0), (Joint::RightCollar, -1.0)] {
            let expected = -side * (0.3 * std::f64::consts::FRAC_PI_4 + 0.1);
            let turn = rest.parent_from_joint[collar as usize].to_scaled_axis();
            assert!((turn - DVec3::Z * expected).length() < 1e-6, "{turn}");
        }
        for (collar, shoulder, ..) in SIDES {
            let both =
                rest.parent_from_joint[collar as usize] * rest.parent_from_joint[shoulder as usize];
            assert!(both.angle_between(DQuat::IDENTITY) < 1e-6);
        }
    }
}
