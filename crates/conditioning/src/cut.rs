//! Jumps that bodies do not make, seen on the poses of the source.
//!
//! The limits are measured on captures: `docs/design/conditioning.md` has the figures.

use dynaskin_skeleton::{
    CUT_ANGULAR_VELOCITY_CHANGE_RAD_S, CUT_VELOCITY_CHANGE_M_S, JOINT_COUNT, MIN_CUT_STEP_SECONDS,
    Pose,
};
use glam::DVec3;

use crate::path::turn_between;

/// Change of the pelvis's angular velocity from one pose to the next, in rad/s, that counts as a
/// snap turn where the joints do not join in.
pub const SNAP_TURN_RAD_S: f64 = 8.0;

/// Joints join in where one of them changes its angular velocity by more than this share of that.
pub const SNAP_JOINTS_SHARE: f64 = 0.4;

/// Angular velocity of all joints of the body together, in rad/s, after which no motion stops at once
/// that has just begun: the first pose was one of calibration.
pub const START_RAD_S: f64 = 30.0;

/// How long a motion has just begun, in seconds: a step between two keys of a file of 24 keys/s, shown
/// on a faster display, and the next.
pub(crate) const START_SECONDS: f64 = 0.1;

/// What is left of that speed in a stop.
const STOP_SHARE: f64 = 0.2;

/// Slower than this a body may stop between two poses: 0.02 m/s within a frame of 60 Hz is a tenth of
/// gravity.
const STOP_M_S: f64 = 0.02;
const STOP_RAD_S: f64 = 0.1;

/// How the body went from one pose to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub root_m: DVec3,
    pub turns: [DVec3; JOINT_COUNT],
}

impl Step {
    pub const NONE: Self = Self {
        root_m: DVec3::ZERO,
        turns: [DVec3::ZERO; JOINT_COUNT],
    };

    /// Angular velocity of all joints of the body together, in rad/s.
    pub fn speed_of_all(&self, seconds: f64) -> f64 {
        let turns = self.turns[BODY].iter().map(|turn| turn.length_squared());
        turns.sum::<f64>().sqrt() / seconds.max(MIN_CUT_STEP_SECONDS)
    }

    /// How much of the way of this step and the `next` this one is, metres and radians taken alike.
    pub fn share_of_both(&self, next: &Self) -> f64 {
        let (mut along, mut whole) = (0.0, 0.0);
        let turns = self.turns.iter().zip(&next.turns);
        for (own, next) in turns.chain([(&self.root_m, &next.root_m)]) {
            let both = *own + *next;
            along += own.dot(both);
            whole += both.length_squared();
        }
        if whole > 0.0 { along / whole } else { 0.0 }
    }

    pub fn between(before: &Pose, after: &Pose) -> Self {
        let turn = |joint: usize| {
            let (from, to) = (
                before.parent_from_joint[joint],
                after.parent_from_joint[joint],
            );
            turn_between(from, to)
        };
        Self {
            root_m: after.root_translation_m - before.root_translation_m,
            turns: std::array::from_fn(turn),
        }
    }
}

/// Whether a pose that repeats after the step `last` is a stop that would be felt: the body neither
/// was slow nor was about to stop, as it is for a moment wherever it turns back.
pub(crate) fn is_sudden_stop(before: Option<(&Step, f64)>, last: (&Step, f64)) -> bool {
    let speed = |(step, seconds): (&Step, f64), part: usize| match part {
        0 => step.root_m / seconds.max(MIN_CUT_STEP_SECONDS),
        joint => step.turns[joint - 1] / seconds.max(MIN_CUT_STEP_SECONDS),
    };
    (0..=JOINT_COUNT).any(|part| {
        let now = speed(last, part);
        let next = before.map_or(now, |before| 2.0 * now - speed(before, part));
        let least = if part == 0 { STOP_M_S } else { STOP_RAD_S };
        next.length() > least && next.length() > 0.5 * now.length() && now.length() > least
    })
}

/// What tells a jump from a motion: from one step to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Suddenness {
    /// Change of the root's velocity.
    pub root_m_s: f64,
    /// Change of the pelvis's angular velocity.
    pub pelvis_rad_s: f64,
    /// Largest change of a joint's angular velocity, hands and feet left out: they are flung, and
    /// trackers lose them.
    pub joints_rad_s: f64,
    /// Angular velocity of all such joints together in the second step.
    pub speed_rad_s: f64,
}

impl Suddenness {
    /// Of three poses, `seconds` apart.
    pub fn of(poses: [&Pose; 3], seconds: f64) -> Self {
        let [first, second, third] = poses;
        let before = Step::between(first, second);
        Self::between((&before, seconds), (&Step::between(second, third), seconds))
    }

    fn between(before: (&Step, f64), now: (&Step, f64)) -> Self {
        let before_seconds = before.1.max(MIN_CUT_STEP_SECONDS);
        let now_seconds = now.1.max(MIN_CUT_STEP_SECONDS);
        let root_m_s = now.0.root_m / now_seconds - before.0.root_m / before_seconds;
        let change = |joint: usize| {
            (now.0.turns[joint] / now_seconds - before.0.turns[joint] / before_seconds).length()
        };
        Self {
            root_m_s: root_m_s.length(),
            pelvis_rad_s: change(0),
            joints_rad_s: BODY.map(change).fold(0.0, f64::max),
            speed_rad_s: now.0.speed_of_all(now_seconds),
        }
    }

    /// Whether the whole body turned at once while its joints did not: a snap turn.
    pub fn is_snap_turn(&self) -> bool {
        self.pelvis_rad_s > SNAP_TURN_RAD_S
            && self.joints_rad_s < SNAP_JOINTS_SHARE * self.pelvis_rad_s
    }
}

/// Joints from the hips and the spine on, without hands and feet.
const BODY: std::ops::Range<usize> = 1..20;

/// Whether the body, which had turned its joints at `peak_rad_s`, stops at once.
pub(crate) fn is_stop(peak_rad_s: f64, step: &Step, seconds: f64) -> bool {
    peak_rad_s > START_RAD_S && step.speed_of_all(seconds) < STOP_SHARE * peak_rad_s
}

/// Whether the body jumped in a step, given the one before, each with its seconds.
pub(crate) fn is_cut(before: (&Step, f64), now: (&Step, f64)) -> bool {
    let sudden = Suddenness::between(before, now);
    sudden.root_m_s > CUT_VELOCITY_CHANGE_M_S
        || sudden.pelvis_rad_s.max(sudden.joints_rad_s) > CUT_ANGULAR_VELOCITY_CHANGE_RAD_S
        || sudden.is_snap_turn()
}

/// The same for poses that nothing is done to: what the tissue's clock does not see itself.
pub(crate) fn is_snap_turn(before: (&Step, f64), now: (&Step, f64)) -> bool {
    Suddenness::between(before, now).is_snap_turn()
}
