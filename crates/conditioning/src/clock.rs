//! The clock of a source, estimated from when its poses arrive.

/// Shortest and longest interval of a source, in seconds.
pub(crate) const INTERVALS: (f64, f64) = (1.0 / 250.0, 0.3);

/// Arrivals over which the regression remembers: its gains stop falling there.
const MEMORY: f64 = 96.0;

/// Fraction by which the largest lateness is forgotten with every arrival.
const LATENESS_DECAY: f64 = 0.02;

/// A growing-memory regression of arrival times on counts, which at a long memory is a
/// phase-locked loop. Times are means: a pose arrives as often before its time as after.
#[derive(Clone, Debug)]
pub(crate) struct SourceClock {
    /// Seconds between two poses of the source.
    pub interval: f64,
    /// When the newest pose was made, as estimated.
    pub newest: f64,
    count: f64,
    /// Largest recent lateness against the estimate, in seconds, above 0 or below.
    pub lateness: f64,
    /// Mean square of the residual, in s².
    spread: f64,
    astray: u32,
}

impl SourceClock {
    /// From two arrivals.
    pub fn new(first: f64, second: f64, count: f64) -> Self {
        Self {
            interval: ((second - first) / count).clamp(INTERVALS.0, INTERVALS.1),
            newest: second,
            count: 2.0,
            lateness: 0.0,
            spread: 0.0,
            astray: 0,
        }
    }

    /// A pose arrived at `time`; gives the time at which it was made.
    pub fn arrive(&mut self, time: f64) -> f64 {
        // Jitter of more than half an interval is likelier than a pose that never came.
        let steps = ((time - self.newest) / self.interval - 0.35)
            .round()
            .max(1.0);
        let predicted = self.newest + steps * self.interval;
        let residual = time - predicted;
        // More than half an interval off, time and again: another source.
        self.astray = if residual.abs() > 0.9 * self.interval {
            self.astray + 1
        } else {
            0
        };
        if self.astray > 3 {
            *self = Self::new(self.newest.min(time - INTERVALS.0), time, 1.0);
            return time;
        }
        self.count = (self.count + 1.0).min(MEMORY);
        let n = self.count;
        let place = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0));
        let rate = 6.0 / (n * (n + 1.0));
        let before = self.newest;
        self.newest = (predicted + place * residual).max(before + 0.3 * self.interval);
        self.interval = (self.interval + rate * residual / steps).clamp(INTERVALS.0, INTERVALS.1);
        let late = time - self.newest;
        self.lateness = late.max(self.lateness - LATENESS_DECAY * (self.lateness - late));
        self.spread += (residual * residual - self.spread) / n.min(32.0);
        self.newest
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

impl SourceClock {
    /// Takes the phase of all arrivals in `log`, one interval apart.
    pub fn begin_with(&mut self, log: &std::collections::VecDeque<f64>) {
        let count = log.len() as f64;
        let last = count - 1.0;
        let places = log.iter().enumerate();
        let phases = places.map(|(idx, time)| time + (last - idx as f64) * self.interval);
        let sum: f64 = phases.clone().sum();
        self.newest = sum / count;
        self.count = count.max(2.0);
        let newest = self.newest;
        self.lateness = phases.map(|phase| phase - newest).fold(0.0, f64::max);
    }
}
