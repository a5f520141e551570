//! Poses of a host in, poses on the source's clock out.

mod arrivals;
mod play;

use std::collections::VecDeque;

use dynaskin_skeleton::{MAX_STEP_SECONDS, Pose};

use crate::clock::SourceClock;
use crate::cut::Step;
use crate::diagnosis::{Diagnosis, NoiseGauge};
use crate::frames::FrameClock;
use crate::path::Knot;
use crate::skips::Skips;
use crate::smoother::Smoother;
use crate::source::PoseSource;

/// Poses whose root is nearer than this, in metres, and whose quaternions differ by less than
/// half of it in every number are the same pose: a tenth of a micrometre, and a ten-millionth of a
/// radian.
const HAIR: f64 = 1e-7;

/// After this long without a repeated pose every frame brings a new one again, in seconds.
const RELEASE_SECONDS: f64 = 0.8;

/// Arrivals that are remembered until an interval is known.
const LOG: usize = 9;

/// Most poses of the source between the playhead and now, with some behind it.
const KNOTS: usize = 15;

/// The input of the tissue's clock.
#[derive(Clone, Debug)]
pub struct Conditioned {
    /// The pose at the playhead.
    pub pose: Pose,
    /// Seconds by which the playhead moved.
    pub dt_seconds: f64,
    /// Whether the body jumped.
    pub cut: bool,
}

/// Stands between a host and the clock of one avatar's tissue.
#[derive(Clone, Debug)]
pub struct Conditioner {
    source: PoseSource,
    /// The host's time, in seconds since the first pose.
    now: f64,
    /// Mean time step of the host.
    frame: f64,
    raw: Option<Pose>,
    /// When it arrived.
    arrived: f64,
    /// The step to it, with its seconds.
    step: Option<(Step, f64)>,
    /// When the first pose came, or the first after a cut.
    began: f64,
    /// Whether the first pose is in the middle of a motion.
    goes_on: bool,
    /// Largest angular velocity of all joints together since then, in rad/s.
    peak: f64,
    /// The step before that.
    step_before: Option<(Step, f64)>,
    log: VecDeque<f64>,
    clock: Option<SourceClock>,
    engaged: bool,
    last_repeat: Option<f64>,
    /// When a pose last seemed to be held.
    held: f64,
    path: VecDeque<Knot>,
    smoother: Option<Smoother>,
    playhead: f64,
    playhead_before: f64,
    noise: NoiseGauge,
    frames: FrameClock,
    skips: Skips,
    /// Steps whose pose repeated that of the step before.
    run: u32,
    /// Whether the source was found to stand still.
    stands: bool,
    /// Intervals of the source between the last two poses.
    steps_before: f64,
}

impl Default for Conditioner {
    fn default() -> Self {
        Self {
            log: VecDeque::with_capacity(LOG + 1),
            path: VecDeque::with_capacity(KNOTS + 1),
            skips: Skips::default().cleared(),
            ..Self::empty()
        }
    }
}

impl Conditioner {
    /// Forgets all poses; the source stays.
    pub fn reset(&mut self) {
        // Memory once taken is kept, so that no later step has to allocate.
        let (mut log, mut path) = (
            std::mem::take(&mut self.log),
            std::mem::take(&mut self.path),
        );
        log.clear();
        path.clear();
        let skips = std::mem::take(&mut self.skips).cleared();
        *self = Self {
            source: self.source,
            log,
            path,
            skips,
            ..Self::empty()
        };
    }

    /// Forgets all poses in the middle of a motion: the next one does not begin it.
    pub fn resume(&mut self) {
        self.reset();
        self.goes_on = true;
    }

    /// Converts lengths after a change of unit: `ratio` is the old metre over the new one.
    pub fn rescale(&mut self, ratio: f64) {
        let steps = self.step.iter_mut().chain(self.step_before.iter_mut());
        for (step, _) in steps {
            step.root_m *= ratio;
        }
        if let Some(raw) = &mut self.raw {
            raw.root_translation_m *= ratio;
        }
        for knot in &mut self.path {
            knot.pose.root_translation_m *= ratio;
            knot.rates.root_m_s *= ratio;
        }
        // What it learned of noise it learns again.
        self.smoother = self.source.tuning().map(Smoother::new);
    }

    /// Whether the tissue is given other poses than the host's.
    pub fn engaged(&self) -> bool {
        self.engaged
    }

    fn empty() -> Self {
        Self {
            source: PoseSource::Display,
            now: 0.0,
            frame: 0.0,
            raw: None,
            arrived: 0.0,
            step: None,
            began: 0.0,
            goes_on: false,
            peak: 0.0,
            step_before: None,
            log: VecDeque::new(),
            clock: None,
            engaged: false,
            last_repeat: None,
            held: f64::NEG_INFINITY,
            path: VecDeque::new(),
            smoother: None,
            playhead: 0.0,
            playhead_before: 0.0,
            noise: NoiseGauge::default(),
            frames: FrameClock::default(),
            skips: Skips::default(),
            run: 0,
            stands: false,
            steps_before: 1.0,
        }
    }

    /// Where poses come from.
    pub fn source(&self) -> PoseSource {
        self.source
    }

    /// Sets where poses come from; the next pose counts as the first.
    pub fn set_source(&mut self, source: PoseSource) {
        self.source = source;
        self.reset();
    }

    /// Takes the host's pose, `dt_seconds` after the previous one. Accepts any numbers; the result for a
    /// pose that is not finite is meaningless.
    pub fn push(&mut self, pose: &Pose, dt_seconds: f64) -> Conditioned {
        let straight = |cut| Conditioned {
            pose: pose.clone(),
            dt_seconds,
            cut,
        };
        if self.source == PoseSource::AsGiven {
            return straight(false);
        }
        if self.raw.is_none() || !(0.0..=MAX_STEP_SECONDS).contains(&dt_seconds) {
            self.begin(pose);
            return straight(false);
        }
        if dt_seconds == 0.0 {
            self.playhead_before = self.playhead;
            return straight(false);
        }
        let moved = self.raw.as_ref().map(|raw| Step::between(raw, pose));
        let moved = moved.unwrap_or(Step::NONE);
        let dt_seconds = self.frames.step(&moved, dt_seconds, self.engaged);
        let straight = |cut| Conditioned {
            pose: pose.clone(),
            dt_seconds,
            cut,
        };
        self.now += dt_seconds;
        let weight = if self.frame == 0.0 { 1.0 } else { 0.1 };
        self.frame += weight * (dt_seconds - self.frame);
        // A body that turns back may pass through the same pose twice: that is a step like others.
        self.skips.add(&moved, dt_seconds, self.frames.interval());
        let is_new = self.skipped_interval().is_some()
            || self.raw.as_ref().is_none_or(|raw| !same(raw, pose));
        if is_new {
            self.run = 0;
            self.stands = false;
            if self.arrive(pose, moved) {
                return straight(true);
            }
        } else {
            self.repeat(dt_seconds);
        }
        if !self.engaged {
            self.playhead_before = self.playhead;
            self.playhead = self.now;
            return straight(false);
        }
        self.play(pose, dt_seconds)
    }

    /// The pose at `position`, 0 to 1, of the playhead's last move; none if the host's pose passed through
    /// unchanged.
    pub fn pose_at(&self, position: f64) -> Option<Pose> {
        let moved = self.playhead - self.playhead_before;
        (self.engaged && moved > 0.0)
            .then(|| self.on_path(self.playhead_before + position * moved))
            .flatten()
    }

    /// What was detected about the source.
    pub fn diagnosis(&self) -> Diagnosis {
        let noise_degrees = self.noise.degrees();
        // Frames of the display alone spread arrivals by a twelfth of their square.
        let jitter = self
            .clock
            .as_ref()
            .filter(|clock| clock.settled())
            .map_or(0.0, |clock| {
                (clock.jitter().powi(2) - self.frame.powi(2) / 12.0)
                    .max(0.0)
                    .sqrt()
            });
        let jitter_seconds = if self.engaged { jitter } else { 0.0 };
        let advice = match self.source {
            PoseSource::Tracker => None,
            _ if noise_degrees > 0.0 => Some(PoseSource::Tracker),
            PoseSource::Display if jitter_seconds > 0.004 => Some(PoseSource::Network),
            _ => None,
        };
        Diagnosis {
            repeats: self
                .last_repeat
                .is_some_and(|time| self.now - time < RELEASE_SECONDS),
            interval_seconds: self.clock.as_ref().map(|clock| clock.interval),
            jitter_seconds,
            noise_degrees,
            latency_seconds: if self.engaged {
                // The clock's times are those of arrival. A pose waits for half a frame on average, and
                // for half an interval where a newer one takes its place.
                let wait = self
                    .skipped_interval()
                    .unwrap_or(self.frame)
                    .min(self.frame);
                self.now - self.playhead + 0.5 * wait
            } else {
                0.0
            },
            advice,
        }
    }

    /// Seconds between two poses of a source that makes more than the page shows. Where noise is taken
    /// off, too, even frames came out better: 0.31 against 0.76.
    fn skipped_interval(&self) -> Option<f64> {
        let interval = self.skips.interval();
        interval.filter(|_| self.smoother.is_none())
    }

    fn begin(&mut self, pose: &Pose) {
        let goes_on = self.goes_on && self.raw.is_none();
        self.reset();
        self.began = if goes_on { f64::NEG_INFINITY } else { 0.0 };
        self.raw = Some(pose.clone());
        self.log.push_back(0.0);
        self.engaged = matches!(self.source, PoseSource::Tracker | PoseSource::Network);
        self.smoother = self.source.tuning().map(Smoother::new);
        self.add_knot(0.0, &pose.clone());
    }
}

fn same(a: &Pose, b: &Pose) -> bool {
    let near = (a.root_translation_m - b.root_translation_m)
        .abs()
        .max_element()
        <= HAIR;
    near && a
        .parent_from_joint
        .iter()
        .zip(&b.parent_from_joint)
        .all(|(a, b)| a.abs_diff_eq(*b, 0.5 * HAIR))
}
