//! Power spectra of regions' movement and of its errors.

use std::f64::consts::TAU;
use std::sync::Arc;

use dynaskin_motion::MODEL_RATE_HZ;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// Ticks a window: 2.1 s, half a hertz a line.
const WINDOW: usize = 128;
/// Lines that are kept, up to half the rate.
const LINES: usize = WINDOW / 2 + 1;
/// Frequency bands of tables, in hertz: from, up to.
pub const BANDS_HZ: [(f64, f64); 4] = [(0.0, 3.0), (3.0, 8.0), (8.0, 15.0), (15.0, 30.5)];
/// Longest delay looked for, in ticks.
const MOST_LAG: usize = 12;

/// Mean power spectrum of a signal: Welch's method, Hann windows that overlap by half.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Sums over windows and axes, mm²/Hz.
    power: Vec<f64>,
    windows: usize,
}

impl Default for Spectrum {
    fn default() -> Self {
        Self {
            power: vec![0.0; LINES],
            windows: 0,
        }
    }
}

impl Spectrum {
    /// Whether no clip was long enough to add anything.
    pub fn is_empty(&self) -> bool {
        self.windows == 0
    }

    /// Frequencies in hertz and power densities in mm²/Hz, the three axes summed.
    pub fn lines(&self) -> impl Iterator<Item = (f64, f64)> {
        let windows = self.windows.max(1) as f64;
        let lines = self.power.iter().enumerate();
        lines.map(move |(line, power)| (frequency_hz(line), power / windows))
    }

    /// Root mean square in millimetres of what lies from `low_hz` up to `high_hz`.
    pub fn band_mm(&self, (low_hz, high_hz): (f64, f64)) -> f64 {
        let inside = self
            .lines()
            .filter(|(hertz, _)| (low_hz..high_hz).contains(hertz));
        let width_hz = MODEL_RATE_HZ / WINDOW as f64;
        inside
            .map(|(_, power)| power * width_hz)
            .sum::<f64>()
            .sqrt()
    }
}

fn frequency_hz(line: usize) -> f64 {
    line as f64 * MODEL_RATE_HZ / WINDOW as f64
}

/// Adds signals to spectra.
pub(super) struct Analyser {
    fft: Arc<dyn Fft<f64>>,
    window: Vec<f64>,
}

impl Analyser {
    pub fn new() -> Self {
        Self {
            fft: FftPlanner::new().plan_fft_forward(WINDOW),
            window: (0..WINDOW)
                .map(|k| 0.5 - 0.5 * (TAU * k as f64 / WINDOW as f64).cos())
                .collect(),
        }
    }

    /// Adds a movement `[axis][frame]` in millimetres; clips shorter than a window add nothing.
    pub fn add(&self, signal_mm: &[Vec<f64>; 3], spectrum: &mut Spectrum) {
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        let frames = signal_mm[0].len();
        for start in (0..(frames + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2) {
            for axis in signal_mm {
                let mut buffer: Vec<Complex<f64>> = axis[start..start + WINDOW]
                    .iter()
                    .zip(&self.window)
                    .map(|(x, w)| Complex::new(x * w, 0.0))
                    .collect();
                self.fft.process(&mut buffer);
                for (line, power) in spectrum.power.iter_mut().enumerate() {
                    // Negative frequencies are folded onto positive ones.
                    let sides = if line == 0 || line == WINDOW / 2 {
                        1.0
                    } else {
                        2.0
                    };
                    *power += sides * buffer[line].norm_sqr() / (MODEL_RATE_HZ * energy);
                }
            }
            spectrum.windows += 1;
        }
    }
}

/// Correlation of predicted with true movement over delays.
#[derive(Clone, Debug)]
pub struct Lag {
    /// Sums of products, the prediction taken `index - MOST_LAG` ticks later than the truth.
    products: Vec<f64>,
    /// Sums of squares of the truth, over the frames that have a prediction at every delay.
    truth: f64,
    /// Sums of squares of the prediction over the frames that each of the products is made of.
    predicted: Vec<f64>,
}

impl Default for Lag {
    fn default() -> Self {
        Self {
            products: vec![0.0; 2 * MOST_LAG + 1],
            truth: 0.0,
            predicted: vec![0.0; 2 * MOST_LAG + 1],
        }
    }
}

impl Lag {
    pub(super) fn add(&mut self, truth: &[Vec<f64>; 3], predicted: &[Vec<f64>; 3]) {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        for (truth, predicted) in truth.iter().zip(predicted) {
            let Some(inner) = truth.len().checked_sub(2 * MOST_LAG) else {
                continue;
            };
            let truth = &truth[MOST_LAG..MOST_LAG + inner];
            self.truth += dot(truth, truth);
            for index in 0..self.products.len() {
                let shifted = &predicted[index..index + inner];
                self.products[index] += dot(truth, shifted);
                self.predicted[index] += dot(shifted, shifted);
            }
        }
    }

    /// Correlations, one a delay, -1..=1; 0 where either does not move.
    fn correlations(&self) -> Vec<f64> {
        let pairs = self.products.iter().zip(&self.predicted);
        let correlation = |(product, predicted): (&f64, &f64)| {
            let norm = (self.truth * predicted).sqrt();
            if norm == 0.0 { 0.0 } else { product / norm }
        };
        pairs.map(correlation).collect()
    }

    /// How late the prediction comes, in milliseconds: the delay of the largest correlation, between
    /// ticks by a parabola. None where the prediction does not move or is no number, or the largest
    /// correlation lies at the end of the range.
    pub fn milliseconds(&self) -> Option<f64> {
        let all = self.correlations();
        let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b]))?;
        let meant = all.iter().all(|x| x.is_finite()) && all[best] > 0.0;
        if !meant || best == 0 || best + 1 == all.len() {
            return None;
        }
        let [before, at, after] = [all[best - 1], all[best], all[best + 1]];
        let bend = before - 2.0 * at + after;
        let share = if bend < 0.0 {
            0.5 * (before - after) / bend
        } else {
            0.0
        };
        Some(1000.0 * (best as f64 + share - MOST_LAG as f64) / MODEL_RATE_HZ)
    }

    /// Correlation of prediction and truth without delay, -1..=1; 0 where either does not move.
    pub fn correlation(&self) -> f64 {
        self.correlations()[MOST_LAG]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `amplitude · sin` of `hertz`, `late_seconds` late, along y.
    fn wave(amplitude: f64, hertz: f64, late_seconds: f64) -> [Vec<f64>; 3] {
        let y = (0..600).map(|frame| {
            let t = f64::from(frame) / MODEL_RATE_HZ - late_seconds;
            amplitude * (TAU * hertz * t).sin()
        });
        [vec![0.0; 600], y.collect(), vec![0.0; 600]]
    }

    #[test]
    fn a_sine_s_power_lies_in_its_band() {
        let mut spectrum = Spectrum::default();
        Analyser::new().add(&wave(4.0, 5.0, 0.0), &mut spectrum);
        // Root mean square of a sine: amplitude over the root of 2.
        let bands = BANDS_HZ.map(|band| spectrum.band_mm(band));
        assert!((bands[1] - 4.0 / 2f64.sqrt()).abs() < 0.02, "{bands:?}");
        assert!(bands[0] < 0.01 && bands[2] < 0.01, "{bands:?}");
    }

    #[test]
    fn a_delay_is_found_between_ticks() {
        let mut lag = Lag::default();
        lag.add(&wave(2.0, 3.0, 0.0), &wave(1.0, 3.0, 0.030));
        let found = lag.milliseconds().expect("a delay");
        assert!((found - 30.0).abs() < 1.0, "{found}");
        assert!(lag.correlation() < 0.9);
        let mut still = Lag::default();
        still.add(&wave(2.0, 3.0, 0.0), &wave(0.0, 3.0, 0.0));
        assert_eq!(still.milliseconds(), None);
    }
    #[test]
    fn perfect_predictions_of_short_clips_correlate_fully() {
        // Bursts at both ends, which lie outside the frames that all delays share.
        let mut burst = wave(2.0, 3.0, 0.0).map(|axis| axis[..40].to_vec());
        burst[1][0] = 50.0;
        burst[1][39] = -50.0;
        let mut lag = Lag::default();
        lag.add(&burst, &burst);
        assert!((lag.correlation() - 1.0).abs() < 1e-12);
        assert!(lag.milliseconds().is_some_and(|ms| ms.abs() < 10.0));

        // Three ticks late and half as large.
        let truth = wave(2.0, 3.0, 0.0).map(|axis| axis[..90].to_vec());
        let late = wave(1.0, 3.0, 3.0 / MODEL_RATE_HZ).map(|axis| axis[..90].to_vec());
        let mut lag = Lag::default();
        lag.add(&truth, &late);
        let found = lag.milliseconds().expect("a delay");
        assert!((found - 50.0).abs() < 1.0, "{found}");
        assert!((lag.correlations()[MOST_LAG + 3] - 1.0).abs() < 1e-9);

        let mut broken = Lag::default();
        broken.add(
            &truth,
            &truth.clone().map(|axis| vec![f64::NAN; axis.len()]),
        );
        assert_eq!(broken.milliseconds(), None);
    }
}
