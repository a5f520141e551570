//! The clock of a source, estimated from when its poses arrive.

use std::collections::VecDeque;

/// Shortest and longest interval of a source, in seconds.
pub(crate) const INTERVALS: (f64, f64) = (1.0 / 250.0, 0.3);

/// Rates that sources are made for, in Hz. One that is near is taken at its word, so that the phase
/// alone has to be found.
const USUAL_HZ: [f64; 14] = [
    5.0, 10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0, 72.0, 90.0, 120.0, 144.0,
];

/// How far a source is off the rate that it is made for, as a share.
const USUAL_SPREAD: f64 = 1e-3;

/// How much a clock wanders from one pose to the next: its phase as a share of the interval, and the
/// interval as a share of itself.
const WANDER: (f64, f64) = (2e-3, 1e-5);

/// Arrivals that are off by this share of the interval on average are those of another clock.
const BIAS: f64 = 0.25;

/// Fraction by which the largest lateness is forgotten with every arrival.
const LATENESS_DECAY: f64 = 0.005;

/// Smallest standard deviation of arrivals, in seconds.
const LEAST_SPREAD: f64 = 5e-4;

/// A Kalman filter for phase and interval of an even clock that is read at uneven times. Its times
/// are means: a pose arrives as often before its time as after.
#[derive(Clone, Debug)]
pub(crate) struct SourceClock {
    /// Seconds between two poses of the source.
    pub interval: f64,
    /// When the newest pose was made, as estimated.
    pub newest: f64,
    /// Largest recent lateness against the estimate, in seconds.
    pub lateness: f64,
    count: f64,
    /// Of `newest`, of both, of `interval`, in s².
    variance: [f64; 3],
    /// Mean square of how far arrivals are from the clock, in s².
    spread: f64,
    bias: f64,
    astray: u32,
    /// Whether the interval was taken for a usual one.
    is_usual: bool,
}

impl SourceClock {
    /// From arrivals one interval apart, at least two.
    pub fn new(log: &VecDeque<f64>) -> Self {
        let count = log.len().max(2) as f64;
        let (first, last) = (
            log.front().copied().unwrap_or(0.0),
            log.back().copied().unwrap_or(0.0),
        );
        let middle = 0.5 * (count - 1.0);
        let mean = log.iter().sum::<f64>() / count;
        let counts = count * (count * count - 1.0) / 12.0;
        let places = log.iter().enumerate();
        let slope = places
            .map(|(idx, time)| (idx as f64 - middle) * (time - mean))
            .sum::<f64>()
            / counts;
        let interval = if log.len() < 2 { last - first } else { slope };
        let interval = interval.clamp(INTERVALS.0, INTERVALS.1);
        let mut clock = Self {
            interval,
            newest: last,
            lateness: 0.0,
            count,
            variance: [0.0; 3],
            spread: 0.0,
            bias: 0.0,
            astray: 0,
            is_usual: false,
        };
        let square = |clock: &Self| {
            let places = log.iter().enumerate();
            let off =
                places.map(|(idx, time)| time - mean - (idx as f64 - middle) * clock.interval);
            off.map(|off| off * off).sum::<f64>() / (count - 1.0)
        };
        clock.spread = square(&clock).max(LEAST_SPREAD * LEAST_SPREAD);
        let slope_spread = (clock.spread / counts).sqrt();
        clock.variance[2] = slope_spread * slope_spread;
        clock.newest = mean + middle * clock.interval;
        clock.variance[0] = clock.spread / count + middle * middle * clock.variance[2];
        clock.variance[1] = middle * clock.variance[2];
        let phases = log
            .iter()
            .enumerate()
            .map(|(idx, time)| time - mean - (idx as f64 - middle) * clock.interval);
        clock.lateness = phases.fold(0.0, f64::max);
        clock.take_usual_interval();
        clock
    }

    /// Of a source whose interval is known, in seconds, and whose newest pose was made at `newest`.
    pub fn known(interval: f64, newest: f64) -> Self {
        Self {
            interval,
            newest,
            lateness: 0.0,
            count: 8.0,
            variance: [
                (0.3 * interval).powi(2),
                0.0,
                (USUAL_SPREAD * interval).powi(2),
            ],
            spread: (0.3 * interval).powi(2),
            bias: 0.0,
            astray: 0,
            is_usual: true,
        }
    }

    /// How many intervals after the newest pose one was made that arrives at `time`.
    pub fn steps(&self, time: f64) -> f64 {
        let steps = (time - self.newest) / self.interval;
        // Poses that never come are rarer than late ones.
        (steps - 0.1).round().max(1.0)
    }

    /// The newest pose was made one interval later than it seemed.
    pub fn postpone(&mut self) {
        self.newest += self.interval;
    }

    /// A pose arrived at `time` that was made `steps` intervals after the newest; gives the time at
    /// which it was made. `log` has the last arrivals, should another clock have to be found.
    pub fn arrive(&mut self, time: f64, steps: f64, log: &VecDeque<f64>) -> f64 {
        let residual = time - self.newest - steps * self.interval;
        self.bias += 0.1 * (residual - self.bias);
        // More than half an interval off, time and again: another source.
        self.astray = if residual.abs() > 0.9 * self.interval {
            self.astray + 1
        } else {
            0
        };
        if self.astray > 3 {
            *self = Self::new(log);
            return self.newest;
        }
        self.count += 1.0;
        if self.bias.abs() > BIAS * self.interval {
            self.bias = 0.0;
            self.is_usual = false;
            self.variance[2] += (0.03 * self.interval).powi(2);
        }
        let [phase, both, interval] = self.variance;
        let wander = (WANDER.0 * self.interval).powi(2);
        let phase = phase + steps * (2.0 * both + steps * interval + wander);
        let both = both + steps * interval;
        let interval = interval + steps * (WANDER.1 * self.interval).powi(2);
        let sum = phase + self.spread;
        let (phase_gain, interval_gain) = (phase / sum, both / sum);
        self.variance = [
            (1.0 - phase_gain) * phase,
            (1.0 - phase_gain) * both,
            interval - interval_gain * both,
        ];
        let before = self.newest;
        let predicted = before + steps * self.interval;
        self.newest = (predicted + phase_gain * residual).max(before + 0.3 * self.interval);
        self.interval = (self.interval + interval_gain * residual).clamp(INTERVALS.0, INTERVALS.1);
        self.take_usual_interval();
        let late = time - self.newest;
        self.lateness = late.max(self.lateness - LATENESS_DECAY * (self.lateness - late));
        self.spread += (residual * residual - self.spread) / self.count.min(48.0);
        self.spread = self.spread.max(LEAST_SPREAD * LEAST_SPREAD);
        self.newest
    }

    /// Takes the interval for a usual one where no other one can be meant.
    fn take_usual_interval(&mut self) {
        let deviation = self.variance[2].sqrt();
        if self.is_usual || self.count < 5.0 {
            return;
        }
        let mut off = USUAL_HZ.map(|rate| 1.0 / rate - self.interval);
        off.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let near = 2.0 * deviation + USUAL_SPREAD * self.interval;
        if off[0].abs() > near || off[1].abs() < 2.0 * near {
            return;
        }
        self.is_usual = true;
        let [phase, both, interval] = self.variance;
        let sum = interval + (USUAL_SPREAD * self.interval).powi(2);
        self.newest += both / sum * off[0];
        self.interval += interval / sum * off[0];
        self.variance = [
            phase - both * both / sum,
            both - both * interval / sum,
            interval - interval * interval / sum,
        ];
    }

    /// The source made a pose that did not arrive, or the one before again.
    pub fn skip(&mut self) -> f64 {
        self.newest += self.interval;
        self.newest
    }

    /// Root mean square of how far arrivals are from the clock, in seconds.
    pub fn jitter(&self) -> f64 {
        self.spread.sqrt()
    }

    /// Whether enough arrived to trust it.
    pub fn settled(&self) -> bool {
        self.count >= 8.0
    }
}
