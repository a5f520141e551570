//! Jumps that bodies do not make, seen on the poses of the source.
//!
//! The limits of a snap turn and of a start are first guesses and not yet measured on captures, as
//! those of the tissue's clock were. They are asked only where poses are being conditioned.

use dynaskin_skeleton::{JOINT_COUNT, Pose};
use glam::DVec3;

use crate::path::turn_between;

/// Change of the pelvis's angular velocity from one pose to the next, in rad/s, that counts as a
/// snap turn where the joints do not join in.
pub const SNAP_TURN_RAD_S: f64 = 14.0;

/// Joints join in where one of them changes its angular velocity by more than this, in rad/s.
pub const SNAP_JOINTS_RAD_S: f64 = 2.5;

/// Angular velocity of a joint, in rad/s, with which no motion begins: the first pose was one of
/// calibration.
pub const START_RAD_S: f64 = 30.0;

/// Change of the root's velocity and of a joint's angular velocity that count as a cut.
const CUT_M_S: f64 = 8.0;
const CUT_RAD_S: f64 = 60.0;

/// Slower than this a body may stop between two poses: 0.02 m/s within a frame of 60 Hz is a tenth of
/// gravity.
const STOP_M_S: f64 = 0.02;
const STOP_RAD_S: f64 = 0.1;

/// Shortest step over which velocities are judged.
const SHORTEST_SECONDS: f64 = 1.0 / 240.0;

/// How the body went from one pose to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub root_m: DVec3,
    pub turns: [DVec3; JOINT_COUNT],
}

impl Step {
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
        0 => step.root_m / seconds.max(SHORTEST_SECONDS),
        joint => step.turns[joint - 1] / seconds.max(SHORTEST_SECONDS),
    };
    (0..=JOINT_COUNT).any(|part| {
        let now = speed(last, part);
        let next = before.map_or(now, |before| 2.0 * now - speed(before, part));
        let least = if part == 0 { STOP_M_S } else { STOP_RAD_S };
        next.length() > least && next.length() > 0.5 * now.length() && now.length() > least
    })
}

/// What a step was, given the one before, each with its seconds.
pub(crate) fn is_cut(before: Option<(&Step, f64)>, now: (&Step, f64)) -> bool {
    let now_seconds = now.1.max(SHORTEST_SECONDS);
    let Some((before, before_seconds)) = before else {
        // Hands and feet may be flung, and trackers lose them.
        return now.0.turns[1..20]
            .iter()
            .any(|turn| turn.length() > START_RAD_S * now_seconds);
    };
    let before_seconds = before_seconds.max(SHORTEST_SECONDS);
    let root_m_s = now.0.root_m / now_seconds - before.root_m / before_seconds;
    if root_m_s.length() > CUT_M_S {
        return true;
    }
    let change = |joint: usize| {
        (now.0.turns[joint] / now_seconds - before.turns[joint] / before_seconds).length()
    };
    let root = change(0);
    let joints = (1..20).map(change).fold(0.0, f64::max);
    root.max(joints) > CUT_RAD_S || (root > SNAP_TURN_RAD_S && joints < SNAP_JOINTS_RAD_S)
}
