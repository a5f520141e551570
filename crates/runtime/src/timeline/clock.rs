//! The model's own 60 Hz clock under a host that draws at any rate.
//!
//! The network must tick at the rate it learned at, whatever the display does. The clock turns the
//! host's poses and time steps into ticks: each tick gets the pose interpolated to its instant.
//! What is shown lies between the last two ticks, one tick (16.7 ms) behind the host, because at
//! the host's instant only ticks of the past exist.

use dynaskin_skeleton::{
    CUT_ANGULAR_VELOCITY_CHANGE_RAD_S, CUT_VELOCITY_CHANGE_M_S, MAX_STEP_SECONDS,
    MIN_CUT_STEP_SECONDS, MODEL_RATE_HZ, Pose, rotation_vector,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::RuntimeError;
use crate::features::ROTATION_JOINTS;
use crate::state;
use crate::timeline::interpolation::{Rates, Way};

/// Longest time step there is, in seconds: a day. No computer sleeps between two frames for longer,
/// so a longer one is a date or a count of milliseconds.
const MAX_PLAUSIBLE_STEP_SECONDS: f64 = 86_400.0;

/// Steps that together are no longer than this count as one when poses are interpolated.
const SHORT_STEP_SECONDS: f64 = 0.02;

/// Slack in ticks, against rounding in hosts that step by exactly one tick.
const TICK_SLACK: f64 = 1e-6;

/// Why a step settled an avatar's tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Settled {
    /// The first pose, or the first after a reset.
    FirstPose,
    /// The time step was longer than [`MAX_STEP_SECONDS`].
    Stall,
    /// The body jumped: see [`CUT_VELOCITY_CHANGE_M_S`], [`CUT_ANGULAR_VELOCITY_CHANGE_RAD_S`].
    Cut,
    /// The avatar was asleep or not visible.
    Woken,
}

/// What a step asks the avatar to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Advance {
    /// Take the pose as one in which the body has stood for long.
    Settle(Settled),
    /// Run the ticks of this step.
    Tick(Ticks),
}

/// The ticks that fall into one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ticks {
    /// How many.
    pub count: usize,
    /// Where the first lies between the pose before (0) and the new pose (1).
    first: f64,
    /// Distance between two ticks on that scale.
    spacing: f64,
}

impl Ticks {
    /// None.
    pub const NONE: Self = Self {
        count: 0,
        first: 0.0,
        spacing: 0.0,
    };

    /// Where tick `index` lies between the pose before (0) and the new pose (1).
    pub fn position(&self, index: usize) -> f64 {
        (self.first + self.spacing * index as f64).clamp(0.0, 1.0)
    }
}

/// Time and motion seen so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct TickClock {
    pose: Option<Pose>,
    /// A pose before that, and the seconds between the two; none right after a settling.
    earlier: Option<(Pose, f64)>,
    /// How fast `pose` changed when it was reached.
    rates: Option<Rates>,
    velocity: Option<Velocity>,
    /// Ticks since the last tick, 0..1.
    phase: f64,
}

/// What a cut is recognised by.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Velocity {
    root_m_s: DVec3,
    joints_rad_s: [DVec3; ROTATION_JOINTS.len() + 1],
}

impl TickClock {
    /// Forgets everything: the next pose is the first.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Ticks from the last tick to the host's instant, 0..1, after the step that was planned: what
    /// is shown lies this far from the tick before the last to the last.
    pub fn phase_after(&self, dt_seconds: f64, advance: Advance) -> f64 {
        match advance {
            Advance::Settle(_) => 0.0,
            Advance::Tick(ticks) => {
                let ahead = self.phase + dt_seconds * MODEL_RATE_HZ - ticks.count as f64;
                ahead.clamp(0.0, 1.0)
            }
        }
    }

    /// The pose of tick `index` of a planned step that ends with `pose`.
    pub fn pose_of_tick(&self, ticks: Ticks, index: usize, pose: &Pose) -> Pose {
        let position = ticks.position(index);
        match &self.pose {
            // Hosts at the model's rate need no interpolation, and get none of its rounding.
            Some(before) if position < 1.0 - 1e-5 => {
                let seconds = 1.0 / (ticks.spacing * MODEL_RATE_HZ);
                self.way(before, pose, seconds).pose_at(position)
            }
            _ => pose.clone(),
        }
    }

    fn way<'a>(&'a self, before: &'a Pose, after: &'a Pose, seconds: f64) -> Way<'a> {
        Way {
            earlier: self.earlier.as_ref().map(|(pose, age)| (pose, *age)),
            start_rates: self.rates.as_ref(),
            before,
            after,
            seconds,
        }
    }

    /// Another length is one metre now: `ratio` is the old one over the new one.
    pub fn rescale(&mut self, ratio: f64) {
        let earlier = self.earlier.as_mut().map(|(pose, _)| pose);
        for pose in self.pose.iter_mut().chain(earlier) {
            pose.root_translation_m *= ratio;
        }
        if let Some(rates) = &mut self.rates {
            rates.root_m_s *= ratio;
        }
        if let Some(velocity) = &mut self.velocity {
            velocity.root_m_s *= ratio;
        }
    }

    /// Whether a clock from a saved state can go on.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`], [`RuntimeError::InvalidPose`].
    pub fn check_saved(&self) -> Result<(), RuntimeError> {
        let earlier = self.earlier.as_ref();
        state::check_poses(self.pose.iter().chain(earlier.map(|(pose, _)| pose)))?;
        state::check_numbers(earlier.map(|(_, age_seconds)| *age_seconds))?;
        if let Some(rates) = &self.rates {
            state::check_vectors([&rates.root_m_s])?;
            state::check_vectors(&rates.joints_rad_s)?;
        }
        if let Some(velocity) = &self.velocity {
            state::check_vectors([&velocity.root_m_s])?;
            state::check_vectors(&velocity.joints_rad_s)?;
        }
        if (0.0..=1.0).contains(&self.phase) {
            Ok(())
        } else {
            Err(state::invalid("its clock is not between two ticks"))
        }
    }

    /// The last pose that took time.
    pub fn pose(&self) -> Option<&Pose> {
        self.pose.as_ref()
    }

    /// Whether `dt_seconds` can be used.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidTimeStep`].
    pub fn check(dt_seconds: f64) -> Result<(), RuntimeError> {
        if (0.0..=MAX_PLAUSIBLE_STEP_SECONDS).contains(&dt_seconds) {
            Ok(())
        } else {
            Err(RuntimeError::InvalidTimeStep { got: dt_seconds })
        }
    }

    /// What happens in the step of `dt_seconds` that ends with `pose`. Changes nothing;
    /// [`Self::commit`] does.
    pub fn plan(&self, pose: &Pose, dt_seconds: f64) -> Advance {
        let Some(before) = &self.pose else {
            return Advance::Settle(Settled::FirstPose);
        };
        if dt_seconds > MAX_STEP_SECONDS {
            return Advance::Settle(Settled::Stall);
        }
        if dt_seconds == 0.0 {
            return Advance::Tick(Ticks::NONE);
        }
        if let Some(velocity) = &self.velocity
            && velocity.cut(&Velocity::between(before, pose, dt_seconds))
        {
            return Advance::Settle(Settled::Cut);
        }
        let step = dt_seconds * MODEL_RATE_HZ;
        Advance::Tick(Ticks {
            count: (self.phase + step + TICK_SLACK).floor() as usize,
            first: (1.0 - self.phase) / step,
            spacing: 1.0 / step,
        })
    }

    /// Moves on by the step that was planned.
    pub fn commit(&mut self, pose: &Pose, dt_seconds: f64, advance: Advance) {
        match advance {
            Advance::Settle(_) => {
                self.velocity = None;
                self.rates = None;
                self.earlier = None;
                self.pose = None;
            }
            // In a pause the clock keeps the pose at which it stopped: a host that scrubs while
            // paused has moved the body in no time, which the next step sees as a cut.
            Advance::Tick(_) if dt_seconds == 0.0 => return,
            Advance::Tick(_) => {
                let before = self.pose.as_ref();
                self.velocity = before.map(|before| Velocity::between(before, pose, dt_seconds));
                self.rates =
                    before.and_then(|before| self.way(before, pose, dt_seconds).end_rates());
            }
        }
        self.phase = self.phase_after(dt_seconds, advance);
        let before = self.pose.replace(pose.clone());
        self.earlier = match (self.earlier.take(), before) {
            // After a short step, an older pose is the better third for a parabola.
            (Some((older, age)), _) if dt_seconds + age <= SHORT_STEP_SECONDS => {
                Some((older, age + dt_seconds))
            }
            (_, before) => before.map(|before| (before, dt_seconds)),
        };
    }
}

impl Velocity {
    fn between(before: &Pose, after: &Pose, dt_seconds: f64) -> Self {
        let dt_seconds = dt_seconds.max(MIN_CUT_STEP_SECONDS);
        let turn = |joint: usize| {
            let (from, to) = (
                before.parent_from_joint[joint],
                after.parent_from_joint[joint],
            );
            rotation_vector(to * from.conjugate()) / dt_seconds
        };
        let mut joints_rad_s = [DVec3::ZERO; ROTATION_JOINTS.len() + 1];
        joints_rad_s[0] = turn(0);
        for (slot, joint) in ROTATION_JOINTS.into_iter().enumerate() {
            joints_rad_s[slot + 1] = turn(joint as usize);
        }
        Self {
            root_m_s: (after.root_translation_m - before.root_translation_m) / dt_seconds,
            joints_rad_s,
        }
    }

    fn cut(&self, next: &Self) -> bool {
        let jumped = |a: DVec3, b: DVec3, limit: f64| a.distance_squared(b) > limit * limit;
        jumped(self.root_m_s, next.root_m_s, CUT_VELOCITY_CHANGE_M_S)
            || self
                .joints_rad_s
                .iter()
                .zip(&next.joints_rad_s)
                .any(|(a, b)| jumped(*a, *b, CUT_ANGULAR_VELOCITY_CHANGE_RAD_S))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Steps `clock` through `dts`, the root moving at `speed_m_s`; gives each step's ticks.
    fn ticks(clock: &mut TickClock, dts: &[f64], speed_m_s: f64) -> Vec<usize> {
        let mut time = 0.0;
        let mut counts = Vec::new();
        for &dt in dts {
            time += dt;
            let mut pose = Pose::REST;
            pose.root_translation_m.x = speed_m_s * time;
            let advance = clock.plan(&pose, dt);
            clock.commit(&pose, dt, advance);
            match advance {
                Advance::Tick(ticks) => counts.push(ticks.count),
                Advance::Settle(_) => counts.push(usize::MAX),
            }
        }
        counts
    }

    #[test]
    fn a_host_at_the_models_rate_ticks_once_a_step() {
        let mut clock = TickClock::default();
        let counts = ticks(&mut clock, &[1.0 / 60.0; 500], 1.0);
        assert_eq!(counts[0], usize::MAX);
        assert!(counts[1..].iter().all(|&count| count == 1), "{counts:?}");
    }

    #[test]
    fn every_rate_ticks_sixty_times_a_second() {
        for rate in [24.0, 30.0, 59.94, 90.0, 120.0, 144.0, 240.0, 1000.0] {
            let mut clock = TickClock::default();
            let mut dts = vec![1.0 / rate; 10 * rate as usize + 1];
            dts[0] = 0.0;
            let counts = ticks(&mut clock, &dts, 3.0);
            let sum: usize = counts[1..].iter().sum();
            let expected = (10 * rate as usize) as f64 / rate * 60.0;
            assert!((sum as f64 - expected).abs() <= 1.0, "{rate} Hz: {sum}");
        }
    }

    #[test]
    fn tick_positions_follow_the_phase() {
        let mut clock = TickClock::default();
        ticks(&mut clock, &[0.0, 0.5 / 60.0], 0.0);
        assert!((clock.phase - 0.5).abs() < 1e-9);
        let Advance::Tick(ticks) = clock.plan(&Pose::REST, 2.0 / 60.0) else {
            panic!("no cut here");
        };
        assert_eq!(ticks.count, 2);
        assert!((ticks.position(0) - 0.25).abs() < 1e-9);
        assert!((ticks.position(1) - 0.75).abs() < 1e-9);
    }

    #[test]
    fn a_steady_ride_is_no_cut_and_a_teleport_is_one() {
        let mut clock = TickClock::default();
        let counts = ticks(&mut clock, &[1.0 / 60.0; 10], 50.0);
        assert!(counts[1..].iter().all(|&count| count == 1));

        let mut clock = TickClock::default();
        ticks(&mut clock, &[1.0 / 60.0; 10], 0.0);
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::new(0.0, 0.0, 5.0);
        let teleport = clock.plan(&pose, 1.0 / 60.0);
        assert_eq!(teleport, Advance::Settle(Settled::Cut));

        let mut pose = Pose::REST;
        pose.parent_from_joint[1] = DQuat::from_rotation_x(1.5);
        let cut = clock.plan(&pose, 1.0 / 60.0);
        assert_eq!(cut, Advance::Settle(Settled::Cut));
    }

    #[test]
    fn stalls_pauses_and_bad_steps() {
        let mut clock = TickClock::default();
        ticks(&mut clock, &[1.0 / 60.0; 3], 0.0);
        let stall = clock.plan(&Pose::REST, 3.0);
        assert_eq!(stall, Advance::Settle(Settled::Stall));
        assert_eq!(ticks(&mut clock, &[0.0, 0.0], 0.0), [0, 0]);
        for dt in [f64::NAN, f64::INFINITY, -0.1, 1.7e12] {
            let error = TickClock::check(dt).unwrap_err();
            assert!(matches!(error, RuntimeError::InvalidTimeStep { .. }));
        }
    }
}
