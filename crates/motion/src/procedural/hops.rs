//! Motions with flights.

use glam::DVec3;

use super::bounce::{Bounce, BouncePlan};
use super::ik::{Arm, IkSolver, Sides, Sole, Stance, StanceAt};
use super::parameters::{LEAD_SECONDS, Procedural};
use super::track::{Track, bump, smooth_step};
use crate::MotionError;

/// Distance of each sole from the midline in metres, per metre of leg.
const STANCE_ASIDE: f64 = 0.15;

/// Shift of the soles from the rest pose that puts them at `aside_m` from the midline.
fn aside_shift_m(solver: &IkSolver, aside_m: f64) -> f64 {
    aside_m - solver.sole_aside_m()
}

fn plan(motion: &Procedural, solver: &IkSolver) -> BouncePlan {
    let sole_aside_m = aside_shift_m(solver, STANCE_ASIDE * solver.leg_m);
    BouncePlan {
        period_seconds: 1.0 / motion.tempo_hz,
        prepare_seconds: 0.0,
        sole_aside_m,
        widest_m: sole_aside_m,
        multiple: 1,
    }
}

/// Pelvis and trunk of a bouncing body: in the crouch the hips go back and the trunk leans ahead,
/// which keeps the weight over the feet.
fn crouching(bounce: &Bounce, time: f64) -> Stance {
    let crouch_m = bounce.crouch_m(time);
    Stance {
        pelvis_shift_m: DVec3::new(0.0, bounce.pelvis_m.at(time), -0.35 * crouch_m),
        pelvis_turn: DVec3::new(1.0 * crouch_m, 0.0, 0.0),
        chest_turn: DVec3::new(1.1 * crouch_m, 0.0, 0.0),
        ..Stance::default()
    }
}

/// Both soles side by side, lifting from the floor with the flights.
fn both_soles(bounce: &Bounce, time: f64, aside_m: f64, tuck_m: f64) -> Sides<Sole> {
    let sole = |x: f64| Sole {
        shift_m: DVec3::new(x, bounce.sole_m(time) + tuck_m, 0.0),
        pitch: 0.0,
        spring: bounce.spring(time),
    };
    Sides {
        left: sole(aside_m),
        right: sole(-aside_m),
    }
}

pub fn jump<'a>(motion: &Procedural, solver: &'a IkSolver) -> Result<StanceAt<'a>, MotionError> {
    let plan = plan(motion, solver);
    let bounce = Bounce::new(motion, solver, &plan)?;
    // Arms swing back while sinking and up through the push.
    let mut swing = vec![(LEAD_SECONDS, 0.0)];
    for flight in &bounce.flights {
        let bottom = flight.start - bounce.push_seconds;
        let keys = [
            (bottom - 0.25, -0.5),
            (flight.start + 0.12, 1.2),
            (flight.end.max(flight.start + 0.2), 0.8),
            (flight.end + bounce.push_seconds + 0.35, 0.0),
        ];
        for key in keys {
            // Quick tempos leave no time for every key.
            if swing
                .last()
                .is_some_and(|last: &(f64, f64)| key.0 > last.0 + 0.12)
            {
                swing.push(key);
            }
        }
    }
    swing.push((bounce.end.max(swing[swing.len() - 1].0 + 0.3), 0.0));
    let swing = Track::through(&swing);
    let engagement = bounce.engagement();
    Ok(Box::new(move |time| {
        let mut stance = crouching(&bounce, time);
        let tuck_m = bounce.flight_at(time).map_or(0.0, |(_, passed)| {
            0.15 * motion_height(&bounce) * bump(passed)
        });
        stance.soles = both_soles(&bounce, time, plan.sole_aside_m, tuck_m);
        let arm = Arm {
            ahead: swing.at(time),
            aside: 0.12 * engagement.at(time),
            bend: 0.35 * engagement.at(time),
        };
        stance.arms = Sides {
            left: arm,
            right: arm,
        };
        stance
    }))
}

/// Rise of the pelvis in the first flight.
fn motion_height(bounce: &Bounce) -> f64 {
    let flight = bounce.flights[0];
    bounce.pelvis_m.at(0.5 * (flight.start + flight.end)) - bounce.release_m
}

/// Arms held bent that follow the pelvis up and down.
fn bent_arms(bounce: &Bounce, engagement: f64, time: f64) -> Sides<Arm> {
    let rise_m = bounce.pelvis_m.at(time) - bounce.stand_m;
    let arm = Arm {
        ahead: engagement * (0.1 + rise_m),
        aside: 0.15 * engagement,
        bend: 0.9 * engagement,
    };
    Sides {
        left: arm,
        right: arm,
    }
}

pub fn hop<'a>(motion: &Procedural, solver: &'a IkSolver) -> Result<StanceAt<'a>, MotionError> {
    let plan = plan(motion, solver);
    let bounce = Bounce::new(motion, solver, &plan)?;
    let engagement = bounce.engagement();
    Ok(Box::new(move |time| Stance {
        soles: both_soles(&bounce, time, plan.sole_aside_m, 0.0),
        arms: bent_arms(&bounce, engagement.at(time), time),
        ..crouching(&bounce, time)
    }))
}

pub fn one_leg_hop<'a>(
    motion: &Procedural,
    solver: &'a IkSolver,
) -> Result<StanceAt<'a>, MotionError> {
    let prepare_seconds = 0.9;
    let plan = BouncePlan {
        prepare_seconds,
        ..plan(motion, solver)
    };
    let bounce = Bounce::new(motion, solver, &plan)?;
    let engagement = bounce.engagement();
    let start = LEAD_SECONDS;
    // The weight goes over the left foot, then the right one lifts; at the end the reverse.
    let weight = Track::through(&[
        (start, 0.0),
        (start + 0.6, 1.0),
        (bounce.end - 0.35, 1.0),
        (bounce.end + 0.25, 0.0),
    ]);
    let lifted = Track::through(&[
        (start + 0.3, 0.0),
        (start + prepare_seconds + 0.2, 1.0),
        (bounce.last_bottom + 0.1, 1.0),
        (bounce.end, 0.0),
    ]);
    let over_foot_m = 0.85 * (solver.sole_aside_m() + plan.sole_aside_m);
    let leg_m = solver.leg_m;
    Ok(Box::new(move |time| {
        let mut stance = crouching(&bounce, time);
        let (weight, lifted) = (weight.at(time), lifted.at(time));
        stance.pelvis_shift_m.x = over_foot_m * weight;
        stance.pelvis_turn.z = -0.05 * weight;
        stance.chest_turn.z = 0.03 * weight;
        stance.soles = both_soles(&bounce, time, plan.sole_aside_m, 0.0);
        let hanging_m = DVec3::new(
            stance.pelvis_shift_m.x - plan.sole_aside_m,
            0.3 * leg_m + bounce.pelvis_m.at(time) - bounce.stand_m,
            -0.3 * leg_m,
        );
        let right = &mut stance.soles.right;
        right.shift_m.y = 0.0;
        right.shift_m = right.shift_m.lerp(hanging_m, lifted);
        right.pitch = 0.9 * lifted;
        stance.arms = bent_arms(&bounce, engagement.at(time), time);
        stance.arms.left.aside += 0.25 * weight;
        stance.arms.right.aside += 0.25 * weight;
        stance
    }))
}

pub fn jumping_jacks<'a>(
    motion: &Procedural,
    solver: &'a IkSolver,
) -> Result<StanceAt<'a>, MotionError> {
    let period_seconds = 0.5 / motion.tempo_hz;
    let wide_m = aside_shift_m(solver, 0.42 * solver.leg_m);
    let plan = BouncePlan {
        period_seconds,
        widest_m: wide_m,
        multiple: 2,
        ..plan(motion, solver)
    };
    let bounce = Bounce::new(motion, solver, &plan)?;
    let mut legs = Vec::new();
    let mut arms = Vec::new();
    for (idx, flight) in bounce.flights.iter().enumerate() {
        let (before, after) = if idx % 2 == 0 { (0.0, 1.0) } else { (1.0, 0.0) };
        legs.extend([(flight.start, before), (flight.end, after)]);
        // Arms take the time of the contacts too; they are longer than legs.
        let margin = 0.8 * bounce.push_seconds;
        arms.extend([
            (flight.start - margin, before),
            (flight.end + margin, after),
        ]);
    }
    let (legs, arms) = (Track::through(&legs), Track::through(&arms));
    // At quick tempos the arms swing less far: hands would pull away otherwise.
    let lift = (9.0 * period_seconds / 1.875).min(2.5);
    Ok(Box::new(move |time| {
        let aside_m = plan.sole_aside_m + (wide_m - plan.sole_aside_m) * legs.at(time);
        let up = arms.at(time);
        let arm = Arm {
            ahead: 0.0,
            aside: lift * up,
            bend: -0.3 * up,
        };
        Stance {
            soles: both_soles(&bounce, time, aside_m, 0.0),
            arms: Sides {
                left: arm,
                right: arm,
            },
            ..crouching(&bounce, time)
        }
    }))
}

pub fn run_in_place<'a>(
    motion: &Procedural,
    solver: &'a IkSolver,
) -> Result<StanceAt<'a>, MotionError> {
    let plan = BouncePlan {
        multiple: 2,
        ..plan(motion, solver)
    };
    let bounce = Bounce::new(motion, solver, &plan)?;
    let engagement = bounce.engagement();
    // Even flights leave from the left foot and land on the right one. The right foot lifts before
    // the first, the left one comes down after standing up from the last, which is odd.
    let (flights, count) = (&bounce.flights, bounce.flights.len());
    let mut left = Vec::new();
    let mut right = vec![(LEAD_SECONDS + 0.05, flights[0].end)];
    for idx in 0..count {
        let lands = flights.get(idx + 1).map_or(bounce.end, |next| next.end);
        let in_air = (flights[idx].start, lands);
        if idx % 2 == 0 {
            left.push(in_air)
        } else {
            right.push(in_air)
        }
    }
    let swings = Sides {
        left: swing_track(&left),
        right: swing_track(&right),
    };
    let lift_m = 0.3 * solver.leg_m;
    Ok(Box::new(move |time| {
        let mut stance = crouching(&bounce, time);
        let (left, right) = (swings.left.at(time), swings.right.at(time));
        let on = engagement.at(time);
        let sole = |x: f64, swing: f64| Sole {
            shift_m: DVec3::new(x, lift_m * swing, -0.15 * lift_m * swing),
            pitch: 0.7 * swing,
            spring: bounce.spring(time),
        };
        stance.soles = Sides {
            left: sole(plan.sole_aside_m, left),
            right: sole(-plan.sole_aside_m, right),
        };
        // The weight is over the foot that stands, the knee that lifts turns the pelvis.
        let to_left = smooth_step(right) - smooth_step(left);
        stance.pelvis_shift_m.x = 0.03 * to_left;
        stance.pelvis_turn.y = 0.08 * to_left;
        stance.pelvis_turn.z = -0.04 * to_left;
        stance.chest_turn.y = -0.2 * to_left;
        let arm = |ahead: f64| Arm {
            ahead: on * 0.05 + 0.45 * ahead,
            aside: 0.1 * on,
            bend: 0.9 * on,
        };
        stance.arms = Sides {
            left: arm(to_left),
            right: arm(-to_left),
        };
        stance
    }))
}

/// Rises to 1 and falls back to 0 within each interval.
fn swing_track(in_air: &[(f64, f64)]) -> Track {
    let keys: Vec<(f64, f64)> = in_air
        .iter()
        .flat_map(|(start, end)| [(*start, 0.0), (0.5 * (start + end), 1.0), (*end, 0.0)])
        .collect();
    Track::through(&keys)
}
