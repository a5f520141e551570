//! Poses between the host's poses.
//!
//! The features are second differences. Between straight segments from pose to pose all
//! acceleration would sit in the corners: at 24 Hz, ticks would see 0, 0, then two and a half
//! times the acceleration. A parabola through the last three poses has the motion's acceleration
//! everywhere, and needs no pose of the future.

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::{DQuat, DVec3};

use crate::features::rotation_vector;

/// Where the step before was shorter than this fraction of the step, its noise would be blown up:
/// straight interpolation then.
const MIN_STEP_RATIO: f64 = 0.1;

/// The pose at `position` (0..=1) between `before` and `after`, on the parabola that also meets
/// `earlier`, a pose and its time ahead of `before` as a fraction of the time to `after`.
pub(crate) fn between(
    earlier: Option<(&Pose, f64)>,
    before: &Pose,
    after: &Pose,
    position: f64,
) -> Pose {
    let Some((earlier, step_ratio)) = earlier.filter(|(_, ratio)| *ratio >= MIN_STEP_RATIO) else {
        return before.interpolated(after, position);
    };
    // Lagrange's weights of the two neighbours; the middle has the rest.
    let (u, s) = (position, step_ratio);
    let earlier_weight = u * (u - 1.0) / (s * (s + 1.0));
    let after_weight = u * (u + s) / (s + 1.0);
    let parabola = |a: DVec3, b: DVec3| earlier_weight * a + after_weight * b;

    let mut pose = before.clone();
    let origin_m = before.root_translation_m;
    pose.root_translation_m += parabola(
        earlier.root_translation_m - origin_m,
        after.root_translation_m - origin_m,
    );
    for joint in 0..JOINT_COUNT {
        let rotation = before.parent_from_joint[joint];
        let local =
            |other: &Pose| rotation_vector(rotation.conjugate() * other.parent_from_joint[joint]);
        let turn = parabola(local(earlier), local(after));
        pose.parent_from_joint[joint] = (rotation * DQuat::from_scaled_axis(turn)).normalize();
    }
    pose
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

    #[test]
    fn constant_accelerations_are_met_exactly() {
        let (earlier, before, after) = (accelerating(0.1), accelerating(0.13), accelerating(0.2));
        for position in [0.0, 0.3, 0.8, 1.0] {
            let expected = accelerating(0.13 + 0.07 * position);
            let got = between(Some((&earlier, 0.03 / 0.07)), &before, &after, position);
            let shift_m = got.root_translation_m - expected.root_translation_m;
            assert!(shift_m.length() < 1e-12);
            let turn = got.parent_from_joint[4].angle_between(expected.parent_from_joint[4]);
            assert!(turn < 1e-7, "{turn}");
        }
    }

    #[test]
    fn after_a_very_short_step_the_way_is_straight() {
        let (earlier, before, after) = (accelerating(0.0999), accelerating(0.1), accelerating(0.2));
        let got = between(Some((&earlier, 0.001)), &before, &after, 0.5);
        assert!((got.root_translation_m.x - 0.05).abs() < 1e-12);
    }
}
