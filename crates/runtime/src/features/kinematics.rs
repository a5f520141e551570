//! Causal derivatives of the joints' world motion at 60 Hz.

use dynaskin_body::{JOINT_COUNT, Joint, Pose, WorldJoints};
use dynaskin_motion::MODEL_RATE_HZ;
use glam::{DQuat, DVec3, Vec3};

use crate::RuntimeError;
use crate::state::{Reader, Writer};

/// Gravity, in m/s²; it points to -Y.
pub const GRAVITY_M_S2: f64 = 9.81;

/// Limit of a joint's acceleration (m/s²), before gravity is subtracted. A jump's landing stays
/// below the knee; capture glitches and whips lie above.
pub const LINEAR_ACCELERATION_LIMIT: SoftLimit = SoftLimit {
    knee: 40.0,
    limit: 80.0,
};

/// Limit of a joint's angular velocity (rad/s). A sprinter's thigh reaches 15 rad/s.
pub const ANGULAR_VELOCITY_LIMIT: SoftLimit = SoftLimit {
    knee: 20.0,
    limit: 40.0,
};

/// Limit of a joint's angular acceleration (rad/s²): at 0.2 m from the joint, the knee is worth
/// the 40 m/s² of [`LINEAR_ACCELERATION_LIMIT`].
pub const ANGULAR_ACCELERATION_LIMIT: SoftLimit = SoftLimit {
    knee: 200.0,
    limit: 400.0,
};

/// A smooth limit of a vector's length that keeps its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftLimit {
    /// Up to this length a vector is left alone.
    pub knee: f64,
    /// No length is above this.
    pub limit: f64,
}

impl SoftLimit {
    /// `v` with its length l replaced by `knee + (limit - knee) tanh((l - knee) / (limit - knee))`
    /// where l is above the knee: continuous with its first derivative.
    pub fn apply(self, v: DVec3) -> DVec3 {
        let length = v.length();
        if length <= self.knee {
            return v;
        }
        let room = self.limit - self.knee;
        let limited = self.knee + room * ((length - self.knee) / room).tanh();
        v * (limited / length)
    }
}

/// The rotation `q` as axis times angle in radians, the angle at most π: `q` and `-q`, being the
/// same rotation, give the same vector.
pub fn rotation_vector(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let sine = q.xyz().length();
    if sine < 1e-9 {
        return 2.0 * q.xyz();
    }
    q.xyz() * (2.0 * sine.atan2(q.w) / sine)
}

/// World motion of one joint at a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointMotion {
    /// m/s², gravity not subtracted.
    pub acceleration: DVec3,
    /// rad/s.
    pub angular_velocity: DVec3,
    /// rad/s².
    pub angular_acceleration: DVec3,
}

/// The two poses before the current one, newest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinematics {
    past: [Option<(Pose, WorldJoints)>; 2],
}

impl Kinematics {
    /// Backward differences of `joint`, `world` being the current pose; 0 where the past is too
    /// short.
    pub fn of_joint(&self, joint: Joint, world: &WorldJoints) -> JointMotion {
        let idx = joint as usize;
        let rate = MODEL_RATE_HZ;
        let mut motion = JointMotion {
            acceleration: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            angular_acceleration: DVec3::ZERO,
        };
        let Some((_, before)) = &self.past[0] else {
            return motion;
        };
        let turn = |to: &WorldJoints, from: &WorldJoints| {
            rotation_vector(to.rotation[idx] * from.rotation[idx].conjugate()) * rate
        };
        motion.angular_velocity = turn(world, before);
        if let Some((_, earlier)) = &self.past[1] {
            let step = world.position_m[idx] - before.position_m[idx];
            let step_before = before.position_m[idx] - earlier.position_m[idx];
            motion.acceleration = (step - step_before) * rate * rate;
            motion.angular_acceleration = (motion.angular_velocity - turn(before, earlier)) * rate;
        }
        motion
    }

    /// The poses before the current one, newest first.
    pub fn past_poses(&self) -> [Option<&Pose>; 2] {
        self.past.each_ref().map(|past| Some(&past.as_ref()?.0))
    }

    /// Makes the current pose the newest of the past.
    pub fn advance(&mut self, pose: Pose, world: WorldJoints) {
        self.past[1] = self.past[0].take();
        self.past[0] = Some((pose, world));
    }

    /// Adds the past poses to a saved state.
    pub fn write(&self, writer: &mut Writer) {
        for past in &self.past {
            writer.flag(past.is_some());
            if let Some((pose, _)) = past {
                writer.pose(pose);
            }
        }
    }

    /// The past poses of a saved state.
    pub fn read(
        reader: &mut Reader<'_>,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Self, RuntimeError> {
        let mut kinematics = Self::default();
        for past in &mut kinematics.past {
            if reader.flag()? {
                let pose = reader.pose()?;
                let world = pose.world_joints(joints_rest_m);
                *past = Some((pose, world));
            }
        }
        Ok(kinematics)
    }

    /// Converts the past to another unit of length, `ratio` being the old one over the new one.
    pub fn rescale(&mut self, ratio: f64, joints_rest_m: &[Vec3; JOINT_COUNT]) {
        for (pose, _) in self.past.iter_mut().flatten() {
            pose.root_translation_m *= ratio;
        }
        self.move_joints(joints_rest_m);
    }

    /// Recomputes the past for other rest joints (metres).
    pub fn move_joints(&mut self, joints_rest_m: &[Vec3; JOINT_COUNT]) {
        for (pose, world) in self.past.iter_mut().flatten() {
            *world = pose.world_joints(joints_rest_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_soft_limit_keeps_small_vectors_and_bounds_large_ones() {
        let limit = LINEAR_ACCELERATION_LIMIT;
        let small = DVec3::new(0.0, 39.0, 0.0);
        assert_eq!(limit.apply(small), small);
        let whip = limit.apply(DVec3::new(342.0, 0.0, 0.0));
        assert!(whip.x > 79.0 && whip.x <= 80.0, "{whip}");
        let just_above = limit.apply(DVec3::new(0.0, 0.0, 40.001));
        assert!((just_above.z - 40.001).abs() < 1e-6);
    }

    #[test]
    fn a_quaternion_and_its_negative_are_the_same_turn() {
        let q = DQuat::from_axis_angle(DVec3::Y, 0.3);
        assert!((rotation_vector(q) - DVec3::new(0.0, 0.3, 0.0)).length() < 1e-12);
        assert!((rotation_vector(-q) - rotation_vector(q)).length() < 1e-12);
        let tiny = DQuat::from_axis_angle(DVec3::X, 1e-11);
        assert!((rotation_vector(tiny).x - 1e-11).abs() < 1e-16);
    }
}
