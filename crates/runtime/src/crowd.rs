//! Many avatars of one model, stepped by one call.

use std::sync::Arc;

use dynaskin_body::Pose;

use crate::RuntimeError;
use crate::avatar::{Avatar, step_all};
use crate::model::Model;
use crate::pipeline::{Pipeline, StageSeconds, Stopwatch};
use crate::pose;
use crate::timeline::{Detail, check_step};

/// A level that was left comes back only this much nearer than where it was left, as a fraction.
const DISTANCE_HYSTERESIS: f64 = 0.1;

/// Detail comes back only if all then fits into this fraction of the budget.
const BUDGET_HYSTERESIS: f64 = 0.85;

/// Steps between two decisions about the budget: half a second at 60 Hz.
const DECISION_STEPS: usize = 30;

/// Weight of the newest step in the measured costs.
const COST_WEIGHT: f64 = 0.05;

/// When avatars of a [`Crowd`] get less [`Detail`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LevelOfDetail {
    /// From this distance on ([`Avatar::set_distance_m`]), in metres, an avatar has
    /// [`Detail::Half`].
    pub half_beyond_m: f64,
    /// From this distance on, in metres, an avatar is [`Detail::Asleep`]. At least
    /// `half_beyond_m`.
    pub asleep_beyond_m: f64,
    /// Seconds of this thread that all tissue together may take per tick (1/60 s), if there is a
    /// limit: if it would take more, the farthest avatars get less detail than by distance.
    /// Measured with the stopwatch given to [`Crowd::step_all`], so the result depends
    /// on the machine.
    pub budget_seconds: Option<f64>,
}

impl Default for LevelOfDetail {
    /// At 12 m, an offset of 10 mm is one pixel of a picture 1,080 pixels high (50° of view); at
    /// 40 m it is a third of one.
    fn default() -> Self {
        Self {
            half_beyond_m: 12.0,
            asleep_beyond_m: 40.0,
            budget_seconds: None,
        }
    }
}

impl LevelOfDetail {
    fn check(&self) -> Result<(), RuntimeError> {
        let refused = |field, expected, got| {
            Err(RuntimeError::InvalidLevelOfDetail {
                field,
                expected,
                got,
            })
        };
        if self.half_beyond_m.is_nan() || self.half_beyond_m < 0.0 {
            return refused("half_beyond_m", "give metres from 0", self.half_beyond_m);
        }
        if self.asleep_beyond_m.is_nan() || self.asleep_beyond_m < self.half_beyond_m {
            let expected = "give metres, at least as many as half_beyond_m";
            return refused("asleep_beyond_m", expected, self.asleep_beyond_m);
        }
        match self.budget_seconds {
            Some(budget) if !(budget > 0.0 && budget.is_finite()) => {
                refused("budget_seconds", "give seconds above 0", budget)
            }
            _ => Ok(()),
        }
    }

    /// The detail at a distance, after `now`.
    fn at_distance(&self, distance_m: f64, now: Detail) -> Detail {
        let beyond = |limit_m: f64, detail: Detail| {
            // Having passed the limit, it must come back some way to be near again.
            let limit_m = if now <= detail {
                limit_m * (1.0 - DISTANCE_HYSTERESIS)
            } else {
                limit_m
            };
            distance_m >= limit_m
        };
        if beyond(self.asleep_beyond_m, Detail::Asleep) {
            Detail::Asleep
        } else if beyond(self.half_beyond_m, Detail::Half) {
            Detail::Half
        } else {
            Detail::Full
        }
    }
}

/// What one [`Crowd::step_all`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CrowdReport {
    /// Visible avatars at full detail.
    pub full: usize,
    /// Visible avatars at half detail.
    pub half: usize,
    /// Avatars asleep or out of sight.
    pub asleep: usize,
    /// Time of each stage, for all avatars together; zeros unless the stopwatch runs.
    pub seconds: StageSeconds,
}

/// Steps many avatars of one model: every network is called once for all of them, so an avatar
/// costs less than alone; its surface is the same up to rounding.
///
/// ```no_run
/// # use std::sync::Arc;
/// # use dynaskin_body::Pose;
/// # use dynaskin_runtime::{Avatar, Crowd, LevelOfDetail, Model, RuntimeError};
/// # fn run(model: &Arc<Model>, poses: &[Pose]) -> Result<(), RuntimeError> {
/// let mut avatars = Vec::new();
/// for _ in poses {
///     avatars.push(Avatar::new(Arc::clone(model), &[0.0; 10])?);
/// }
/// let mut crowd = Crowd::new(Arc::clone(model))?;
/// crowd.set_level_of_detail(Some(LevelOfDetail::default()))?;
/// let mut all: Vec<&mut Avatar> = avatars.iter_mut().collect();
/// crowd.step_all(&mut all, poses, 1.0 / 60.0, &mut || 0.0)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Crowd {
    model: Arc<Model>,
    /// None without networks.
    pipeline: Option<Pipeline>,
    level_of_detail: Option<LevelOfDetail>,
    costs: Costs,
    /// Steps since the last decision about the budget.
    steps: usize,
    /// Whether any of them measured the cost of a tick.
    measured: bool,
    /// The farthest first.
    order: Vec<usize>,
    /// Detail by distance.
    wanted: Vec<Detail>,
    /// The most that fits into the budget, and what leaves room in it.
    fitting: [Vec<Detail>; 2],
}

/// Measured seconds per avatar.
#[derive(Clone, Copy, Debug, Default)]
struct Costs {
    /// Of a tick: features and predictor.
    tick: Average,
    /// Of a surface: decoder, positions and normals.
    surface: Average,
}

impl Crowd {
    /// A crowd for avatars of `model`, without a level of detail.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] if the networks cannot be set up.
    pub fn new(model: Arc<Model>) -> Result<Self, RuntimeError> {
        let pipeline = match model.soft() {
            Some(soft) => Some(Pipeline::new(&soft.networks)?),
            None => None,
        };
        Ok(Self {
            model,
            pipeline,
            level_of_detail: None,
            costs: Costs::default(),
            steps: 0,
            measured: false,
            order: Vec::new(),
            wanted: Vec::new(),
            fitting: [Vec::new(), Vec::new()],
        })
    }

    /// When avatars get less detail; without it they keep the value of [`Avatar::set_detail`].
    pub fn level_of_detail(&self) -> Option<&LevelOfDetail> {
        self.level_of_detail.as_ref()
    }

    /// Changes when avatars get less detail; [`Self::step_all`] then sets every avatar's detail.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidLevelOfDetail`]; nothing changes.
    pub fn set_level_of_detail(
        &mut self,
        level_of_detail: Option<LevelOfDetail>,
    ) -> Result<(), RuntimeError> {
        if let Some(level_of_detail) = &level_of_detail {
            level_of_detail.check()?;
        }
        self.level_of_detail = level_of_detail;
        self.steps = 0;
        Ok(())
    }

    /// Advances every avatar by `dt_seconds` to its pose, as [`Avatar::step`] does. `poses[i]` is for
    /// `avatars[i]`. `stopwatch` returns seconds since any fixed instant; it is needed for a budget, and for
    /// [`CrowdReport::seconds`].
    ///
    /// # Errors
    /// [`RuntimeError::InvalidCrowd`] for another number of poses than avatars and for an avatar of
    /// another model; [`RuntimeError::InvalidPose`], [`RuntimeError::InvalidTimeStep`]: all avatars
    /// stay unchanged. [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: some surfaces may
    /// have changed, and the next poses count as the first.
    pub fn step_all(
        &mut self,
        avatars: &mut [&mut Avatar],
        poses: &[Pose],
        dt_seconds: f64,
        stopwatch: Stopwatch<'_>,
    ) -> Result<CrowdReport, RuntimeError> {
        let refused = |problem: String| Err(RuntimeError::InvalidCrowd { problem });
        if avatars.len() != poses.len() {
            return refused(format!("{} avatars, {} poses", avatars.len(), poses.len()));
        }
        for (idx, avatar) in avatars.iter().enumerate() {
            if !Arc::ptr_eq(avatar.model(), &self.model) {
                return refused(format!("avatar {idx} is of another model"));
            }
        }
        check_step(dt_seconds)?;
        for (idx, pose) in poses.iter().enumerate() {
            pose::check(pose).map_err(|error| of_avatar(error, idx))?;
        }
        self.choose_detail(avatars);
        let mut report = CrowdReport::default();
        for (avatar, pose) in avatars.iter_mut().zip(poses) {
            avatar.plan(pose, dt_seconds)?;
            match avatar.detail() {
                _ if !avatar.visible() => report.asleep += 1,
                Detail::Asleep => report.asleep += 1,
                Detail::Half => report.half += 1,
                Detail::Full => report.full += 1,
            }
        }
        report.seconds = step_all(self.pipeline.as_mut(), avatars, stopwatch)?;
        self.measure(avatars, &report.seconds);
        Ok(report)
    }

    /// Learns from a step what avatars cost.
    fn measure(&mut self, avatars: &[&mut Avatar], seconds: &StageSeconds) {
        self.steps += 1;
        let (mut ticks, mut surfaces) = (0, 0);
        for avatar in avatars {
            let report = avatar.report();
            // Settling is many ticks in one step, and no measure of what a tick costs.
            if report.settled.is_some() {
                return;
            }
            ticks += report.ticks;
            surfaces += usize::from(avatar.has_shown());
        }
        if ticks > 0 {
            self.measured = true;
            self.costs
                .tick
                .add(seconds.features + seconds.predict, ticks);
        }
        if surfaces > 0 {
            self.costs
                .surface
                .add(seconds.decode + seconds.apply, surfaces);
        }
    }

    /// Gives every avatar the detail of its distance, or less where the budget asks for it.
    fn choose_detail(&mut self, avatars: &mut [&mut Avatar]) {
        let Some(level_of_detail) = self.level_of_detail else {
            return;
        };
        self.wanted.clear();
        self.wanted.extend(
            avatars
                .iter()
                .map(|avatar| level_of_detail.at_distance(avatar.distance_m(), avatar.detail())),
        );
        let decides = match level_of_detail.budget_seconds {
            Some(budget) if self.steps >= DECISION_STEPS => {
                if !self.measured {
                    // All sleep, perhaps because of one slow moment: try again some day.
                    self.costs.tick.0 *= 0.5;
                    self.costs.surface.0 *= 0.5;
                }
                self.fit(avatars, budget);
                (self.steps, self.measured) = (0, false);
                true
            }
            _ => false,
        };
        for (idx, avatar) in avatars.iter_mut().enumerate() {
            let now = avatar.detail();
            let next = if decides {
                let [least, most] = [self.fitting[1][idx], self.fitting[0][idx]];
                now.clamp(least.min(most), most)
            } else if level_of_detail.budget_seconds.is_some() && self.costs.tick.known() {
                self.wanted[idx].min(now)
            } else {
                self.wanted[idx]
            };
            if next != now {
                avatar.set_detail(next);
                // Half of those at half detail show theirs in even frames, half in odd ones.
                avatar.take_turn(idx);
            }
        }
    }

    /// Fills `fitting` with what fits into the budget, and with what leaves room in it.
    fn fit(&mut self, avatars: &[&mut Avatar], budget_seconds: f64) {
        self.order.clear();
        self.order
            .extend((0..avatars.len()).filter(|&idx| avatars[idx].visible()));
        let distance_m = |idx: usize| avatars[idx].distance_m();
        self.order
            .sort_unstable_by(|&a, &b| distance_m(b).total_cmp(&distance_m(a)).then(b.cmp(&a)));
        let budgets = [budget_seconds, BUDGET_HYSTERESIS * budget_seconds];
        for (details, budget_seconds) in self.fitting.iter_mut().zip(budgets) {
            details.clone_from(&self.wanted);
            let costs = &self.costs;
            let mut load: f64 = self.order.iter().map(|&idx| costs.of(details[idx])).sum();
            for less in [Detail::Half, Detail::Asleep] {
                for &idx in &self.order {
                    if load > budget_seconds && details[idx] > less {
                        load -= costs.of(details[idx]) - costs.of(less);
                        details[idx] = less;
                    }
                }
            }
        }
    }
}

/// An average that follows slowly.
#[derive(Clone, Copy, Debug, Default)]
struct Average(f64);

impl Average {
    fn known(self) -> bool {
        self.0 > 0.0
    }

    fn add(&mut self, sum: f64, count: usize) {
        let newest = sum / count as f64;
        let weight = if self.known() { COST_WEIGHT } else { 1.0 };
        self.0 += weight * (newest - self.0);
    }
}

impl Costs {
    /// Seconds per tick.
    fn of(&self, detail: Detail) -> f64 {
        match detail {
            Detail::Asleep => 0.0,
            Detail::Half => self.tick.0 + 0.5 * self.surface.0,
            Detail::Full => self.tick.0 + self.surface.0,
        }
    }
}

/// `error`, naming the avatar whose pose it is about.
fn of_avatar(error: RuntimeError, idx: usize) -> RuntimeError {
    match error {
        RuntimeError::InvalidPose { place, value } => RuntimeError::InvalidPose {
            place: format!("{place} (of avatar {idx})"),
            value,
        },
        error => error,
    }
}
