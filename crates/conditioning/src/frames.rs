//! The display's clock, under time steps that were measured by a coarse one.
//!
//! A page that measures its steps in a busy callback, or with a clock that moves by whole
//! milliseconds, gives steps that are off by a millisecond or two while the display is even. Whether
//! the poses follow the steps that were measured (an animation that the page moves on by them) or
//! the display (a tracker, a headset) is seen on the poses: in the first case they move farther in
//! longer steps.

use crate::cut::Step;

/// Steps that are more uneven than this share of the interval are no clock's fault.
const MOST_UNEVEN: f64 = 0.25;

/// Steps that are evener than this, in seconds, are even.
const LEAST_UNEVEN_SECONDS: f64 = 1e-4;

/// Weight of the newest step in the mean interval, and in how uneven steps are.
const INTERVAL_WEIGHT: f64 = 0.005;
const WEIGHT: f64 = 0.02;

/// What is left of what was known of how poses follow, after every step.
const MEMORY: f64 = 0.995;

/// Less motion than this tells nothing, in rad²: a joint at 2 rad/s in sixteen steps that are a millisecond
/// longer.
const LEAST_MOTION: f64 = 6e-5;

/// Rates of displays, in Hz, and how near the mean interval has to be to one, as a share.
const USUAL_HZ: [f64; 9] = [60.0, 72.0, 75.0, 90.0, 100.0, 120.0, 144.0, 165.0, 240.0];
const USUAL_SHARE: f64 = 0.008;

/// Steps in a row that belong to another display.
const OTHERS: u32 = 12;

/// Steps before anything is decided.
const FIRST: u32 = 24;

/// Poses that follow the unevenness by more than this share go by the steps that were measured; how many
/// standard deviations off it the share must be.
const HALF: f64 = 0.5;
const SURE: f64 = 2.0;

#[derive(Clone, Debug, Default)]
pub(crate) struct FrameClock {
    interval: f64,
    /// Mean square of steps less the interval, in s².
    spread: f64,
    count: u32,
    /// Time that was measured and not yet given on, in seconds.
    debt: f64,
    /// The last four steps of the body, newest last, with their seconds.
    steps: [Option<(Step, f64)>; 4],
    /// Sums of how far poses follow measured steps: covariance, variance, squares of what was added to the
    /// first.
    follows: (f64, f64, f64),
    snaps: bool,
    /// Steps in a row that are no multiple of the interval.
    others: u32,
}

impl FrameClock {
    /// Takes a step of the body that was measured to last `dt_seconds`; gives how long it lasted.
    /// `even` says that poses are known not to follow the page's steps.
    pub fn step(&mut self, step: &Step, dt_seconds: f64, even: bool) -> f64 {
        self.count = self.count.saturating_add(1);
        let share = 1.0 / f64::from(self.count);
        let frames = if self.interval > 0.0 {
            (dt_seconds / self.interval).round()
        } else {
            1.0
        };
        let off = dt_seconds - frames * self.interval;
        let is_frame = frames >= 1.0 && off.abs() < MOST_UNEVEN * self.interval;
        if self.count > 1 && !is_frame {
            // Another display, or a page that draws when it likes.
            self.others += 1;
            if self.others > OTHERS {
                *self = Self::default();
            }
            self.debt = 0.0;
            self.snaps = false;
            self.steps = [None; 4];
            return dt_seconds;
        }
        self.others = 0;
        self.interval += share.max(INTERVAL_WEIGHT) * (dt_seconds / frames - self.interval);
        if self.count > 1 {
            self.spread += share.max(WEIGHT) * (off * off - self.spread);
        }
        self.weigh(step, dt_seconds);
        let uneven = self.spread.sqrt();
        self.snaps = self.count >= FIRST
            && uneven > LEAST_UNEVEN_SECONDS
            && uneven < 0.5 * MOST_UNEVEN * self.interval
            && (even || self.follows_display());
        if !self.snaps {
            self.debt = 0.0;
            return dt_seconds;
        }
        let interval = self.usual_interval();
        // Steps that are off by chance add up to less than one; those of another rate do not.
        self.debt += dt_seconds - frames * interval;
        let paid = WEIGHT * (self.debt - self.debt.clamp(-interval, interval));
        self.debt -= paid;
        frames * interval + paid
    }

    /// Seconds from a frame of the display to the next.
    pub fn interval(&self) -> f64 {
        self.usual_interval()
    }

    /// The mean interval, or that of the usual rate which it is near.
    fn usual_interval(&self) -> f64 {
        let mut usual = USUAL_HZ.iter().map(|rate| 1.0 / rate);
        let near = |usual: &f64| (usual - self.interval).abs() < USUAL_SHARE * self.interval;
        usual.find(near).unwrap_or(self.interval)
    }

    /// Whether poses go by the display and not by the steps that were measured.
    fn follows_display(&self) -> bool {
        let (both, own, squares) = self.follows;
        if own <= LEAST_MOTION {
            return false;
        }
        let (share, deviation) = (both / own, squares.sqrt() / own);
        if self.snaps {
            share - SURE * deviation < HALF
        } else {
            share + SURE * deviation < HALF
        }
    }

    /// How far the middle of five steps is off its neighbours, against how much longer it was measured
    /// to be.
    fn weigh(&mut self, step: &Step, dt_seconds: f64) {
        if let [Some(a), Some(b), Some(c), Some(d)] = &self.steps {
            // The cubic through the neighbours, at the middle.
            let between = |a: f64, b: f64, d: f64, e: f64| (4.0 * (b + d) - a - e) / 6.0;
            let longer = c.1 - between(a.1, b.1, d.1, dt_seconds);
            let parts =
                std::iter::once([a.0.root_m, b.0.root_m, c.0.root_m, d.0.root_m, step.root_m]);
            let turns = (0..step.turns.len())
                .map(|joint| [&a.0, &b.0, &c.0, &d.0, step].map(|step| step.turns[joint]));
            let (mut both, mut own) = (0.0, 0.0);
            for [a, b, c, d, e] in parts.chain(turns) {
                let usual = (4.0 * (b + d) - a - e) / 6.0;
                let speed = usual / self.interval;
                both += (c - usual).dot(speed) * longer;
                own += speed.length_squared() * longer * longer;
            }
            self.follows = (
                MEMORY * self.follows.0 + both,
                MEMORY * self.follows.1 + own,
                MEMORY * MEMORY * self.follows.2 + both * both,
            );
        }
        self.steps.rotate_left(1);
        self.steps[3] = Some((*step, dt_seconds));
    }
}
