//! Poses between the host's poses.
//!
//! The features are second differences. Between straight segments from pose to pose all
//! acceleration would sit in the corners: at 24 Hz, ticks would see 0, 0, then two and a half
//! times the acceleration. So the path is a cubic in Hermite's form. Its velocity at each pose is
//! that of the parabola through this pose and the two before it. It is exact where the acceleration is
//! constant, its velocity does not jump at the poses, and no pose of the future is needed.

use dynaskin_skeleton::{JOINT_COUNT, Pose, rotation_vector};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Where the step before was shorter than this fraction of the step, its noise would be blown up:
/// straight interpolation then.
const MIN_STEP_RATIO: f64 = 0.1;

/// How fast a pose changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rates {
    pub root_m_s: DVec3,
    /// Of each joint against its parent, about the joint's own axes.
    pub joints_rad_s: [DVec3; JOINT_COUNT],
}

/// The step from `before` to `after`, of `seconds`, and what came before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way<'a> {
    /// A pose, and how many seconds ahead of `before` it was.
    pub earlier: Option<(&'a Pose, f64)>,
    /// At `before`, as [`Way::end_rates`] gave them for the step that ended there.
    pub start_rates: Option<&'a Rates>,
    pub before: &'a Pose,
    pub after: &'a Pose,
    pub seconds: f64,
}

/// Weights of the earlier pose and of `after` in the parabola that is 0 at `before`.
struct Parabola {
    earlier: f64,
    after: f64,
}

impl Way<'_> {
    /// The earlier pose and its time ahead of `before` as a fraction of the step, if it helps.
    fn third_pose(&self) -> Option<(&Pose, f64)> {
        self.earlier
            .map(|(pose, seconds)| (pose, seconds / self.seconds))
            .filter(|(_, ratio)| *ratio >= MIN_STEP_RATIO)
    }

    /// The velocity at `after`; none without a third pose.
    pub fn end_rates(&self) -> Option<Rates> {
        let (earlier, ratio) = self.third_pose()?;
        // Slope of Lagrange's parabola at its last point, from differences to that point.
        let before_weight = -(1.0 + ratio) / (ratio * self.seconds);
        let earlier_weight = 1.0 / (ratio * (1.0 + ratio) * self.seconds);
        let slope =
            |earlier: DVec3, before: DVec3| earlier_weight * earlier + before_weight * before;
        let end_m = self.after.root_translation_m;
        let mut rates = Rates {
            root_m_s: slope(
                earlier.root_translation_m - end_m,
                self.before.root_translation_m - end_m,
            ),
            joints_rad_s: [DVec3::ZERO; JOINT_COUNT],
        };
        for (joint, rate) in rates.joints_rad_s.iter_mut().enumerate() {
            let to_local = self.after.parent_from_joint[joint].conjugate();
            let local = |pose: &Pose| rotation_vector(to_local * pose.parent_from_joint[joint]);
            *rate = slope(local(earlier), local(self.before));
        }
        Some(rates)
    }

    /// The pose at `position`, 0 (`before`) to 1 (`after`).
    pub fn pose_at(&self, position: f64) -> Pose {
        let Some((earlier, ratio)) = self.third_pose() else {
            return self.before.interpolated(self.after, position);
        };
        let u = position;
        let parabola = Parabola::at(u, ratio);
        // Against the parabola, only the velocity at the start differs.
        let start_weight = u * (1.0 - u) * (1.0 - u);
        let start_slope = Parabola::slope_at_start(ratio);
        let between = |earlier: DVec3, after: DVec3, rate: Option<DVec3>| {
            let on_parabola = parabola.blend(earlier, after);
            rate.map_or(on_parabola, |rate| {
                let correction = rate * self.seconds - start_slope.blend(earlier, after);
                on_parabola + start_weight * correction
            })
        };

        let mut pose = self.before.clone();
        let origin_m = self.before.root_translation_m;
        pose.root_translation_m += between(
            earlier.root_translation_m - origin_m,
            self.after.root_translation_m - origin_m,
            self.start_rates.map(|rates| rates.root_m_s),
        );
        for joint in 0..JOINT_COUNT {
            let rotation = self.before.parent_from_joint[joint];
            let local = |other: &Pose| {
                rotation_vector(rotation.conjugate() * other.parent_from_joint[joint])
            };
            let rate = self.start_rates.map(|rates| rates.joints_rad_s[joint]);
            let turn = between(local(earlier), local(self.after), rate);
            pose.parent_from_joint[joint] = (rotation * DQuat::from_scaled_axis(turn)).normalize();
        }
        pose
    }
}

impl Parabola {
    /// Lagrange's weights at `u`, for poses at `-ratio`, 0 and 1.
    fn at(u: f64, ratio: f64) -> Self {
        Self {
            earlier: u * (u - 1.0) / (ratio * (ratio + 1.0)),
            after: u * (u + ratio) / (ratio + 1.0),
        }
    }

    /// Their derivatives at 0.
    fn slope_at_start(ratio: f64) -> Self {
        Self {
            earlier: -1.0 / (ratio * (ratio + 1.0)),
            after: ratio / (ratio + 1.0),
        }
    }

    fn blend(&self, earlier: DVec3, after: DVec3) -> DVec3 {
        self.earlier * earlier + self.after * after
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Constant acceleration along X and angular acceleration about Y.
    fn accelerating(time_seconds: f64) -> Pose {
        let mut pose = Pose::REST;
        pose.root_translation_m.x = 2.0 * time_seconds * time_seconds;
        pose.parent_from_joint[4] = DQuat::from_rotation_y(3.0 * time_seconds * time_seconds);
        pose
    }

    /// The way from `times[1]` to `times[2]` after `times[0]`, handed to `look`.
    fn on_way<T>(
        [earlier, before, after]: [f64; 3],
        start_rates: Option<&Rates>,
        look: impl Fn(&Way<'_>) -> T,
    ) -> T {
        let poses = [earlier, before, after].map(accelerating);
        look(&Way {
            earlier: Some((&poses[0], before - earlier)),
            start_rates,
            before: &poses[1],
            after: &poses[2],
            seconds: after - before,
        })
    }

    #[test]
    fn constant_accelerations_are_met_exactly() {
        let start = on_way([0.04, 0.1, 0.13], None, |way| way.end_rates()).expect("three poses");
        assert!((start.root_m_s.x - 4.0 * 0.13).abs() < 1e-12, "{start:?}");
        assert!((start.joints_rad_s[4].y - 6.0 * 0.13).abs() < 1e-7);
        for start_rates in [None, Some(&start)] {
            for position in [0.0, 0.3, 0.8, 1.0] {
                let expected = accelerating(0.13 + 0.07 * position);
                let got = on_way([0.1, 0.13, 0.2], start_rates, |way| way.pose_at(position));
                let shift_m = got.root_translation_m - expected.root_translation_m;
                assert!(shift_m.length() < 1e-12);
                let turn = got.parent_from_joint[4].angle_between(expected.parent_from_joint[4]);
                assert!(turn < 1e-7, "{turn}");
            }
        }
    }

    #[test]
    fn the_velocity_does_not_jump_at_a_pose() {
        let start = Rates {
            root_m_s: DVec3::new(-3.0, 1.0, 0.0),
            joints_rad_s: [DVec3::new(0.0, -2.0, 0.0); JOINT_COUNT],
        };
        const STEP: f64 = 1e-6;
        let (from, to) = on_way([0.1, 0.13, 0.2], Some(&start), |way| {
            (way.before.clone(), way.pose_at(STEP))
        });
        let seconds = STEP * 0.07;
        let velocity_m_s = (to.root_translation_m - from.root_translation_m) / seconds;
        assert!((velocity_m_s - start.root_m_s).length() < 1e-3);
        let turn = rotation_vector(from.parent_from_joint[4].conjugate() * to.parent_from_joint[4]);
        assert!((turn / seconds - start.joints_rad_s[4]).length() < 1e-3);
    }

    #[test]
    fn after_a_very_short_step_the_way_is_straight() {
        let got = on_way([0.0999, 0.1, 0.2], None, |way| way.pose_at(0.5));
        assert!((got.root_translation_m.x - (0.02 + 0.08) / 2.0).abs() < 1e-12);
        assert!(on_way([0.0999, 0.1, 0.2], None, |way| way.end_rates()).is_none());
    }
}
