//! The vertical course of the pelvis through flights and ground contacts.

use dynaskin_skeleton::GRAVITY_M_S2 as GRAVITY;

use super::ik::IkSolver;
use super::parameters::{LEAD_SECONDS, Procedural};
use super::track::{Knot, Track, smooth_step};
use crate::MotionError;

/// Largest acceleration of the pelvis in contact, in m/s².
const MAX_CONTACT_ACCELERATION: f64 = 45.0;
/// Aim for the acceleration with which soles leave the floor, in m/s².
const SOLE_ACCELERATION: f64 = 40.0;
/// Least depth of a contact below standing, per length of leg.
const MIN_CROUCH: f64 = 0.06;
/// Usual durations of sinking into the first crouch and of standing up, in seconds.
const SINK_SECONDS: f64 = 0.45;
const RISE_SECONDS: f64 = 0.6;

/// A flight of the pelvis: ballistic from `start` to `end`.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    pub start: f64,
    pub end: f64,
}

/// Flights at a fixed period, with a crouch before the first and standing up after the last.
#[derive(Debug)]
pub struct Bounce {
    /// Height of the pelvis over its place in the rest pose, in metres.
    pub pelvis_m: Track,
    pub flights: Vec<Flight>,
    /// Height of the pelvis at take-off and touch-down.
    pub release_m: f64,
    /// Height of the pelvis while standing.
    pub stand_m: f64,
    /// Time from the lowest point to take-off, and from touch-down to the lowest point.
    pub push_seconds: f64,
    /// When the first crouch is deepest, the last one is, and when the body stands again.
    pub first_bottom: f64,
    pub last_bottom: f64,
    pub end: f64,
    speed: f64,
    launch_seconds: f64,
}

/// What a bounce needs to know beside the tempo and height of the motion.
pub struct BouncePlan {
    /// Time from flight to flight, in seconds.
    pub period_seconds: f64,
    /// Time for getting into position before the first crouch, in seconds.
    pub prepare_seconds: f64,
    /// Sideways place of the soles while standing, and at their widest, relative to the rest pose.
    pub sole_aside_m: f64,
    pub widest_m: f64,
    /// The number of flights is a multiple of this.
    pub multiple: usize,
}

impl Bounce {
    pub fn new(
        motion: &Procedural,
        solver: &IkSolver,
        plan: &BouncePlan,
    ) -> Result<Self, MotionError> {
        let height_m = motion.height_m;
        let period = plan.period_seconds;
        let speed = (2.0 * GRAVITY * height_m).sqrt();
        let flight_seconds = 2.0 * speed / GRAVITY;
        // In a contact of length 2T that is a quartic in time, the acceleration peaks at
        // 1.5 v / T + g / 2 (see `push`).
        let shortest_contact = 3.0 * speed / (MAX_CONTACT_ACCELERATION - GRAVITY / 2.0);
        let contact_seconds = period - flight_seconds;
        if contact_seconds < shortest_contact {
            let needed_per_speed = (flight_seconds + shortest_contact) / speed;
            return Err(MotionError::FlightDoesNotFit {
                motion: motion.kind.name(),
                height_m,
                tempo_hz: motion.tempo_hz,
                flight_seconds,
                max_height_m: (period / needed_per_speed).powi(2) / (2.0 * GRAVITY),
            });
        }
        let launch_seconds = (1.875 * speed / SOLE_ACCELERATION)
            .max(0.06)
            .min(0.9 * speed / GRAVITY);
        let stand_m = -solver.drop_for(plan.sole_aside_m);
        let depth_m = solver.leg_m * (0.07 + 0.11 * speed);
        let push_seconds = push_seconds(speed, depth_m).min(contact_seconds / 2.0);
        // In small hops the legs stay a little bent; strong ones end on tiptoe. The leg has to
        // stretch further while the soles gather speed after take-off.
        let tiptoe_m = solver.tiptoe_rise_m() * (speed / 2.0).min(1.0);
        let release_m = (stand_m.min(-solver.drop_for(plan.widest_m)) + tiptoe_m
            - launch_lag_m(speed, launch_seconds))
        .min(stand_m - MIN_CROUCH * solver.leg_m + sink_m(speed, push_seconds));

        let around = plan.prepare_seconds + SINK_SECONDS + 2.0 * push_seconds + RISE_SECONDS
            - contact_seconds;
        let count = motion.repetitions(period, around, plan.multiple)?;
        let first_bottom = LEAD_SECONDS + plan.prepare_seconds + SINK_SECONDS;
        let flights: Vec<Flight> = (0..count)
            .map(|idx| {
                let start = first_bottom + push_seconds + idx as f64 * period;
                Flight {
                    start,
                    end: start + flight_seconds,
                }
            })
            .collect();
        let last_bottom =
            first_bottom + 2.0 * push_seconds + (count - 1) as f64 * period + flight_seconds;
        let mut bounce = Self {
            pelvis_m: Track::default(),
            flights,
            release_m,
            stand_m,
            push_seconds,
            first_bottom,
            last_bottom,
            end: last_bottom + RISE_SECONDS,
            speed,
            launch_seconds,
        };
        bounce.pelvis_m = Track::new(bounce.knots(LEAD_SECONDS + plan.prepare_seconds));
        Ok(bounce)
    }

    /// The lowest point of a contact beside which the body stands, `seconds` away. The quintic from
    /// there to standing stays below standing while acceleration × seconds² ≤ 20 × rise; a bottom
    /// as hard as those between flights would throw the body up once more.
    fn soft_bottom(&self, time: f64, seconds: f64) -> Knot {
        let bottom = self.bottom(time);
        let rise_m = self.stand_m - bottom.value;
        Knot {
            acceleration: bottom.acceleration.min(16.0 * rise_m / (seconds * seconds)),
            ..bottom
        }
    }

    /// The lowest point of a contact: between touch-down and take-off the height is a quartic in
    /// time from the middle, `c0 + c2 τ² + c4 τ⁴`, that meets speed ±v and acceleration -g at
    /// τ = ±T. It follows that `c4 = -(g + v/T) / (8 T²)` and `2 c2 = 1.5 v/T + g/2`.
    fn bottom(&self, time: f64) -> Knot {
        let t = self.push_seconds;
        Knot {
            time,
            value: self.release_m - sink_m(self.speed, t),
            speed: 0.0,
            acceleration: 1.5 * self.speed / t + GRAVITY / 2.0,
        }
    }

    fn knots(&self, sink_start: f64) -> Vec<Knot> {
        let mut knots = vec![
            Knot::still(sink_start, self.stand_m),
            self.soft_bottom(self.first_bottom, self.first_bottom - sink_start),
        ];
        for (idx, flight) in self.flights.iter().enumerate() {
            let released = |time: f64, speed: f64| Knot {
                time,
                value: self.release_m,
                speed,
                acceleration: -GRAVITY,
            };
            knots.push(released(flight.start, self.speed));
            knots.push(released(flight.end, -self.speed));
            let sunk_time = flight.end + self.push_seconds;
            match self.flights.get(idx + 1) {
                Some(next) => self.pause(sunk_time, next.start - self.push_seconds, &mut knots),
                None => knots.push(self.soft_bottom(sunk_time, self.end - sunk_time)),
            }
        }
        knots.push(Knot::still(self.end, self.stand_m));
        knots
    }

    /// From the lowest point after a landing to the lowest before the next push. They are one in
    /// quick hopping; a longer pause rises between them, and a long one stands.
    fn pause(&self, sunk_time: f64, ready_time: f64, knots: &mut Vec<Knot>) {
        let (sunk, ready) = (self.bottom(sunk_time), self.bottom(ready_time));
        let pause = ready_time - sunk_time;
        if pause < 1e-6 {
            knots.push(sunk);
            return;
        }
        // Height that a quintic between both points rises by.
        let rise_m = sunk.acceleration * pause * pause / 32.0;
        if rise_m <= self.stand_m - sunk.value {
            knots.extend([sunk, ready]);
            return;
        }
        let rise = (pause / 2.0).min(RISE_SECONDS);
        knots.push(self.soft_bottom(sunk_time, rise));
        knots.push(Knot::still(sunk_time + rise, self.stand_m));
        if pause - 2.0 * rise > 1e-6 {
            knots.push(Knot::still(ready_time - rise, self.stand_m));
        }
        knots.push(self.soft_bottom(ready_time, rise));
    }

    /// The flight at `time`, with its number and the fraction of it that has passed.
    pub fn flight_at(&self, time: f64) -> Option<(usize, f64)> {
        self.flights.iter().enumerate().find_map(|(idx, flight)| {
            let passed = (time - flight.start) / (flight.end - flight.start);
            (0.0..=1.0).contains(&passed).then_some((idx, passed))
        })
    }

    /// Height in metres of soles that leave the floor with the pelvis and come back with it: they
    /// gather its speed smoothly, so the leg is longer in flight by [`launch_lag_m`].
    pub fn sole_m(&self, time: f64) -> f64 {
        let Some((idx, _)) = self.flight_at(time) else {
            return 0.0;
        };
        let flight = self.flights[idx];
        let from_contact = (time - flight.start).min(flight.end - time);
        if from_contact < self.launch_seconds {
            launched_m(self.speed, self.launch_seconds, from_contact)
        } else {
            self.pelvis_m.at(time) - self.release_m - launch_lag_m(self.speed, self.launch_seconds)
        }
    }

    /// 1 around flights, when heels lift early and knees stretch gently; 0 from a sixth of a second
    /// before the crouch and after the landing, when the soles are flat.
    pub fn spring(&self, time: f64) -> f64 {
        let distance = |flight: &Flight| (flight.start - time).max(time - flight.end);
        let nearest = self
            .flights
            .iter()
            .map(distance)
            .fold(f64::INFINITY, f64::min);
        1.0 - smooth_step((nearest - self.push_seconds) / 0.16)
    }

    /// How far the body crouches below standing, in metres; close to 0 in flight, smooth.
    pub fn crouch_m(&self, time: f64) -> f64 {
        let width_m = 0.03;
        let depth_m = self.stand_m - self.pelvis_m.at(time);
        width_m * ((depth_m / width_m).exp().ln_1p() - std::f64::consts::LN_2)
    }

    /// 0 while standing, 1 from the first crouch to the last.
    pub fn engagement(&self) -> Track {
        let start = LEAD_SECONDS;
        Track::through(&[
            (start, 0.0),
            (self.first_bottom, 1.0),
            (self.last_bottom, 1.0),
            (self.end, 0.0),
        ])
    }
}

/// How far the pelvis sinks below the release height in a contact of half length `push_seconds`.
fn sink_m(speed: f64, push_seconds: f64) -> f64 {
    push_seconds * (0.625 * speed + GRAVITY * push_seconds / 8.0)
}

/// Time T of a push over `depth_m` to `speed`: the inverse of [`sink_m`].
fn push_seconds(speed: f64, depth_m: f64) -> f64 {
    let b = 0.625 * speed;
    ((b * b + 0.5 * GRAVITY * depth_m).sqrt() - b) / (0.25 * GRAVITY)
}

/// Height of a sole at `time` after take-off, while `time` is below `launch_seconds` = T. Its speed
/// is the pelvis's, `v - g t`, times the smooth step `10 s³ - 15 s⁴ + 6 s⁵` of s = t/T.
fn launched_m(speed: f64, launch_seconds: f64, time: f64) -> f64 {
    let s = time / launch_seconds;
    let s4 = s * s * s * s;
    let even = s4 * (2.5 + s * (s - 3.0));
    let ramp = s4 * s * (2.0 + s * (6.0 / 7.0 * s - 2.5));
    launch_seconds * (speed * even - GRAVITY * launch_seconds * ramp)
}

/// How far a sole stays behind the pelvis in gathering its speed.
fn launch_lag_m(speed: f64, launch_seconds: f64) -> f64 {
    let rise_m = launch_seconds * (speed - GRAVITY * launch_seconds / 2.0);
    rise_m - launched_m(speed, launch_seconds, launch_seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_push_reaches_its_depth() {
        for (speed, depth_m) in [(0.5, 0.05), (1.3, 0.16), (2.4, 0.3)] {
            assert!((sink_m(speed, push_seconds(speed, depth_m)) - depth_m).abs() < 1e-12);
        }
    }

    #[test]
    fn a_launched_sole_gathers_the_speed_of_the_pelvis() {
        let (speed, launch_seconds) = (2.0, 0.1);
        let steps = 1000;
        let mut height_m = 0.0;
        for step in 0..steps {
            let s = (f64::from(step) + 0.5) / f64::from(steps);
            let pelvis_speed = speed - GRAVITY * s * launch_seconds;
            height_m += smooth_step(s) * pelvis_speed * launch_seconds / f64::from(steps);
        }
        assert!((height_m - launched_m(speed, launch_seconds, launch_seconds)).abs() < 1e-6);
        assert!(launch_lag_m(speed, launch_seconds) > 0.0);
    }
}
