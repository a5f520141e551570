//! A pose of the skeleton, and forward kinematics.

use glam::{DQuat, DVec3, Vec3};

use crate::joint::{JOINT_COUNT, Joint};

/// A pose of the skeleton at one instant.
///
/// Double precision, because the runtime's features are second differences in time: at ten metres
/// from the origin, single precision alone would add noise of 0.01 m/s².
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// World translation in metres, added after posing about the rest-pose pelvis (SMPL's
    /// `trans`): the pelvis stands at `joints_rest_m[0] + root_translation_m`.
    pub root_translation_m: DVec3,
    /// Rotation of each joint relative to its parent (for the pelvis: to the world), unit
    /// quaternions; identity is the rest pose.
    pub parent_from_joint: [DQuat; JOINT_COUNT],
}

impl Pose {
    /// The rest pose at the origin.
    pub const REST: Self = Self {
        root_translation_m: DVec3::ZERO,
        parent_from_joint: [DQuat::IDENTITY; JOINT_COUNT],
    };

    /// Forward kinematics over the rest joint positions of one shape (metres, model space).
    pub fn world_joints(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> WorldJoints {
        let mut world = WorldJoints {
            rotation: [DQuat::IDENTITY; JOINT_COUNT],
            position_m: [DVec3::ZERO; JOINT_COUNT],
        };
        for joint in Joint::ALL {
            let idx = joint as usize;
            let rest_m = joints_rest_m[idx].as_dvec3();
            let local = self.parent_from_joint[idx];
            match joint.parent() {
                None => {
                    world.rotation[idx] = local;
                    world.position_m[idx] = rest_m + self.root_translation_m;
                }
                Some(parent) => {
                    let parent_idx = parent as usize;
                    let bone_m = rest_m - joints_rest_m[parent_idx].as_dvec3();
                    world.rotation[idx] = world.rotation[parent_idx] * local;
                    world.position_m[idx] =
                        world.position_m[parent_idx] + world.rotation[parent_idx] * bone_m;
                }
            }
        }
        world
    }

    /// Whether every number is finite and every quaternion has unit length within 1e-3.
    pub fn is_valid(&self) -> bool {
        self.root_translation_m.is_finite()
            && self
                .parent_from_joint
                .iter()
                .all(|q| q.is_finite() && (q.length_squared() - 1.0).abs() < 2e-3)
    }

    /// The pose between `self` (`t` = 0) and `other` (`t` = 1): translation linear, rotations slerped.
    pub fn interpolated(&self, other: &Self, t: f64) -> Self {
        let mut pose = Self::REST;
        pose.root_translation_m = self.root_translation_m.lerp(other.root_translation_m, t);
        for idx in 0..JOINT_COUNT {
            pose.parent_from_joint[idx] = self.parent_from_joint[idx]
                .slerp(other.parent_from_joint[idx], t)
                .normalize();
        }
        pose
    }
}

/// Joint frames in the world: `world_from_joint[j]` is a rotation by `rotation[j]` and a
/// translation to `position_m[j]`.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldJoints {
    /// World rotation of each joint.
    pub rotation: [DQuat; JOINT_COUNT],
    /// World position of each joint in metres.
    pub position_m: [DVec3; JOINT_COUNT],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_pelvis_carries_the_knee() {
        let mut joints_rest_m = [Vec3::ZERO; JOINT_COUNT];
        joints_rest_m[0] = Vec3::Y;
        joints_rest_m[1] = Vec3::new(0.1, 1.0, 0.0);
        joints_rest_m[4] = Vec3::new(0.1, 0.5, 0.0);
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::new(10.0, 0.0, 0.0);
        pose.parent_from_joint[0] = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let world = pose.world_joints(&joints_rest_m);
        // A quarter turn about +Y takes +X to -Z.
        assert!((world.position_m[4] - DVec3::new(10.0, 0.5, -0.1)).length() < 1e-7);
    }
}
