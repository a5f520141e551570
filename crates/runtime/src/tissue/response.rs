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
//! whose zeros take away the region's own swing and whose poles put the new one in its place. At k
//! = c = 1 it is the identity; slow offsets, such as those of gravity, come out divided by k; fast
//! ones, against which springs can do nothing, come out as they were. It is stable
//! for every setting: its poles lie in the left half plane for all k, c > 0, and `z = exp(s T)`
//! maps them into the unit circle. ω and ζ are measured on the model at hand ([`Mode`]).
//!
//! What it is not: a second simulation. Each region counts as one oscillator, so where tissue swings
//! in several ways at once, and far from rest, where it stiffens, the result is an approximation.

use dynaskin_body::REGION_COUNT;

use crate::controls::RegionControls;
use crate::tissue::mode::Mode;

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

/// What is to be done to each soft vertex.
#[derive(Clone, Debug)]
pub(crate) struct Filters(Vec<Coefficients>);

impl Filters {
    /// For `soft_vertices`, which belong to the regions by `region_weights` (for each region one a
    /// vertex), swing by `modes` and are to be changed by `regions`.
    pub fn new(
        soft_vertices: &[u32],
        region_weights: &[Vec<f32>],
        modes: &[Mode; REGION_COUNT],
        regions: &[RegionControls; REGION_COUNT],
    ) -> Self {
        let of_vertex = |&vertex: &u32| {
            // Factors and frequencies are blended where regions meet, as their logarithms.
            let mut logs = [0.0; 4];
            let mut sum = 0.0;
            for ((weights, mode), region) in region_weights.iter().zip(modes).zip(regions) {
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
            if sum > 1e-6 {
                let [frequency_rad_s, damping_ratio, stiffness, damping] =
                    logs.map(|log| (log / sum).exp());
                let mode = Mode {
                    frequency_rad_s,
                    damping_ratio,
                };
                Coefficients::new(mode, stiffness, damping)
            } else {
                Coefficients::new(Mode::TYPICAL, 1.0, 1.0)
            }
        };
        Self(soft_vertices.iter().map(of_vertex).collect())
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
    /// Filters that start from `offsets_m` at rest.
    pub fn new(filters: Filters, offsets_m: &[f32]) -> Self {
        Self {
            coefficients: filters.0,
            inputs_m: [offsets_m.to_vec(), offsets_m.to_vec()],
            outputs_m: [offsets_m.to_vec(), offsets_m.to_vec()],
        }
    }

    /// Other settings; what swings swings on.
    pub fn set(&mut self, filters: Filters) {
        self.coefficients = filters.0;
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
    use crate::tissue::mode::Fit;
    use dynaskin_skeleton::MODEL_RATE_HZ;

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
