//! Causal kinematics: derivatives in time of a motion from its poses up to now only
//! (ARCHITECTURE.md, "Causal kinematics").

use std::ops::Sub;

use glam::{DQuat, DVec3, Vec3};

use crate::joint::{JOINT_COUNT, Joint};
use crate::pose::{Pose, WorldJoints};

/// The rate at which simulator, training and runtime tick, in hertz.
pub const MODEL_RATE_HZ: f64 = 60.0;

/// Standard gravity, in m/s²; it points to -Y.
pub const GRAVITY_M_S2: f64 = 9.81;

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

/// The backward second difference `x_t - 2 x_{t-1} + x_{t-2}`, taken as the difference of two steps,
/// which loses no digits far from the origin. Times the squared rate it is the acceleration at t.
pub fn second_difference<T: Copy + Sub<Output = T>>(now: T, before: T, earlier: T) -> T {
    (now - before) - (before - earlier)
}

/// What is remembered of the last two ticks.
#[derive(Clone, Debug)]
pub struct Past<T> {
    /// The newest first.
    ticks: [Option<T>; 2],
}

impl<T> Default for Past<T> {
    fn default() -> Self {
        Self {
            ticks: [None, None],
        }
    }
}

impl<T> Past<T> {
    /// The last tick.
    pub fn before(&self) -> Option<&T> {
        self.ticks[0].as_ref()
    }

    /// The last tick and the one before it, once both are known.
    pub fn both(&self) -> Option<(&T, &T)> {
        match &self.ticks {
            [Some(before), Some(earlier)] => Some((before, earlier)),
            _ => None,
        }
    }

    /// Makes `now` the last tick.
    pub fn push(&mut self, now: T) {
        self.ticks.swap(0, 1);
        self.ticks[0] = Some(now);
    }
}

/// World motion of one joint at a tick.
#[derive(Clone, Copy, Debug)]
pub struct JointMotion {
    /// m/s², gravity not subtracted.
    pub acceleration: DVec3,
    /// rad/s.
    pub angular_velocity: DVec3,
    /// rad/s².
    pub angular_acceleration: DVec3,
}

/// The two poses before the current one, [`MODEL_RATE_HZ`] apart, from which a joint's motion is
/// differenced.
#[derive(Clone, Debug, Default)]
pub struct Kinematics {
    past: Past<(Pose, WorldJoints)>,
}

impl Kinematics {
    /// With the past `poses`, the newest first, of a body with the rest joints `joints_rest_m`
    /// (metres).
    pub fn new(poses: [Option<Pose>; 2], joints_rest_m: &[Vec3; JOINT_COUNT]) -> Self {
        let ticks = poses.map(|pose| {
            pose.map(|pose| {
                let world = pose.world_joints(joints_rest_m);
                (pose, world)
            })
        });
        Self {
            past: Past { ticks },
        }
    }

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
        let Some((_, before)) = self.past.before() else {
            return motion;
        };
        let turn = |to: &WorldJoints, from: &WorldJoints| {
            rotation_vector(to.rotation[idx] * from.rotation[idx].conjugate()) * rate
        };
        motion.angular_velocity = turn(world, before);
        if let Some((_, (_, earlier))) = self.past.both() {
            let position_m = [world, before, earlier].map(|at| at.position_m[idx]);
            let [now_m, before_m, earlier_m] = position_m;
            motion.acceleration = second_difference(now_m, before_m, earlier_m) * rate * rate;
            motion.angular_acceleration = (motion.angular_velocity - turn(before, earlier)) * rate;
        }
        motion
    }

    /// The poses before the current one, newest first.
    pub fn past_poses(&self) -> [Option<&Pose>; 2] {
        self.past
            .ticks
            .each_ref()
            .map(|tick| Some(&tick.as_ref()?.0))
    }

    /// Makes the current pose the newest of the past.
    pub fn advance(&mut self, pose: Pose, world: WorldJoints) {
        self.past.push((pose, world));
    }

    /// Converts the past to another unit of length, `ratio` being the old one over the new one.
    pub fn rescale(&mut self, ratio: f64, joints_rest_m: &[Vec3; JOINT_COUNT]) {
        for (pose, _) in self.past.ticks.iter_mut().flatten() {
            pose.root_translation_m *= ratio;
        }
        self.move_joints(joints_rest_m);
    }

    /// Recomputes the past for other rest joints (metres).
    pub fn move_joints(&mut self, joints_rest_m: &[Vec3; JOINT_COUNT]) {
        for (pose, world) in self.past.ticks.iter_mut().flatten() {
            *world = pose.world_joints(joints_rest_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_and_its_negative_are_the_same_turn() {
        let q = DQuat::from_axis_angle(DVec3::Y, 0.3);
        assert!((rotation_vector(q) - DVec3::new(0.0, 0.3, 0.0)).length() < 1e-12);
        assert!((rotation_vector(-q) - rotation_vector(q)).length() < 1e-12);
        let tiny = DQuat::from_axis_angle(DVec3::X, 1e-11);
        assert!((rotation_vector(tiny).x - 1e-11).abs() < 1e-16);
    }
}
