//! Stiffness, damping and gain of a region's springs by least squares.

use std::f64::consts::TAU;

use dynaskin_motion::MODEL_RATE_HZ;
use serde::Serialize;

use super::SpringBonesConfig;
use super::rig::Rig;

/// What drives the springs in a clip, and where their tips should be.
#[derive(Clone, Debug)]
pub(super) struct Recording {
    /// Proper acceleration beyond that at rest, `[frame][bone][xyz]`.
    pub drive_m_s2: Vec<f32>,
    /// The tips that explain the offsets best, `[frame][bone][xyz]`.
    pub target_m: Vec<f32>,
}

/// A tuned spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct Spring {
    /// Its region.
    pub region: &'static str,
    /// Frequency of the damped swing.
    pub frequency_hz: f64,
    /// Damping ratio (1 = critical).
    pub damping_ratio: f64,
    /// How much of the drive the mass feels; 1 for a free mass.
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

/// The spring that explains most of the targets of `bones`, which share it.
pub(super) fn tune(
    recordings: &[Recording],
    bones: &[usize],
    rig: &Rig,
    config: &SpringBonesConfig,
) -> Spring {
    let mut best = Spring::default();
    let attempt = |frequency_hz: f64, damping_ratio: f64, best: &mut Spring| {
        let spring = Spring {
            frequency_hz: frequency_hz.clamp(config.lowest_hz, config.highest_hz),
            damping_ratio: damping_ratio.clamp(config.lowest_damping, config.highest_damping),
            ..Spring::default()
        };
        let tried = fit_gain(recordings, bones, rig, spring);
        if tried.explained > best.explained || best.frequency_hz == 0.0 {
            *best = tried;
        }
    };
    let steps = (config.grid - 1) as f64;
    let mut ratio = (config.highest_hz / config.lowest_hz).powf(1.0 / steps);
    let mut pitch = (config.highest_damping - config.lowest_damping) / steps;
    for f in 0..config.grid {
        for z in 0..config.grid {
            let frequency_hz = config.lowest_hz * ratio.powi(f as i32);
            attempt(
                frequency_hz,
                config.lowest_damping + pitch * z as f64,
                &mut best,
            );
        }
    }
    for _ in 0..config.refinements {
        ratio = ratio.sqrt();
        pitch /= 2.0;
        let centre = best;
        for f in -1..=1 {
            for z in -1..=1 {
                let frequency_hz = centre.frequency_hz * ratio.powi(f);
                let damping_ratio = centre.damping_ratio + pitch * f64::from(z);
                attempt(frequency_hz, damping_ratio, &mut best);
            }
        }
    }
    best
}

/// The best gain for a spring's frequency and damping, and what it explains.
fn fit_gain(recordings: &[Recording], bones: &[usize], rig: &Rig, spring: Spring) -> Spring {
    let ticks = spring.ticks();
    let axes = rig.axes();
    let (mut both, mut own, mut all) = (0.0, 0.0, 0.0);
    for bone in bones {
        let weight = rig.weight_square(*bone);
        for recording in recordings {
            let (mut q, mut v) = ([0.0f64; 3], [0.0f64; 3]);
            let drives = recording.drive_m_s2.chunks_exact(axes);
            for (drive, target) in drives.zip(recording.target_m.chunks_exact(axes)) {
                for axis in 0..3 {
                    let push = ticks.push * f64::from(drive[3 * bone + axis]);
                    v[axis] = ticks.retained * v[axis] - ticks.stiffness * q[axis] - push;
                    q[axis] += v[axis];
                    let y = f64::from(target[3 * bone + axis]);
                    both += weight * q[axis] * y;
                    own += weight * q[axis] * q[axis];
                    all += weight * y * y;
                }
            }
        }
    }
    // A spring that pulled the wrong way is left out.
    let gain = (both / own.max(f64::MIN_POSITIVE)).max(0.0);
    Spring {
        gain,
        explained: gain * both / all.max(f64::MIN_POSITIVE),
        ..spring
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynaskin_train::fixture;

    /// A tip that swings at `frequency_hz`, integrated finely.
    fn recording(frequency_hz: f64, damping_ratio: f64, gain: f64) -> Recording {
        let omega = TAU * frequency_hz / (1.0 - damping_ratio * damping_ratio).sqrt();
        let (mut drive_m_s2, mut target_m) = (Vec::new(), Vec::new());
        let (mut q, mut v) = (0.0f64, 0.0f64);
        for tick in 0..600 {
            let t = f64::from(tick) / MODEL_RATE_HZ;
            let a = 8.0 * (1.1 * TAU * t).sin() + 5.0 * (2.7 * TAU * t).cos();
            for _ in 0..64 {
                v += (-gain * a - omega * omega * q - 2.0 * damping_ratio * omega * v)
                    / (64.0 * MODEL_RATE_HZ);
                q += v / (64.0 * MODEL_RATE_HZ);
            }
            drive_m_s2.extend([0.0, a as f32, 0.0]);
            target_m.extend([0.0, q as f32, 0.0]);
        }
        Recording {
            drive_m_s2,
            target_m,
        }
    }

    #[test]
    fn a_known_spring_is_found() {
        let body = fixture::symmetric_body(4);
        let rig = Rig::of_body(&body, &(0..8).collect::<Vec<u32>>()).expect("a rig");
        let recordings = [recording(3.4, 0.3, 0.8)];
        let found = tune(&recordings, &[0], &rig, &SpringBonesConfig::default());
        assert!((found.frequency_hz / 3.4 - 1.0).abs() < 0.07, "{found:?}");
        assert!((found.damping_ratio - 0.3).abs() < 0.05, "{found:?}");
        assert!((found.gain / 0.8 - 1.0).abs() < 0.08, "{found:?}");
        assert!(found.explained > 0.99, "{found:?}");
    }
}
