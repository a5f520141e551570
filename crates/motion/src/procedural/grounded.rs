//! Motions that keep at least one foot on the floor.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::ik::{Arm, IkSolver, Sides, Sole, Stance, StanceAt};
use super::parameters::{LEAD_SECONDS, Procedural};
use super::track::{Knot, Track, bump, smooth_step};
use crate::MotionError;

/// Length of a step per length of leg.
const STEP_LENGTH: f64 = 0.65;
/// Amplitude of the pelvis's rise over the standing leg per length of leg: 4-5 cm from trough to
/// crest, as people walk at this pace.
const VAULT: f64 = 0.026;
/// Fraction of a step during which both feet stand.
const DOUBLE_SUPPORT: f64 = 0.2;
/// Angle of the sole at heel strike, in radians.
const HEEL_STRIKE_PITCH: f64 = -0.25;

pub fn walk<'a>(motion: &Procedural, solver: &'a IkSolver) -> Result<StanceAt<'a>, MotionError> {
    let tempo_hz = motion.tempo_hz;
    let height_m = motion.height_m;
    let sink_seconds = 0.4;
    let steps = motion.repetitions(1.0 / tempo_hz, 2.0 * sink_seconds, 2)?;
    let steps = steps.max(2);
    let start = LEAD_SECONDS + sink_seconds;
    let end = start + steps as f64 / tempo_hz;
    let step_m = STEP_LENGTH * solver.leg_m;
    let aside_m = 0.09 * solver.leg_m - solver.sole_aside_m();
    let ahead = pelvis_ahead(steps, step_m);
    // Legs apart reach less high.
    let stand_m = -solver.drop_for(aside_m);
    let walk_m = stand_m - step_m * step_m / (10.0 * solver.leg_m);
    let height = Track::through(&[
        (LEAD_SECONDS, stand_m),
        (start, walk_m),
        (end, walk_m),
        (end + sink_seconds, stand_m),
    ]);
    let (whole, ending) = (start + 1.0 / tempo_hz, end - 1.0 / tempo_hz);
    let mut gait = vec![(start, 0.0), (whole, 1.0), (ending, 1.0), (end, 0.0)];
    if steps == 2 {
        // The first step ends where the last one begins.
        gait.remove(2);
    }
    let gait = Track::through(&gait);
    Ok(Box::new(move |time| {
        let phase = ((time - start) * tempo_hz).clamp(0.0, steps as f64);
        let gait = gait.at(time);
        let sole = |side: usize, x: f64| {
            let foot = foot(side, phase, steps, step_m);
            Sole {
                shift_m: DVec3::new(x, height_m * foot.lift, foot.ahead_m),
                pitch: foot.pitch,
                spring: 0.4 * gait * foot.push,
            }
        };
        // +1 while the left foot is ahead (it lands at odd phases), -1 while the right one is.
        let left_ahead = gait * -(PI * phase).cos();
        // The left foot swings in even steps; meanwhile the weight is on the right.
        let to_left = gait * -(PI * phase).sin();
        let arm = |ahead: f64| Arm {
            ahead: 0.4 * ahead,
            aside: 0.05 * gait,
            bend: 0.1 * gait + 0.15 * ahead,
        };
        Stance {
            pelvis_shift_m: DVec3::new(
                0.025 * to_left,
                height.at(time) - VAULT * solver.leg_m * gait * (TAU * phase).cos(),
                ahead.at(phase),
            ),
            pelvis_turn: DVec3::new(0.03 * gait, -0.09 * left_ahead, 0.05 * to_left),
            chest_turn: DVec3::new(0.02 * gait, 0.2 * left_ahead, -0.06 * to_left),
            soles: Sides {
                left: sole(0, aside_m),
                right: sole(1, -aside_m),
            },
            arms: Sides {
                left: arm(-left_ahead),
                right: arm(left_ahead),
            },
        }
    }))
}

/// Way of the pelvis over the phase in steps: half a step while the first foot swings, half while
/// the last one closes up, steadily between.
fn pelvis_ahead(steps: usize, step_m: f64) -> Track {
    let knots = (0..=steps)
        .map(|step| match step {
            0 => Knot::still(0.0, 0.0),
            last if last == steps => Knot::still(last as f64, (last - 1) as f64 * step_m),
            step => Knot {
                time: step as f64,
                value: (step as f64 - 0.5) * step_m,
                speed: step_m,
                acceleration: 0.0,
            },
        })
        .collect();
    Track::new(knots)
}

/// A foot in the cycle of walking.
#[derive(Default)]
struct WalkingFoot {
    /// Way ahead in metres.
    ahead_m: f64,
    /// Lift of the swinging foot, 0 to 1.
    lift: f64,
    /// Pitch of the sole in radians: the heel strikes first.
    pitch: f64,
    /// 1 while the foot pushes off from behind, else 0.
    push: f64,
}

/// A foot (0 left, 1 right) at a phase in steps. The left foot swings in even steps, the right one
/// in odd steps; step k lands k + 1 steps ahead, the last one beside the other foot.
fn foot(side: usize, phase: f64, steps: usize, step_m: f64) -> WalkingFoot {
    let current = (phase.floor() as usize).min(steps - 1);
    // The foot's last step up to the current one; -1 for the right foot before its first.
    let own = current as i64 - i64::from(current % 2 != side);
    let lands_at_m = |step: i64| (step + 1).clamp(0, steps as i64 - 1) as f64 * step_m;
    let from_m = lands_at_m(own - 2);
    let passed = phase - own as f64;
    let swing = (passed - DOUBLE_SUPPORT) / (1.0 - DOUBLE_SUPPORT);
    let strikes = (0..steps as i64 - 1).contains(&own);
    let up = smooth_step((swing - 0.5) / 0.5);
    let down = smooth_step((passed - 1.0) / 0.35);
    let pushed_before = own > 0;
    let push = smooth_step((passed - 1.2) / 0.4)
        + f64::from(pushed_before) * (1.0 - smooth_step((passed - 0.35) / 0.35));
    WalkingFoot {
        ahead_m: from_m + (lands_at_m(own) - from_m) * smooth_step(swing),
        lift: bump(swing),
        pitch: f64::from(strikes) * HEEL_STRIKE_PITCH * (up - down),
        push,
    }
}

/// Strength of a repeated motion: 0 before and after, 1 from `start` + `ramp` to `end` - `ramp`.
fn strength(start: f64, end: f64, ramp: f64) -> Track {
    Track::through(&[
        (start, 0.0),
        (start + ramp, 1.0),
        (end - ramp, 1.0),
        (end, 0.0),
    ])
}

pub fn twist<'a>(motion: &Procedural, solver: &'a IkSolver) -> Result<StanceAt<'a>, MotionError> {
    let tempo_hz = motion.tempo_hz;
    let height_m = motion.height_m;
    let period = 1.0 / tempo_hz;
    let cycles = motion.repetitions(period, 2.0 * period, 1)? + 2;
    let (start, end) = (LEAD_SECONDS, LEAD_SECONDS + cycles as f64 * period);
    let strength = strength(start, end, period);
    let aside_m = 0.2 * solver.leg_m - solver.sole_aside_m();
    let stand_m = -solver.drop_for(aside_m);
    Ok(Box::new(move |time| {
        let on = strength.at(time);
        let swing = on * (TAU * tempo_hz * (time - start)).sin();
        let sole = |x: f64| Sole {
            shift_m: DVec3::new(x, 0.0, 0.0),
            ..Sole::default()
        };
        let arm = |ahead: f64| Arm {
            ahead: 0.35 * on + 0.35 * ahead,
            aside: 0.25 * on,
            bend: 0.8 * on,
        };
        // Twice in each cycle, at both ends of the twist, the knees straighten.
        let sink = on * (1.0 - 0.6 * swing * swing);
        Stance {
            pelvis_shift_m: DVec3::new(0.0, stand_m - height_m * sink, -0.2 * height_m * sink),
            pelvis_turn: DVec3::new(0.05 * on, 0.35 * swing, 0.0),
            chest_turn: DVec3::new(0.05 * on, -0.75 * swing, 0.0),
            soles: Sides {
                left: sole(aside_m),
                right: sole(-aside_m),
            },
            arms: Sides {
                left: arm(swing),
                right: arm(-swing),
            },
        }
    }))
}

pub fn shake_hips<'a>(
    motion: &Procedural,
    solver: &'a IkSolver,
) -> Result<StanceAt<'a>, MotionError> {
    let tempo_hz = motion.tempo_hz;
    let amplitude_m = motion.height_m;
    let period = 1.0 / tempo_hz;
    let cycles = motion.repetitions(period, 2.0 * period, 1)? + 2;
    let (start, end) = (LEAD_SECONDS, LEAD_SECONDS + cycles as f64 * period);
    let strength = strength(start, end, period);
    let aside_m = 0.2 * solver.leg_m - solver.sole_aside_m();
    let stand_m = -solver.drop_for(aside_m);
    // Room for the leg that the pelvis moves away from.
    let sink_m = 0.03 + 0.5 * amplitude_m;
    Ok(Box::new(move |time| {
        let on = strength.at(time);
        let swing = on * (TAU * tempo_hz * (time - start)).sin();
        let sole = |x: f64| Sole {
            shift_m: DVec3::new(x, 0.0, 0.0),
            ..Sole::default()
        };
        let arm = |sign: f64| Arm {
            ahead: 0.15 * on,
            aside: 0.35 * on + 0.05 * sign * swing,
            bend: 0.7 * on,
        };
        // The hip that goes out goes up, and the spine bends back to keep the chest in place.
        let roll = 3.0 * amplitude_m * swing;
        Stance {
            pelvis_shift_m: DVec3::new(amplitude_m * swing, stand_m - sink_m * on, 0.0),
            pelvis_turn: DVec3::new(0.04 * on, 0.06 * swing, roll),
            chest_turn: DVec3::new(0.02 * on, -0.06 * swing, -1.3 * roll),
            soles: Sides {
                left: sole(aside_m),
                right: sole(-aside_m),
            },
            arms: Sides {
                left: arm(1.0),
                right: arm(-1.0),
            },
        }
    }))
}
