//! Sources that make more poses than the page shows.
//!
//! A page at 60 Hz that takes the newest of 90 poses a second skips every third. No pose repeats, but
//! the body goes on by one interval of the source in one frame and by two in the next. Which, the
//! poses themselves tell: with the right number of intervals in each frame its velocity is even.

use dynaskin_skeleton::Joint;

use crate::cut::Step;

/// Rates that sources are made for, in Hz.
const SOURCES_HZ: [f64; 9] = [60.0, 72.0, 80.0, 90.0, 100.0, 120.0, 144.0, 165.0, 240.0];

/// Most intervals of a source in a frame.
const MOST_INTERVALS: f64 = 4.0;

/// Ratios of rates that are as good as whole: each frame then has as many intervals as the next.
const WHOLE: f64 = 0.02;

/// Phases that are told apart within an interval of the source.
const PHASES: usize = 12;

/// What is left after a frame of what was known.
const MEMORY: f64 = 0.985;

/// Telling frames in a row in which a pattern explains what even frames do not; half of them where it changes.
const SURE_FRAMES: u32 = 30;

/// Mean square of the unevenness with a pattern over that with even frames: found below the first, lost
/// above the second. Of captures at their own 60 Hz the best pattern has 0.95 and more; at 72 and
/// 90 Hz the right one has 0.02 to 0.76.
const FOUND: f64 = 0.7;
const LOST: f64 = 0.95;

/// Share of frames that repeat a pose while the body moves, from which poses are held instead. A body
/// that turns back may pass through a pose twice.
const HELD: f64 = 0.1;

/// Steps that are shorter repeat a pose, squared, in rad².
const SAME: f64 = 1e-14;

/// Another pattern takes the place of the one that was found if it has this share of its unevenness.
const BETTER: f64 = 0.7;

/// A frame tells something if its unevenness is this share of the mean: one blow, remembered for a second,
/// is no pattern.
const TELLING: f64 = 0.2;

/// Unevenness that is felt, as a mean square over frames, in rad²: a joint at 1 rad/s on 60 Hz whose
/// frames are off by a tenth.
const LEAST: f64 = 3e-6;

/// Steps that last this share of a frame longer or shorter are no frames of the display.
const UNEVEN_FRAME: f64 = 0.1;

/// A source of `ratio` poses a frame, the first of which came `phase` of an interval before a frame.
#[derive(Clone, Copy, Debug)]
struct Pattern {
    ratio: f64,
    phase: f64,
    /// Mean square of how uneven the velocity is, with as many intervals in each frame as it says.
    uneven: f64,
}

impl Pattern {
    /// Intervals of the source between frames `from` and `to`.
    fn intervals(&self, from: f64, to: f64) -> f64 {
        let made = |frame: f64| (frame * self.ratio + self.phase).floor();
        made(to) - made(from)
    }
}

/// Joints that neither are flung nor lost by trackers.
const CALM: [Joint; 12] = [
    Joint::Pelvis,
    Joint::LeftHip,
    Joint::RightHip,
    Joint::Spine1,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::Spine2,
    Joint::Spine3,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
];

/// Products of three steps in a row, each with each.
struct Products {
    own: [f64; 3],
    first_second: f64,
    second_third: f64,
    first_third: f64,
}

impl Products {
    fn new([a, b, c]: [&Step; 3]) -> Self {
        let dot = |a: &Step, b: &Step| {
            let turns = CALM.map(|joint| a.turns[joint as usize].dot(b.turns[joint as usize]));
            a.root_m.dot(b.root_m) + turns.iter().sum::<f64>()
        };
        Self {
            own: [dot(a, a), dot(b, b), dot(c, c)],
            first_second: dot(a, b),
            second_third: dot(b, c),
            first_third: dot(a, c),
        }
    }

    /// How far the middle step's velocity is off the line through its neighbours', squared, where the
    /// steps last that long, in any unit of time.
    fn uneven(&self, [a, b, c]: [f64; 3]) -> f64 {
        let whole = a + 2.0 * b + c;
        // Weights of the three steps in the difference.
        let (before, after) = (-(b + c) / (whole * a), -(a + b) / (whole * c));
        let middle = 1.0 / b;
        let square = before * before * self.own[0]
            + middle * middle * self.own[1]
            + after * after * self.own[2]
            + 2.0
                * (before * middle * self.first_second
                    + middle * after * self.second_third
                    + before * after * self.first_third);
        square.max(0.0)
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Skips {
    /// The display's interval that the patterns are for.
    frame_seconds: f64,
    patterns: Vec<Pattern>,
    /// Unevenness with even frames.
    even: f64,
    /// Share of frames whose pose repeats.
    held: f64,
    /// Frames since the patterns began.
    frame: f64,
    /// The last two steps, newest last, with the frame that each ended at.
    steps: [Option<(Step, f64)>; 2],
    /// The pattern that explained most at the last frame, and for how many frames in a row one did.
    best: usize,
    sure: u32,
    /// Which pattern is the source's.
    found: Option<usize>,
    /// Intervals of the source in the last frame, by the pattern that was found then.
    intervals: f64,
}

impl Skips {
    /// Takes a step of the body over `dt_seconds` on a display of frames of `frame_seconds`.
    pub fn add(&mut self, step: &Step, dt_seconds: f64, frame_seconds: f64) {
        let frames = (dt_seconds / frame_seconds).round();
        let is_frame = frames >= 1.0
            && (dt_seconds - frames * frame_seconds).abs() < UNEVEN_FRAME * frame_seconds;
        let is_same = (frame_seconds - self.frame_seconds).abs() < 2e-3 * frame_seconds;
        if !is_frame || !is_same {
            self.begin(frame_seconds);
            return;
        }
        let before = self.frame;
        self.frame += frames;
        if let Some(pattern) = self.found.and_then(|found| self.patterns.get(found)) {
            self.intervals = pattern.intervals(before, self.frame).max(1.0);
        }
        if let [Some((first, start)), Some((second, middle))] = &self.steps {
            let times = [*start, *middle, before, self.frame];
            self.weigh(&Products::new([first, second, step]), times);
        }
        self.steps.rotate_left(1);
        self.steps[1] = Some((*step, before));
    }

    /// As new, in the memory that it has: no later step has to allocate.
    pub fn cleared(mut self) -> Self {
        self.patterns.clear();
        self.patterns.reserve(SOURCES_HZ.len() * PHASES);
        Self {
            patterns: self.patterns,
            ..Self::default()
        }
    }

    /// Starts on another display, or on none that is even.
    fn begin(&mut self, frame_seconds: f64) {
        self.patterns.clear();
        self.found = None;
        self.sure = 0;
        self.even = 0.0;
        self.held = 0.0;
        self.frame = 0.0;
        self.steps = [None; 2];
        self.frame_seconds = frame_seconds;
        for source_hz in SOURCES_HZ {
            let ratio = source_hz * frame_seconds;
            let is_whole = (ratio - ratio.round()).abs() < WHOLE * ratio;
            if ratio <= 1.0 || ratio > MOST_INTERVALS || is_whole {
                continue;
            }
            self.patterns.extend((0..PHASES).map(|phase| Pattern {
                ratio,
                phase: (phase as f64 + 0.5) / PHASES as f64,
                uneven: 0.0,
            }));
        }
    }

    /// Three steps from each of the `frames` to the next.
    fn weigh(&mut self, products: &Products, frames: [f64; 4]) {
        let [a, b, c, d] = frames;
        let keep = |mean: f64, now: f64| MEMORY * mean + (1.0 - MEMORY) * now;
        let even = products.uneven([b - a, c - b, d - c]);
        self.even = keep(self.even, even);
        let is_held = products.own[2] < SAME && products.own[1] > LEAST;
        let is_held = if is_held { 1.0 } else { 0.0 };
        self.held = keep(self.held, is_held);
        let mut best: Option<(usize, f64)> = None;
        for (idx, pattern) in self.patterns.iter_mut().enumerate() {
            let intervals = [(a, b), (b, c), (c, d)].map(|(from, to)| pattern.intervals(from, to));
            let uneven = products.uneven(intervals.map(|count| count.max(1.0)));
            // In units of a frame, as with even frames.
            let uneven = uneven * pattern.ratio * pattern.ratio;
            pattern.uneven = keep(pattern.uneven, uneven);
            if best.is_none_or(|(_, least)| pattern.uneven < least) {
                best = Some((idx, pattern.uneven));
            }
        }
        let Some((best, least)) = best else { return };
        if self.even < LEAST {
            // A body that hardly moves tells nothing.
            return;
        }
        if let Some(found) = self.found {
            let known = self.patterns[found].uneven;
            if known > LOST * self.even {
                self.found = None;
                self.sure = 0;
            } else if least < BETTER * known {
                self.found = Some(best);
            }
            return;
        }
        if best != self.best {
            self.sure /= 2;
        }
        self.best = best;
        let explains = least < FOUND * self.even && self.held < HELD;
        if !explains {
            self.sure = 0;
        } else if even > TELLING * self.even {
            self.sure += 1;
        }
        if self.sure >= SURE_FRAMES {
            self.found = Some(best);
        }
    }

    /// Seconds between two poses of the source, where it makes more than the page shows.
    pub fn interval(&self) -> Option<f64> {
        let pattern = self.patterns.get(self.found?)?;
        Some(self.frame_seconds / pattern.ratio)
    }

    /// Intervals of the source between the last pose and the one before.
    pub fn intervals(&self) -> f64 {
        self.intervals
    }
}
