//! The sources, what is aimed at, and how a row is written.

use std::fmt;

use dynaskin_runtime::PoseSource;

use crate::measure::Played;
use dynaskin_pose_sources::{Made, Noise, Source, Steps};

/// What is aimed at under the preset that suits the source.
#[derive(Clone, Copy)]
pub struct Goal {
    pub preset: PoseSource,
    /// Error over that of plain skinning; 0 for none.
    pub error: f64,
    pub latency_ms: f64,
    /// Standing still, in millimetres; 0 for none.
    pub standing_mm: f64,
}

const fn goal(preset: PoseSource, error: f64, latency_ms: f64, standing_mm: f64) -> Goal {
    Goal {
        preset,
        error,
        latency_ms,
        standing_mm,
    }
}

const fn live(name: &'static str, rate_hz: f64, display_hz: f64) -> Source {
    Source {
        name,
        made: Made::Live(rate_hz, 0.0),
        display_hz,
        noise: Noise::None,
        steps: Steps::Exact,
    }
}

const fn noisy(name: &'static str, rate_hz: f64, noise: Noise) -> Source {
    Source {
        noise,
        ..live(name, rate_hz, 60.0)
    }
}

const fn stepped(name: &'static str, steps: Steps) -> Source {
    Source {
        name,
        made: Made::EveryFrame,
        display_hz: 60.0,
        noise: Noise::None,
        steps,
    }
}

const DISPLAY: PoseSource = PoseSource::Display;
const TRACKER: PoseSource = PoseSource::Tracker;
const NETWORK: PoseSource = PoseSource::Network;
const NONE: Goal = goal(DISPLAY, 0.0, 0.0, 0.0);

pub const SOURCES: [(Source, Goal); 24] = [
    (
        live("60 Hz held on 72 Hz", 60.0, 72.0),
        goal(DISPLAY, 0.10, 17.0, 0.0),
    ),
    (
        live("72 Hz held on 90 Hz", 72.0, 90.0),
        goal(DISPLAY, 0.10, 14.0, 0.0),
    ),
    (
        live("60 Hz held on 144 Hz", 60.0, 144.0),
        goal(DISPLAY, 0.10, 17.0, 0.0),
    ),
    (
        live("60 Hz held on 120 Hz", 60.0, 120.0),
        goal(DISPLAY, 0.10, 17.0, 0.0),
    ),
    (
        live("90 Hz on 60 Hz, the newest taken", 90.0, 60.0),
        goal(DISPLAY, 0.10, 12.0, 0.0),
    ),
    (
        live("30 Hz held", 30.0, 60.0),
        goal(DISPLAY, 0.20, 0.0, 0.0),
    ),
    (live("15 Hz held", 15.0, 60.0), NONE),
    (
        Source {
            made: Made::Live(30.0, 0.015),
            ..live("30 Hz, arrivals ±15 ms", 30.0, 60.0)
        },
        goal(NETWORK, 0.25, 70.0, 0.0),
    ),
    (
        noisy(
            "30 Hz, white noise 0.5° + 2 mm",
            30.0,
            Noise::White(0.5, 2e-3),
        ),
        goal(TRACKER, 0.60, 50.0, 5.0),
    ),
    (
        noisy(
            "30 Hz, white noise 0.25° + 1 mm",
            30.0,
            Noise::White(0.25, 1e-3),
        ),
        goal(TRACKER, 0.45, 50.0, 3.0),
    ),
    (
        noisy(
            "30 Hz, white noise 0.1° + 0.5 mm",
            30.0,
            Noise::White(0.1, 5e-4),
        ),
        NONE,
    ),
    (
        noisy(
            "60 Hz, white noise 0.5° + 2 mm",
            60.0,
            Noise::White(0.5, 2e-3),
        ),
        NONE,
    ),
    (
        noisy("30 Hz tracker, its smoothing on", 30.0, Noise::Smoothed),
        goal(TRACKER, 0.0, 0.0, 0.8),
    ),
    (
        noisy("30 Hz tracker, raw", 30.0, Noise::Raw),
        goal(TRACKER, 0.0, 0.0, 2.0),
    ),
    (
        Source {
            made: Made::File(30.0),
            ..live("file of 30 keys/s", 0.0, 60.0)
        },
        goal(DISPLAY, 0.17, 0.0, 0.0),
    ),
    (
        Source {
            made: Made::File(24.0),
            ..live("file of 24 keys/s", 0.0, 60.0)
        },
        NONE,
    ),
    (
        stepped("60 Hz, steps ±1 ms off", Steps::Off(1e-3)),
        goal(DISPLAY, 0.03, 0.0, 0.0),
    ),
    (stepped("60 Hz, steps ±2 ms off", Steps::Off(2e-3)), NONE),
    (
        stepped("60 Hz, steps of a 1 ms clock", Steps::Clock(1e-3)),
        goal(DISPLAY, 0.03, 0.0, 0.0),
    ),
    (
        stepped("60 Hz, uneven by ±2 ms and measured", Steps::Followed(2e-3)),
        NONE,
    ),
    (
        stepped("60 Hz, a new pose in every frame", Steps::Exact),
        NONE,
    ),
    (
        Source {
            display_hz: 72.0,
            ..stepped("72 Hz, a new pose in every frame", Steps::Exact)
        },
        NONE,
    ),
    (
        Source {
            display_hz: 90.0,
            ..stepped("90 Hz, a new pose in every frame", Steps::Exact)
        },
        NONE,
    ),
    (
        Source {
            display_hz: 144.0,
            ..stepped("144 Hz, a new pose in every frame", Steps::Exact)
        },
        NONE,
    ),
];

/// Whether `source` is tried on somebody who stands still.
pub fn stands(source: &Source) -> bool {
    !matches!(source.noise, Noise::None)
}

pub const HEAD: &str = "\
| source | preset | captures | at ms | says ms | procedural | at ms | standing mm (peak) | false cuts | goal | |
|---|---|--:|--:|--:|--:|--:|--:|--:|--:|---|";

pub struct Row {
    pub source: Source,
    pub goal: Goal,
    pub preset: PoseSource,
    pub captures: Played,
    pub procedural: Played,
    pub standing: Played,
}

pub fn name(preset: PoseSource) -> &'static str {
    match preset {
        PoseSource::AsGiven => "none",
        PoseSource::Display => "display",
        PoseSource::Tracker => "tracker",
        PoseSource::Network => "network",
    }
}

/// Error over that of plain skinning; NaN where there is none.
pub fn error(played: &Played) -> f64 {
    (played.off / played.size).sqrt()
}

impl Row {
    /// Captures where there are, else procedural motions.
    fn counted(&self) -> &Played {
        if self.captures.size > 0.0 {
            &self.captures
        } else {
            &self.procedural
        }
    }

    fn verdict(&self) -> (String, &'static str) {
        let Goal {
            preset,
            error: most,
            latency_ms,
            standing_mm,
        } = self.goal;
        let mut words = Vec::new();
        let mut met = true;
        if most > 0.0 {
            words.push(format!("{most:.2}"));
            met &= error(self.counted()) <= most;
        }
        if latency_ms > 0.0 {
            words.push(format!("{latency_ms} ms"));
            // Latencies are found to a millisecond.
            met &= 1e3 * self.counted().latency <= latency_ms + 1.0;
        }
        if standing_mm > 0.0 {
            words.push(format!("{standing_mm} mm"));
            met &= self.standing.moved_mm <= standing_mm;
        }
        let cuts = self.captures.false_cuts + self.procedural.false_cuts + self.standing.false_cuts;
        met &= cuts == 0;
        let verdict = match (self.preset == preset && !words.is_empty(), met) {
            (false, _) => "",
            (true, true) => "met",
            (true, false) => "missed",
        };
        let words = if verdict.is_empty() {
            String::new()
        } else {
            words.join(", ")
        };
        (words, verdict)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (goal, verdict) = self.verdict();
        let cell = |played: &Played| match played.size > 0.0 {
            true => (
                format!("{:.3}", error(played)),
                format!("{:.0}", 1e3 * played.latency),
            ),
            false => ("-".to_owned(), "-".to_owned()),
        };
        let (captures, at) = cell(&self.captures);
        let (procedural, procedural_at) = cell(&self.procedural);
        let standing = match stands(&self.source) {
            true => format!(
                "{:.2} ({:.1})",
                self.standing.moved_mm, self.standing.most_mm
            ),
            false => String::new(),
        };
        let cuts = self.captures.false_cuts + self.procedural.false_cuts + self.standing.false_cuts;
        let says = 1e3 * self.counted().said_latency;
        let (source, preset) = (self.source.name, name(self.preset));
        write!(
            f,
            "| {source} | {preset} | {captures} | {at} | {says:.0} | {procedural} | {procedural_at} | \
             {standing} | {cuts} | {goal} | {verdict} |"
        )
    }
}
