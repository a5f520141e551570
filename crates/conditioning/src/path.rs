//! The way between poses of the source: cubics in Hermite's form.

use dynaskin_skeleton::{JOINT_COUNT, Pose, rotation_vector};
use glam::{DQuat, DVec3};

/// How fast a pose changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rates {
    pub root_m_s: DVec3,
    /// Of each joint against its parent, about the joint's own axes.
    pub joints_rad_s: [DVec3; JOINT_COUNT],
}

impl Rates {
    pub const ZERO: Self = Self {
        root_m_s: DVec3::ZERO,
        joints_rad_s: [DVec3::ZERO; JOINT_COUNT],
    };
}

/// A pose of the source at its time, in seconds.
#[derive(Clone, Debug)]
pub(crate) struct Knot {
    pub time: f64,
    pub pose: Pose,
    pub rates: Rates,
}

/// The turn of `to` against `from`, about `from`'s own axes.
pub(crate) fn turn_between(from: DQuat, to: DQuat) -> DVec3 {
    rotation_vector(from.conjugate() * to)
}

/// Velocity at the last of three poses: the slope of the parabola through them.
pub(crate) fn parabola_rates(earlier: &Knot, before: &Knot, time: f64, pose: &Pose) -> Rates {
    let (far, near) = (time - earlier.time, time - before.time);
    if near <= 0.0 || far <= near {
        return Rates::ZERO;
    }
    // Weights of the differences `earlier - here` and `before - here`.
    let (a, b) = (near / (far * (far - near)), -far / (near * (far - near)));
    let mut rates = Rates::ZERO;
    let here_m = pose.root_translation_m;
    rates.root_m_s = a * (earlier.pose.root_translation_m - here_m)
        + b * (before.pose.root_translation_m - here_m);
    for (joint, rate) in rates.joints_rad_s.iter_mut().enumerate() {
        let here = pose.parent_from_joint[joint];
        *rate = a * turn_between(here, earlier.pose.parent_from_joint[joint])
            + b * turn_between(here, before.pose.parent_from_joint[joint]);
    }
    rates
}

/// The pose at `time` between two knots.
pub(crate) fn between(from: &Knot, to: &Knot, time: f64) -> Pose {
    let seconds = to.time - from.time;
    let u = if seconds > 0.0 {
        ((time - from.time) / seconds).clamp(0.0, 1.0)
    } else {
        1.0
    };
    if u == 0.0 {
        return from.pose.clone();
    }
    if u == 1.0 {
        return to.pose.clone();
    }
    let to_weight = u * u * (3.0 - 2.0 * u);
    let from_rate = u * (1.0 - u) * (1.0 - u) * seconds;
    let to_rate = -u * u * (1.0 - u) * seconds;
    let mut pose = from.pose.clone();
    pose.root_translation_m += to_weight
        * (to.pose.root_translation_m - from.pose.root_translation_m)
        + from_rate * from.rates.root_m_s
        + to_rate * to.rates.root_m_s;
    for joint in 0..JOINT_COUNT {
        let start = from.pose.parent_from_joint[joint];
        let turn = turn_between(start, to.pose.parent_from_joint[joint]);
        let rate = to.rates.joints_rad_s[joint];
        // How fast the rotation vector itself changes where the joint turns at `rate`.
        let end = rate + 0.5 * turn.cross(rate) + turn.cross(turn.cross(rate)) / 12.0;
        let moved = to_weight * turn + from_rate * from.rates.joints_rad_s[joint] + to_rate * end;
        pose.parent_from_joint[joint] = (start * DQuat::from_scaled_axis(moved)).normalize();
    }
    pose
}

/// As [`between`], with the rates there.
pub(crate) fn between_knots(from: &Knot, to: &Knot, time: f64) -> Knot {
    let seconds = to.time - from.time;
    if time >= to.time || seconds <= 0.0 {
        return to.clone();
    }
    if time <= from.time {
        return from.clone();
    }
    let pose = between(from, to, time);
    let u = (time - from.time) / seconds;
    // Derivatives of Hermite's four polynomials.
    let to_weight = 6.0 * u * (1.0 - u) / seconds;
    let (from_rate, to_rate) = ((1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0));
    let mut rates = Rates::ZERO;
    let moved_m = to.pose.root_translation_m - from.pose.root_translation_m;
    rates.root_m_s =
        to_weight * moved_m + from_rate * from.rates.root_m_s + to_rate * to.rates.root_m_s;
    for (joint, rate) in rates.joints_rad_s.iter_mut().enumerate() {
        // From pose to pose the axes turn so little that rates are added as they are.
        let turn = turn_between(
            from.pose.parent_from_joint[joint],
            to.pose.parent_from_joint[joint],
        );
        *rate = to_weight * turn
            + from_rate * from.rates.joints_rad_s[joint]
            + to_rate * to.rates.joints_rad_s[joint];
    }
    Knot { time, pose, rates }
}
