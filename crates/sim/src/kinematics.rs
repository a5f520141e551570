//! The causal drive: what a pose sequence does to tissue, from poses up to now only
//! (ARCHITECTURE, "Causal kinematics").

use dynaskin_body::SkinWeights;
use dynaskin_skeleton::{GRAVITY_M_S2, JOINT_COUNT, Past, Pose, second_difference};
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};

/// Per joint an affine map of rest positions: `x = linear * rest + offset`.
#[derive(Clone, Debug)]
struct JointMaps {
    linear: [DMat3; JOINT_COUNT],
    offset_m: [DVec3; JOINT_COUNT],
}

impl JointMaps {
    fn new(pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Self {
        let world = pose.world_joints(joints_rest_m);
        let linear = world.rotation.map(DMat3::from_quat);
        let offset_m = std::array::from_fn(|joint| {
            world.position_m[joint] - linear[joint] * joints_rest_m[joint].as_dvec3()
        });
        Self { linear, offset_m }
    }
}

/// The motion of every joint at one tick, in single precision for the vertices.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// World rotation of each joint.
    pub rotation: [Quat; JOINT_COUNT],
    /// The same as matrices.
    pub linear: [Mat3; JOINT_COUNT],
    /// Offset of each joint's affine map in metres, relative to the pelvis's place.
    offset_m: [Vec3; JOINT_COUNT],
    /// Second time derivative of the joint's affine map, linear part (1/s²).
    linear_accel: [Mat3; JOINT_COUNT],
    /// Second time derivative of the joint's affine map, offset (m/s²).
    offset_accel: [Vec3; JOINT_COUNT],
}

impl Drive {
    /// Acceleration in m/s² of a rest position carried by linear blend skinning. Skinning is linear
    /// in the joints' maps, so this equals the second difference of the skinned positions, and
    /// differencing 24 maps in double precision costs less than differencing every vertex.
    pub fn acceleration_m_per_s2(&self, skin: &SkinWeights, rest_m: Vec3) -> Vec3 {
        weighted(skin, |joint| {
            self.linear_accel[joint] * rest_m + self.offset_accel[joint]
        })
    }

    /// By how much gravity in the tissue's own frame differs from the rest pose, as an acceleration
    /// in the world: `g - R g`. Exactly 0 for the rest orientation.
    pub fn gravity_change_m_per_s2(&self, skin: &SkinWeights) -> Vec3 {
        let down = Vec3::new(0.0, -GRAVITY_M_S2 as f32, 0.0);
        weighted(skin, |joint| down - self.linear[joint] * down)
    }

    /// Where linear blend skinning puts a rest position, in world axes relative to the pelvis, in
    /// metres.
    pub fn skinned_m(&self, skin: &SkinWeights, rest_m: Vec3) -> Vec3 {
        weighted(skin, |joint| {
            self.linear[joint] * rest_m + self.offset_m[joint]
        })
    }

    /// Linear part of the blended skinning matrix.
    pub fn blended_linear(&self, skin: &SkinWeights) -> Mat3 {
        let mut sum = Mat3::ZERO;
        for (joint, weight) in skin.joints.iter().zip(skin.weights) {
            sum += self.linear[usize::from(*joint)] * weight;
        }
        sum
    }

    /// Blended rotation: the weighted mean of the joints' quaternions, normalised.
    pub fn blended_rotation(&self, skin: &SkinWeights) -> Quat {
        let pivot = self.rotation[usize::from(skin.joints[0])];
        let mut sum = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        for (joint, weight) in skin.joints.iter().zip(skin.weights) {
            let rotation = self.rotation[usize::from(*joint)];
            // q and -q are the same rotation: add the one nearer to the pivot.
            let sign = if rotation.dot(pivot) < 0.0 { -1.0 } else { 1.0 };
            sum += rotation * (sign * weight);
        }
        if sum.length_squared() > 1e-12 {
            sum.normalize()
        } else {
            pivot
        }
    }
}

fn weighted(skin: &SkinWeights, value: impl Fn(usize) -> Vec3) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (joint, weight) in skin.joints.iter().zip(skin.weights) {
        if weight > 0.0 {
            sum += value(usize::from(*joint)) * weight;
        }
    }
    sum
}

/// The last poses, from which accelerations are backward differences.
#[derive(Clone, Debug)]
pub(crate) struct Kinematics {
    joints_rest_m: [Vec3; JOINT_COUNT],
    rate_hz: f64,
    /// The last two poses' maps.
    past: Past<JointMaps>,
}

impl Kinematics {
    pub fn new(joints_rest_m: [Vec3; JOINT_COUNT], rate_hz: f64) -> Self {
        Self {
            joints_rest_m,
            rate_hz,
            past: Past::default(),
        }
    }

    /// Takes the pose of the next tick. Accelerations are 0 until three poses are known.
    pub fn push(&mut self, pose: &Pose) -> Drive {
        let now = JointMaps::new(pose, &self.joints_rest_m);
        let mut linear_accel = [Mat3::ZERO; JOINT_COUNT];
        let mut offset_accel = [Vec3::ZERO; JOINT_COUNT];
        if let Some((before, earlier)) = self.past.both() {
            let rate2 = self.rate_hz * self.rate_hz;
            for joint in 0..JOINT_COUNT {
                let linear = second_difference(
                    now.linear[joint],
                    before.linear[joint],
                    earlier.linear[joint],
                );
                let offset = second_difference(
                    now.offset_m[joint],
                    before.offset_m[joint],
                    earlier.offset_m[joint],
                );
                linear_accel[joint] = (linear * rate2).as_mat3();
                offset_accel[joint] = (offset * rate2).as_vec3();
            }
        }
        let world = pose.world_joints(&self.joints_rest_m);
        let drive = Drive {
            rotation: world.rotation.map(|q| q.as_quat()),
            linear: now.linear.map(|m| m.as_mat3()),
            offset_m: now
                .offset_m
                .map(|offset| (offset - world.position_m[0]).as_vec3()),
            linear_accel,
            offset_accel,
        };
        self.past.push(now);
        drive
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acceleration_is_the_second_difference_of_skinned_positions() {
        let joints_rest_m = std::array::from_fn(|k| Vec3::new(0.0, 0.1 * k as f32, 0.0));
        let skin = SkinWeights {
            joints: [2, 5, 0, 0],
            weights: [0.7, 0.3, 0.0, 0.0],
        };
        let rest_m = Vec3::new(0.1, 0.4, 0.05);
        let mut kinematics = Kinematics::new(joints_rest_m, 60.0);
        let mut positions = Vec::new();
        let mut drives = Vec::new();
        for k in 0..4 {
            let mut pose = Pose::REST;
            pose.root_translation_m.x = 9.0 + (f64::from(k) * 0.2).sin();
            pose.parent_from_joint[2] = glam::DQuat::from_rotation_x(0.1 * f64::from(k * k));
            let maps = JointMaps::new(&pose, &joints_rest_m);
            let mut position = DVec3::ZERO;
            for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                let joint = usize::from(*joint);
                position += (maps.linear[joint] * rest_m.as_dvec3() + maps.offset_m[joint])
                    * f64::from(weight);
            }
            positions.push(position);
            drives.push(kinematics.push(&pose));
        }
        assert_eq!(drives[1].acceleration_m_per_s2(&skin, rest_m), Vec3::ZERO);
        let expected = (positions[3] - 2.0 * positions[2] + positions[1]) * 3600.0;
        let got = drives[3].acceleration_m_per_s2(&skin, rest_m).as_dvec3();
        assert!((got - expected).length() < 1e-3, "{got} {expected}");
    }
}
