//! What a source is like.

use crate::cut::Step;
use crate::source::PoseSource;

/// Weight of the newest pose in what is known of the noise.
const WEIGHT: f64 = 0.04;

/// Third differences against second ones, as mean squares: 3.3 of white noise, far below 1 of
/// bodies at 30 Hz and more.
const NOISY_RATIO: f64 = 1.8;

/// Noise below this is left alone, in degrees.
const LEAST_NOISE_DEG: f64 = 0.03;

/// What was detected about a pose source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diagnosis {
    /// Whether poses repeat while the body moves.
    pub repeats: bool,
    /// Seconds between two new poses, once known.
    pub interval_seconds: Option<f64>,
    /// Jitter of the arrivals beyond that of the display's frames: root mean square, in seconds.
    pub jitter_seconds: f64,
    /// White noise along each axis of a joint's turn, in degrees; 0 where there is less than bodies
    /// move.
    pub noise_degrees: f64,
    /// Latency of the tissue behind the source's poses, in seconds, in addition to the one tick of the
    /// runtime.
    pub latency_seconds: f64,
    /// The source that would work better; none if the one in use is the best.
    pub advice: Option<PoseSource>,
}

/// Measures white noise on the joints that the body holds still.
#[derive(Clone, Debug, Default)]
pub(crate) struct NoiseGauge {
    bend: Option<(Step, Option<Step>)>,
    second: f64,
    third: f64,
    /// Variance along each axis of a joint's turn, in rad².
    floor: f64,
    count: u32,
}

/// Share of the joints that are taken to be still.
const QUIET: f64 = 0.3;

/// That quantile of a χ² of three degrees of freedom.
const QUIET_CHI: f64 = 1.42;

fn difference(a: &Step, b: &Step) -> Step {
    Step {
        root_m: a.root_m - b.root_m,
        turns: std::array::from_fn(|joint| a.turns[joint] - b.turns[joint]),
    }
}

fn size(step: &Step) -> f64 {
    let sum: f64 = step.turns.iter().map(|turn| turn.length_squared()).sum();
    sum / (3 * step.turns.len()) as f64
}

/// The squared turn of the joint that `QUIET` of all that turn at all stay below.
fn quiet(step: &Step) -> f64 {
    let mut squares = step.turns.map(|turn| turn.length_squared());
    squares.sort_by(f64::total_cmp);
    let still = squares.partition_point(|square| *square < 1e-14);
    let moving = &squares[still..];
    let index = (QUIET * moving.len() as f64) as usize;
    moving.get(index).copied().unwrap_or(0.0)
}

impl NoiseGauge {
    pub fn add(&mut self, step: &Step) {
        let Some((before, bend_before)) = self.bend.take() else {
            self.bend = Some((*step, None));
            return;
        };
        let bend = difference(step, &before);
        if let Some(bend_before) = bend_before {
            self.count = self.count.saturating_add(1);
            let third = difference(&bend, &bend_before);
            let weight = (1.0 / f64::from(self.count)).max(WEIGHT);
            self.second += weight * (size(&bend) - self.second);
            self.third += weight * (size(&third) - self.third);
            // A third difference has twenty times the variance of what it is made of.
            self.floor += weight * (quiet(&third) / (20.0 * QUIET_CHI) - self.floor);
        }
        self.bend = Some((*step, Some(bend)));
    }

    /// Standard deviation along each axis of a joint's turn, in radians, once known.
    pub fn joint_noise_rad(&self) -> Option<f64> {
        (self.count >= 4).then(|| self.floor.sqrt())
    }

    /// The same in degrees where there is more of it than bodies move; else 0.
    pub fn degrees(&self) -> f64 {
        let noise = self.floor.sqrt().to_degrees();
        let noisy = self.count >= 20 && self.third > NOISY_RATIO * self.second;
        if noisy && noise >= LEAST_NOISE_DEG {
            noise
        } else {
            0.0
        }
    }
}
