//! Free vibration of one region: frequency and damping of its ringing.

use std::f64::consts::TAU;

use dynaskin_body::{BodyModel, Pose, Region};
use dynaskin_motion::MODEL_RATE_HZ;
use glam::Vec3;

use crate::settings::SimSettings;
use crate::shell::Shell;
use crate::solver::{Solver, Unstable};

/// Speed in m/s of the push: small enough that tissue stays close to linear.
const PUSH_M_PER_S: f32 = 0.1;
/// How long the ringing is recorded, in 60 Hz ticks.
const TICKS: usize = 90;
/// Vertices with more than this weight belong to a region.
const MEMBER_WEIGHT: f32 = 0.6;

/// How a region rings after a push along the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Vibration {
    /// The region.
    pub region: Region,
    /// Frequency of the damped ringing in hertz.
    pub frequency_hz: f64,
    /// Damping ratio (1 = critical).
    pub damping_ratio: f64,
    /// Part of the recording's energy that a single damped sine does not explain, 0..=1.
    pub unexplained: f64,
    /// Mean depth in metres of the tissue under the region's vertices.
    pub depth_m: f64,
    /// Mean vertical displacement of the region's vertices in metres, at 60 Hz from the push on.
    pub trace_m: Vec<f32>,
}

/// Pushes the tissue of `region` along the body (+y) in the rest pose and watches it ring.
///
/// # Errors
/// [`Unstable`] if the solver goes astray.
pub fn free_vibration(
    body: &BodyModel,
    shell: &Shell,
    settings: &SimSettings,
    region: Region,
) -> Result<Vibration, Unstable> {
    let weights = &body.region_weights[region as usize];
    let members: Vec<usize> = shell
        .vertices()
        .iter()
        .enumerate()
        .filter(|(_, vertex)| weights[**vertex as usize] > MEMBER_WEIGHT)
        .map(|(slot, _)| slot)
        .collect();
    let mut solver = Solver::new(shell, settings);
    solver.step(&Pose::REST)?;
    solver.set_state(|vertex, depth_share| {
        let speed = PUSH_M_PER_S * weights[vertex as usize] * (1.0 - depth_share);
        (Vec3::ZERO, Vec3::Y * speed)
    });
    let mut trace_m = vec![0.0];
    for _ in 1..TICKS {
        solver.step(&Pose::REST)?;
        let all: Vec<Vec3> = solver.displacements_world_m().collect();
        let sum: f32 = members.iter().map(|slot| all[*slot].y).sum();
        trace_m.push(sum / members.len().max(1) as f32);
    }
    let fit = Ringing::fit(&trace_m);
    let depth_sum: f32 = members.iter().map(|slot| shell.depth_m()[*slot]).sum();
    Ok(Vibration {
        region,
        frequency_hz: fit.frequency_hz,
        damping_ratio: fit.damping_ratio,
        unexplained: fit.unexplained,
        depth_m: f64::from(depth_sum) / members.len().max(1) as f64,
        trace_m,
    })
}

/// A damped sine through a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ringing {
    /// Frequency of the damped ringing in hertz.
    pub frequency_hz: f64,
    /// Damping ratio (1 = critical).
    pub damping_ratio: f64,
    /// Part of the recording's energy that a single damped sine does not explain, 0..=1; infinite
    /// for a recording of zeros.
    pub unexplained: f64,
}

impl Ringing {
    /// Least squares over `exp(-z w t) (a cos(w' t) + b sin(w' t))`, a and b solved for exactly and
    /// (w, z) searched for on ever finer grids: robust where crossings are too few to count. The
    /// recording is at 60 Hz from the push on, in any unit.
    pub fn fit(trace: &[f32]) -> Self {
        let power: f64 = trace.iter().map(|x| f64::from(*x).powi(2)).sum();
        let mut best = Self {
            frequency_hz: 1.0,
            damping_ratio: 0.2,
            unexplained: f64::INFINITY,
        };
        let (mut ratio, mut spread) = (30.0_f64.powf(1.0 / 60.0), 0.03);
        let coarse = (0..60).map(|k| ratio.powi(k));
        for frequency_hz in coarse {
            for k in 1..30 {
                best.improve(trace, power, frequency_hz, 0.03 * f64::from(k));
            }
        }
        for _ in 0..12 {
            let centre = best;
            for f in -2..=2 {
                for z in -2..=2 {
                    let damping = (centre.damping_ratio + spread * f64::from(z) / 2.0).max(0.0);
                    let frequency_hz = centre.frequency_hz * ratio.powf(f64::from(f) / 2.0);
                    best.improve(trace, power, frequency_hz, damping);
                }
            }
            ratio = ratio.sqrt();
            spread /= 2.0;
        }
        best
    }

    fn improve(&mut self, trace: &[f32], power: f64, frequency_hz: f64, damping_ratio: f64) {
        if damping_ratio >= 0.98 {
            return;
        }
        // `frequency_hz` is that of the ringing; the undamped one lies above it.
        let damped = TAU * frequency_hz;
        let decay = damped * damping_ratio / (1.0 - damping_ratio * damping_ratio).sqrt();
        let (mut cc, mut cs, mut ss, mut xc, mut xs) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (tick, x) in trace.iter().enumerate() {
            let t = tick as f64 / MODEL_RATE_HZ;
            let envelope = (-decay * t).exp();
            let (sin, cos) = (damped * t).sin_cos();
            let (c, s, x) = (envelope * cos, envelope * sin, f64::from(*x));
            cc += c * c;
            cs += c * s;
            ss += s * s;
            xc += x * c;
            xs += x * s;
        }
        let determinant = cc * ss - cs * cs;
        if determinant <= 1e-12 * cc * ss {
            return;
        }
        let a = (xc * ss - xs * cs) / determinant;
        let b = (xs * cc - xc * cs) / determinant;
        let unexplained = (1.0 - (a * xc + b * xs) / power.max(f64::MIN_POSITIVE)).max(0.0);
        if unexplained < self.unexplained {
            *self = Self {
                frequency_hz,
                damping_ratio,
                unexplained,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damped_sine_is_found() {
        for (frequency_hz, damping_ratio) in [(4.0_f64, 0.215_f64), (2.1, 0.5), (13.0, 0.3)] {
            let w = TAU * frequency_hz;
            let decay = w * damping_ratio / (1.0 - damping_ratio * damping_ratio).sqrt();
            let trace: Vec<f32> = (0..90)
                .map(|tick| {
                    let t = f64::from(tick) / 60.0;
                    (0.01 * (-decay * t).exp() * (w * t + 0.3).sin()) as f32
                })
                .collect();
            let fit = Ringing::fit(&trace);
            assert!(
                (fit.frequency_hz / frequency_hz - 1.0).abs() < 0.01,
                "{fit:?}"
            );
            assert!((fit.damping_ratio - damping_ratio).abs() < 0.01, "{fit:?}");
            assert!(fit.unexplained < 1e-3, "{fit:?}");
        }
    }
}
