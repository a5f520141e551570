//! A damped spring, and its recurrence at the model's rate.

use std::f64::consts::TAU;

use dynaskin_motion::MODEL_RATE_HZ;
use serde::Serialize;

/// A tuned spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct Spring {
    /// Its region.
    pub region: &'static str,
    /// Frequency of the damped swing.
    pub frequency_hz: f64,
    /// Damping ratio (1 = critical).
    pub damping_ratio: f64,
    /// Share of the drive that acts on the mass; 1 for a free mass.
    pub gain: f64,
    /// Share of the tips' mean square over the training set that the spring explains.
    pub explained: f64,
}

/// A spring one tick at a time: `v ← retained v - stiffness q - gain push a`, `q ← q + v`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ticks {
    /// Per tick squared.
    pub stiffness: f64,
    /// Share of the velocity that a tick leaves.
    pub retained: f64,
    /// Metres that an acceleration of 1 m/s² adds to the velocity of a free mass, chosen so that a
    /// steady acceleration pulls the tip as far as it pulls the spring.
    pub push: f64,
}

impl Spring {
    /// The recurrence whose poles are exactly those of the spring, sampled at 60 Hz.
    pub fn ticks(&self) -> Ticks {
        let damped = TAU * self.frequency_hz / MODEL_RATE_HZ;
        let undamped = damped / (1.0 - self.damping_ratio.powi(2)).sqrt();
        let radius = (-self.damping_ratio * undamped).exp();
        let stiffness = 1.0 + radius * radius - 2.0 * radius * damped.cos();
        Ticks {
            stiffness,
            retained: radius * radius,
            push: stiffness / (undamped * MODEL_RATE_HZ).powi(2),
        }
    }
}
