//! Stiffness and damping of a region, changed after the networks.
//!
//! Networks without materials among their features learned tissue of one stiffness, the others
//! tissue of some; this does what is left ([`crate::controls::Shares`]). Tissue that follows
//! its bone is, near rest, an oscillator driven by the bone's acceleration, and what turns the
//! offsets of one oscillator into those of another is a linear filter,
//!
//! ```text
//!            s² + 2 ζ ω s + ω²
//! F(s) = ---------------------------      ω, ζ: the region's own frequency and damping ratio
//!         s² + 2 c ζ ω s + k ω²           k, c: factors on stiffness and damping
//! ```
//!
//! whose zeros take away the region's own swing and whose poles put the new one in its place. At
//! k = c = 1 it is the identity; slow offsets, such as those of gravity, come out divided by k; fast
//! ones, against which springs can do nothing, come out as they were. Its poles lie in the left
//! half plane for all k, c > 0, and are mapped into the unit circle by `z = exp(s T)`, so it is
//! stable for every setting. ω and ζ are measured on the model at hand ([`Mode`]).
//!
//! What it is not: a second simulation. Each region counts as one oscillator, so where tissue swings
//! in several ways at once, and far from rest, where it stiffens, the result is an approximation.

use dynaskin_body::{Pose, REGION_COUNT, SHAPE_COUNT};
use dynaskin_skeleton::MODEL_RATE_HZ;
use glam::DVec3;

use crate::RuntimeError;
use crate::controls::RegionControls;
use crate::engine::Engine;
use crate::features::MotionFeatures;
use crate::model::Model;
use crate::tissue::settled;

/// Length of the pulse that modes are measured with, in ticks: short beside the period of soft
/// tissue, long enough for second differences to see its shape.
const PULSE_TICKS: usize = 6;

/// Rise of the pelvis in that pulse, in metres: its peak acceleration is 20 m/s², of a hop's size.
const PULSE_HEIGHT_M: f64 = 0.01;

/// Ticks after the pulse in which tissue is watched swinging out.
const WATCHED_TICKS: usize = 45;

/// A vertex is part of a region for the measurement from this membership on.
const MEMBER: f32 = 0.5;

/// How a region swings by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mode {
    /// ω in rad/s.
    pub frequency_rad_s: f64,
    /// ζ: 1 is critically damped.
    pub damping_ratio: f64,
}

impl Mode {
    /// Soft tissue of no particular kind, where a region does not swing visibly: 4 Hz, a quarter of
    /// critical damping.
    const TYPICAL: Self = Self {
        frequency_rad_s: 4.0 * std::f64::consts::TAU,
        damping_ratio: 0.25,
    };

    /// The mode of tissue stiffer and more damped by the given factors.
    pub fn of_material(self, stiffness: f32, damping: f32) -> Self {
        Self {
            frequency_rad_s: self.frequency_rad_s * f64::from(stiffness).sqrt(),
            damping_ratio: self.damping_ratio * f64::from(damping),
        }
    }

    /// The mode of a free decay `u_t = a1 u_{t-1} + a2 u_{t-2}` at the model's rate.
    fn of_decay(a1: f64, a2: f64) -> Option<Self> {
        let discriminant = a1 * a1 / 4.0 + a2;
        // ln z of the two poles: their mean and half their difference.
        let (mean, split_squared) = if discriminant < 0.0 {
            let angle = (-discriminant).sqrt().atan2(a1 / 2.0);
            (0.5 * (-a2).ln(), -angle * angle)
        } else {
            let (fast, slow) = (
                a1 / 2.0 - discriminant.sqrt(),
                a1 / 2.0 + discriminant.sqrt(),
            );
            if fast <= 0.0 {
                return None;
            }
            let half = 0.5 * (slow.ln() - fast.ln());
            (0.5 * (slow.ln() + fast.ln()), half * half)
        };
        let squared = mean * mean - split_squared;
        if !(squared.is_finite() && squared > 0.0 && mean < 0.0) {
            return None;
        }
        let frequency_rad_s = squared.sqrt() * MODEL_RATE_HZ;
        let damping_ratio = -mean / squared.sqrt();
        let hertz = frequency_rad_s / std::f64::consts::TAU;
        let plausible = (1.0..=15.0).contains(&hertz) && (0.02..=2.0).contains(&damping_ratio);
        plausible.then_some(Self {
            frequency_rad_s,
            damping_ratio,
        })
    }

    /// `1 - p1 z⁻¹ - p2 z⁻²` with this mode's poles.
    fn recursion(self) -> (f64, f64) {
        let decay = self.damping_ratio * self.frequency_rad_s / MODEL_RATE_HZ;
        let split = 1.0 - self.damping_ratio * self.damping_ratio;
        let turn = self.frequency_rad_s / MODEL_RATE_HZ * split.abs().sqrt();
        let shrink = (-decay).exp();
        if split >= 0.0 {
            // Beyond half the rate, frequencies would alias down again.
            (2.0 * shrink * turn.min(2.8).cos(), -shrink * shrink)
        } else {
            let (fast, slow) = ((-decay - turn).exp(), (-decay + turn).exp());
            (fast + slow, -fast * slow)
        }
    }
}

/// The modes of a model's regions at the average shape: the networks are given a short bump, and
/// the recursion of second order that best describes how each region swings out is its mode.
///
/// # Errors
/// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
pub(crate) fn modes(model: &Model) -> Result<[Mode; REGION_COUNT], RuntimeError> {
    let body = model.body();
    let Some(networks) = model
        .networks()
        .filter(|_| body.region_weights.len() == REGION_COUNT)
    else {
        return Ok([Mode::TYPICAL; REGION_COUNT]);
    };
    let shape = [0.0; SHAPE_COUNT];
    let joints_rest_m = body.shaped(&shape).joints_m;
    let mut features = MotionFeatures::new(model.feature_kind(), &joints_rest_m, &shape);
    let Engine {
        mut predictor,
        mut decoder,
        ..
    } = Engine::new(networks)?;
    let mut latent = vec![0.0; networks.bundle.latent_count];
    let standing = features.push(&Pose::REST);
    let mut state = settled(&mut predictor, standing, &mut latent)?;
    let mut rest_m = vec![0.0; 3 * networks.bundle.vertices.len()];
    decoder.decode(&latent, &mut rest_m)?;

    let mut past = [rest_m.clone(), rest_m.clone()];
    let mut now = rest_m.clone();
    let mut fits = [Fit::default(); REGION_COUNT];
    for tick in 1..=PULSE_TICKS + WATCHED_TICKS {
        let turn = std::f64::consts::TAU * tick.min(PULSE_TICKS) as f64 / PULSE_TICKS as f64;
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::Y * (0.5 * PULSE_HEIGHT_M * (1.0 - turn.cos()));
        predictor.step(features.push(&pose), &mut state, &mut latent)?;
        decoder.decode(&latent, &mut now)?;
        // The accelerations of the pulse reach two ticks past it.
        if tick >= PULSE_TICKS + 4 {
            for (fit, weights) in fits.iter_mut().zip(&body.region_weights) {
                for (slot, &vertex) in networks.bundle.vertices.iter().enumerate() {
                    if weights[vertex as usize] < MEMBER {
                        continue;
                    }
                    for number in 3 * slot..3 * slot + 3 {
                        let at = |list: &[f32]| f64::from(list[number] - rest_m[number]);
                        fit.add(at(&now), at(&past[0]), at(&past[1]));
                    }
                }
            }
        }
        past.swap(0, 1);
        std::mem::swap(&mut past[0], &mut now);
    }
    Ok(fits.map(|fit| fit.mode().unwrap_or(Mode::TYPICAL)))
}

/// Least squares for `u_t = a1 u_{t-1} + a2 u_{t-2}`.
#[derive(Clone, Copy, Debug, Default)]
struct Fit {
    s11: f64,
    s12: f64,
    s22: f64,
    r1: f64,
    r2: f64,
}

impl Fit {
    fn add(&mut self, now: f64, before: f64, earlier: f64) {
        self.s11 += before * before;
        self.s12 += before * earlier;
        self.s22 += earlier * earlier;
        self.r1 += now * before;
        self.r2 += now * earlier;
    }

    fn mode(&self) -> Option<Mode> {
        let determinant = self.s11 * self.s22 - self.s12 * self.s12;
        let solvable = determinant > 1e-9 * self.s11 * self.s22;
        if !solvable {
            return None;
        }
        let a1 = (self.r1 * self.s22 - self.r2 * self.s12) / determinant;
        let a2 = (self.r2 * self.s11 - self.r1 * self.s12) / determinant;
        Mode::of_decay(a1, a2)
    }
}

/// One vertex's filter: `y = g (x - n1 x₁ - n2 x₂) + p1 y₁ + p2 y₂`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Coefficients {
    gain: f32,
    zeros: [f32; 2],
    poles: [f32; 2],
    /// What a constant comes out multiplied by: 1/k.
    still: f32,
}

impl Coefficients {
    fn new(mode: Mode, stiffness: f64, damping: f64) -> Self {
        // Stiffness times k at the same mass: ω' = ω √k, and the damping ratio 2 ζ' ω' = 2 c ζ ω.
        let changed = Mode {
            frequency_rad_s: mode.frequency_rad_s * stiffness.sqrt(),
            damping_ratio: mode.damping_ratio * damping / stiffness.sqrt(),
        };
        let (zeros, poles) = (mode.recursion(), changed.recursion());
        let still = 1.0 / stiffness;
        let gain = still * (1.0 - poles.0 - poles.1) / (1.0 - zeros.0 - zeros.1);
        Self {
            gain: gain as f32,
            zeros: [zeros.0 as f32, zeros.1 as f32],
            poles: [poles.0 as f32, poles.1 as f32],
            still: still as f32,
        }
    }
}

/// The filters of all soft vertices and what they remember. Offsets are those at rest taken away,
/// three numbers a vertex, in metres.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    coefficients: Vec<Coefficients>,
    /// Inputs of the last tick and of the one before.
    pub(crate) inputs_m: [Vec<f32>; 2],
    /// Outputs of the last tick and of the one before.
    pub(crate) outputs_m: [Vec<f32>; 2],
}

impl Response {
    /// Filters for the soft vertices of `model` that start from `offsets_m` at rest.
    pub fn new(
        model: &Model,
        modes: &[Mode; REGION_COUNT],
        regions: &[RegionControls; REGION_COUNT],
        offsets_m: &[f32],
    ) -> Self {
        let mut response = Self {
            coefficients: Vec::with_capacity(model.soft_vertices().len()),
            inputs_m: [offsets_m.to_vec(), offsets_m.to_vec()],
            outputs_m: [offsets_m.to_vec(), offsets_m.to_vec()],
        };
        response.set(model, modes, regions);
        response
    }

    /// Other settings; what swings swings on.
    pub fn set(
        &mut self,
        model: &Model,
        modes: &[Mode; REGION_COUNT],
        regions: &[RegionControls; REGION_COUNT],
    ) {
        self.coefficients.clear();
        for &vertex in model.soft_vertices() {
            // Factors and frequencies are blended where regions meet, as their logarithms.
            let mut logs = [0.0; 4];
            let mut sum = 0.0;
            for ((weights, mode), region) in
                model.body().region_weights.iter().zip(modes).zip(regions)
            {
                let weight = f64::from(weights[vertex as usize]);
                sum += weight;
                for (log, number) in logs.iter_mut().zip([
                    mode.frequency_rad_s,
                    mode.damping_ratio,
                    f64::from(region.stiffness),
                    f64::from(region.damping),
                ]) {
                    *log += weight * number.ln();
                }
            }
            self.coefficients.push(if sum > 1e-6 {
                let [frequency_rad_s, damping_ratio, stiffness, damping] =
                    logs.map(|log| (log / sum).exp());
                let mode = Mode {
                    frequency_rad_s,
                    damping_ratio,
                };
                Coefficients::new(mode, stiffness, damping)
            } else {
                Coefficients::new(Mode::TYPICAL, 1.0, 1.0)
            });
        }
    }

    /// As after `offsets_m` for long.
    pub fn settle(&mut self, offsets_m: &[f32]) {
        for inputs_m in &mut self.inputs_m {
            inputs_m.copy_from_slice(offsets_m);
        }
        let [last_m, before_m] = &mut self.outputs_m;
        let triples = offsets_m.as_chunks::<3>().0.iter();
        for ((output, input), coefficients) in last_m
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(triples)
            .zip(&self.coefficients)
        {
            *output = input.map(|number| number * coefficients.still);
        }
        before_m.copy_from_slice(last_m);
    }

    /// One tick with the offsets `raw_m - rest_m`.
    pub fn push(&mut self, raw_m: &[f32], rest_m: &[f32]) {
        let [input_1, input_2] = &mut self.inputs_m;
        let [output_1, output_2] = &mut self.outputs_m;
        for (vertex, coefficients) in self.coefficients.iter().enumerate() {
            let Coefficients {
                gain,
                zeros: [n1, n2],
                poles: [p1, p2],
                ..
            } = *coefficients;
            for number in 3 * vertex..3 * vertex + 3 {
                let (x1, x2) = (input_1[number], input_2[number]);
                let (y1, y2) = (output_1[number], output_2[number]);
                let x = raw_m[number] - rest_m[number];
                let y = gain * (x - n1 * x1 - n2 * x2) + p1 * y1 + p2 * y2;
                (input_1[number], input_2[number]) = (x, x1);
                (output_1[number], output_2[number]) = (y, y1);
            }
        }
    }

    /// Writes what lies `phase` (0..1) from the tick before the last to the last.
    pub fn show(&self, phase: f32, shown_m: &mut [f32]) {
        let [last_m, before_m] = &self.outputs_m;
        for (shown, (last, before)) in shown_m.iter_mut().zip(last_m.iter().zip(before_m)) {
            *shown = before + phase * (last - before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / MODEL_RATE_HZ;

    /// Offsets of an oscillator on a base with the accelerations `a` (m/s²), in exact steps small
    /// beside a tick.
    fn oscillator(
        frequency_rad_s: f64,
        damping_ratio: f64,
        base_m_s2: impl Fn(f64) -> f64,
    ) -> Vec<f32> {
        let substeps = 400;
        let h = DT / f64::from(substeps);
        let (mut x, mut v) = (0.0, 0.0);
        (0..240)
            .map(|tick| {
                for sub in 0..substeps {
                    let t = f64::from(tick) * DT + f64::from(sub) * h;
                    let spring = frequency_rad_s * frequency_rad_s * x;
                    let damper = 2.0 * damping_ratio * frequency_rad_s * v;
                    v += h * (-base_m_s2(t) - spring - damper);
                    x += h * v;
                }
                x as f32
            })
            .collect()
    }

    fn filtered(coefficients: Coefficients, inputs: &[f32]) -> Vec<f32> {
        let zeros = || [vec![0.0; 3], vec![0.0; 3]];
        let mut response = Response {
            coefficients: vec![coefficients],
            inputs_m: zeros(),
            outputs_m: zeros(),
        };
        let step = |x: &f32| {
            response.push(&[*x, 0.0, 0.0], &[0.0; 3]);
            response.outputs_m[0][0]
        };
        inputs.iter().map(step).collect()
    }

    fn largest(list: impl Iterator<Item = f32>) -> f32 {
        list.fold(0.0, |size, x| size.max(x.abs()))
    }

    #[test]
    fn the_filter_turns_one_oscillator_into_another() {
        let mode = Mode {
            frequency_rad_s: 4.0 * std::f64::consts::TAU,
            damping_ratio: 0.2,
        };
        // A hop a second: bumps of 15 m/s² with a half-sine shape.
        let hops = |t: f64| 15.0 * (std::f64::consts::TAU * t).sin().max(0.0);
        let soft = oscillator(mode.frequency_rad_s, mode.damping_ratio, hops);
        for (stiffness, damping) in [(1.0, 1.0), (2.0, 1.0), (0.5, 1.0), (1.0, 3.0), (3.0, 2.0)] {
            let frequency_rad_s = mode.frequency_rad_s * f64::sqrt(stiffness);
            let ratio = mode.damping_ratio * damping / f64::sqrt(stiffness);
            let wanted = oscillator(frequency_rad_s, ratio, hops);
            let got = filtered(Coefficients::new(mode, stiffness, damping), &soft);
            let size = largest(wanted.iter().copied());
            let off = largest(got.iter().zip(&wanted).map(|(a, b)| a - b));
            println!(
                "k {stiffness}, c {damping}: off by {:.1} %",
                100.0 * off / size
            );
            assert!(off <= 0.08 * size, "{stiffness} {damping}: {off} of {size}");
        }
    }

    #[test]
    fn every_setting_is_stable_and_calms_down() {
        for hertz in [1.0, 4.0, 15.0] {
            for damping_ratio in [0.02, 0.3, 2.0] {
                let mode = Mode {
                    frequency_rad_s: hertz * std::f64::consts::TAU,
                    damping_ratio,
                };
                for stiffness in [0.1, 1.0, 10.0] {
                    for damping in [0.1, 1.0, 10.0] {
                        let coefficients = Coefficients::new(mode, stiffness, damping);
                        let [p1, p2] = coefficients.poles.map(f64::from);
                        // The triangle in which both poles lie inside the unit circle.
                        let stable = p2 > -1.0 && p1 + p2 < 1.0 && p2 - p1 < 1.0;
                        assert!(stable, "{mode:?} {stiffness} {damping}: {p1} {p2}");
                        let ones = vec![1.0; 60_000];
                        let end = filtered(coefficients, &ones)[59_999];
                        let expected = 1.0 / stiffness as f32;
                        assert!((end / expected - 1.0).abs() < 0.02, "{end} for {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn modes_are_found_again_in_their_decay() {
        for (hertz, damping_ratio) in [(2.0, 0.1), (5.0, 0.3), (9.0, 0.05), (3.0, 1.4)] {
            let mode = Mode {
                frequency_rad_s: hertz * std::f64::consts::TAU,
                damping_ratio,
            };
            let (a1, a2) = mode.recursion();
            let mut fit = Fit::default();
            let (mut earlier, mut before) = (1.0, 0.8);
            for _ in 0..40 {
                let now = a1 * before + a2 * earlier;
                fit.add(now, before, earlier);
                (earlier, before) = (before, now);
            }
            let found = fit.mode().expect("a clean decay has a mode");
            assert!((found.frequency_rad_s / mode.frequency_rad_s - 1.0).abs() < 1e-6);
            assert!((found.damping_ratio / damping_ratio - 1.0).abs() < 1e-6);
        }
        assert_eq!(Fit::default().mode(), None);
    }
}
