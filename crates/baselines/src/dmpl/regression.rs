//! The auto-regression: normal equations, stability, roll-out.
//!
//! One-step regression knows nothing of what happens when its own output comes back as input. To be
//! sure that it dies away, A is scaled by s and B by s², which multiplies every root of
//! `det(λ² - A λ - B) = 0` by s; s is the largest that keeps the spectral radius of the companion
//! matrix [[A, B], [I, 0]] within the limit. The radius is bounded from above by Gelfand's formula,
//! `ρ(M) <= |M^k|^(1/k)`, whose right side comes down to ρ for large k, so the bound errs on the
//! safe side.

use nalgebra::{DMatrix, DVector};

use dynaskin_train::Normaliser;

/// Squarings of the companion matrix: k = 2^14 in Gelfand's formula. The norm of a 256 × 256 matrix
/// is off by at most a factor of 16 from what counts, and 16^(1/16384) is 1.0002.
const SQUARINGS: u32 = 14;

/// A clip as the regression sees it, in standardised units.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// `[control][frame]`.
    control: DMatrix<f64>,
    /// `[component][frame]`.
    coefficients: DMatrix<f64>,
}

impl Series {
    /// From features and latents (metres) of a clip, frame by frame.
    pub fn new(
        normaliser: &Normaliser,
        features: &[f32],
        latents: &[f32],
        deviation_m: &[f32],
    ) -> Self {
        let (inputs, components) = (normaliser.origin.len(), deviation_m.len());
        let frames = latents.len() / components;
        let control = DMatrix::from_fn(inputs, frames, |input, frame| {
            let difference = features[frame * inputs + input] - normaliser.origin[input];
            f64::from(difference * normaliser.scale[input])
        });
        let coefficients = DMatrix::from_fn(components, frames, |component, frame| {
            let deviation = deviation_m[component].max(f32::MIN_POSITIVE);
            f64::from(latents[frame * components + component] / deviation)
        });
        Self {
            control,
            coefficients,
        }
    }

    /// Inputs of the regression, `[δ_{t-1}, δ_{t-2}, φ_t][frame]`; before the clip δ is 0.
    fn inputs(&self) -> DMatrix<f64> {
        let (components, frames) = self.coefficients.shape();
        let mut inputs = DMatrix::zeros(2 * components + self.control.nrows(), frames);
        for lag in 1..=2.min(frames) {
            inputs
                .view_mut(((lag - 1) * components, lag), (components, frames - lag))
                .copy_from(&self.coefficients.columns(0, frames - lag));
        }
        inputs
            .rows_mut(2 * components, self.control.nrows())
            .copy_from(&self.control);
        inputs
    }
}

/// Sums over the training frames.
pub(super) struct Sums {
    /// Inputs with inputs.
    square: DMatrix<f64>,
    /// Inputs with outputs.
    cross: DMatrix<f64>,
    components: usize,
    frames: usize,
}

impl Sums {
    /// Over all frames of `series`.
    pub fn of(series: &[Series]) -> Self {
        let components = series.first().map_or(0, |s| s.coefficients.nrows());
        let inputs = 2 * components + series.first().map_or(0, |s| s.control.nrows());
        let mut square = DMatrix::zeros(inputs, inputs);
        let mut cross = DMatrix::zeros(inputs, components);
        let mut frames = 0;
        for clip in series {
            let inputs = clip.inputs();
            square.gemm(1.0, &inputs, &inputs.transpose(), 1.0);
            cross.gemm(1.0, &inputs, &clip.coefficients.transpose(), 1.0);
            frames += clip.coefficients.ncols();
        }
        Self {
            square,
            cross,
            components,
            frames,
        }
    }

    /// The regression with the given ridge, made stable; none where the equations cannot be solved.
    pub fn solve(&self, ridge: f64, largest_radius: f64) -> Option<Regression> {
        let count = self.square.nrows();
        let mut square = self.square.clone();
        for k in 0..count {
            square[(k, k)] += ridge * self.frames as f64;
        }
        let weights = square.cholesky()?.solve(&self.cross).transpose();
        let n = self.components;
        let mut first = weights.columns(0, n).into_owned();
        let mut second = weights.columns(n, n).into_owned();
        let fitted_radius = spectral_radius(&first, &second);
        if !fitted_radius.is_finite() {
            return None;
        }
        let pole_scale = (largest_radius / fitted_radius.max(f64::MIN_POSITIVE)).min(1.0);
        first *= pole_scale;
        second *= pole_scale * pole_scale;
        Some(Regression {
            first,
            second,
            control: weights.columns(2 * n, count - 2 * n).into_owned(),
            fitted_radius,
            pole_scale,
        })
    }
}

/// `δ_t = A δ_{t-1} + B δ_{t-2} + C φ_t` in standardised units.
#[derive(Clone, Debug)]
pub(super) struct Regression {
    /// A.
    pub first: DMatrix<f64>,
    /// B.
    pub second: DMatrix<f64>,
    /// C.
    pub control: DMatrix<f64>,
    /// Spectral radius before it was made stable.
    pub fitted_radius: f64,
    /// What the roots were multiplied with.
    pub pole_scale: f64,
}

impl Regression {
    /// Coefficients of a clip from its control vectors alone, `[component][frame]`.
    pub fn roll_out(&self, series: &Series) -> DMatrix<f64> {
        let mut driven = &self.control * &series.control;
        let zero = DVector::zeros(self.first.nrows());
        let (mut latest, mut before) = (zero.clone(), zero);
        for mut column in driven.column_iter_mut() {
            column.gemv(1.0, &self.first, &latest, 1.0);
            column.gemv(1.0, &self.second, &before, 1.0);
            before = latest;
            latest = column.into_owned();
        }
        driven
    }

    /// Error of the roll-outs over their length without any prediction: roots of the mean squares,
    /// frame by frame.
    pub fn roll_out_ratio(&self, series: &[Series], deviation_m: &[f32]) -> f64 {
        let length = |mut column: DVector<f64>| {
            for (x, deviation) in column.iter_mut().zip(deviation_m) {
                *x *= f64::from(*deviation);
            }
            column.norm()
        };
        let (mut error, mut still) = (0.0, 0.0);
        for clip in series {
            let predicted = self.roll_out(clip);
            for (predicted, truth) in predicted.column_iter().zip(clip.coefficients.column_iter()) {
                error += length(predicted - truth);
                still += length(truth.into_owned());
            }
        }
        error / still.max(f64::MIN_POSITIVE)
    }
}

/// A bound from above of the spectral radius of [[A, B], [I, 0]], off by less than 0.1 %.
fn spectral_radius(first: &DMatrix<f64>, second: &DMatrix<f64>) -> f64 {
    let n = first.nrows();
    let mut power = DMatrix::zeros(2 * n, 2 * n);
    power.view_mut((0, 0), (n, n)).copy_from(first);
    power.view_mut((0, n), (n, n)).copy_from(second);
    power.view_mut((n, 0), (n, n)).fill_with_identity();
    // The matrix is kept near length 1; `log` is the logarithm of what was divided out.
    let mut log = 0.0;
    for squaring in 0..=SQUARINGS {
        let norm = power.norm();
        if norm == 0.0 {
            return 0.0;
        }
        power /= norm;
        log += norm.ln();
        if squaring < SQUARINGS {
            power = &power * &power;
            log *= 2.0;
        }
    }
    (log / f64::from(1 << SQUARINGS)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two oscillators driven by two inputs, as exact recurrences.
    fn law() -> Regression {
        // r and angle a tick: coefficients 2 r cos and -r².
        let pole = |r: f64, angle: f64| (2.0 * r * angle.cos(), -r * r);
        let ((a0, b0), (a1, b1)) = (pole(0.97, 0.4), pole(0.93, 0.7));
        Regression {
            first: DMatrix::from_row_slice(2, 2, &[a0, 0.0, 0.0, a1]),
            second: DMatrix::from_row_slice(2, 2, &[b0, 0.0, 0.0, b1]),
            control: DMatrix::from_row_slice(2, 2, &[0.3, 0.1, -0.2, 0.4]),
            fitted_radius: 0.97,
            pole_scale: 1.0,
        }
    }

    fn series(law: &Regression) -> Series {
        let control = DMatrix::from_fn(2, 400, |input, frame| {
            let t = frame as f64;
            (0.13 * t * (1.0 + input as f64)).sin() + (0.37 * t).cos() * input as f64
        });
        let mut series = Series {
            coefficients: DMatrix::zeros(2, 400),
            control,
        };
        series.coefficients = law.roll_out(&series);
        series
    }

    #[test]
    fn a_known_law_is_found_and_rolled_out() {
        let law = law();
        let series = [series(&law)];
        let found = Sums::of(&series).solve(1e-12, 0.99).expect("a regression");
        assert!((&found.first - &law.first).amax() < 1e-4, "{found:?}");
        assert!((&found.control - &law.control).amax() < 1e-4, "{found:?}");
        assert!((found.fitted_radius - 0.97).abs() < 1e-3, "{found:?}");
        assert!(found.roll_out_ratio(&series, &[1.0, 1.0]) < 1e-3);
    }

    #[test]
    fn what_would_grow_is_made_to_die_away() {
        let law = law();
        let sums = Sums::of(&[series(&law)]);
        let tame = sums.solve(1e-12, 0.5).expect("a regression");
        assert!(spectral_radius(&tame.first, &tame.second) <= 0.5 * 1.001);
        let mut grown = law.clone();
        grown.first *= 1.1;
        grown.second *= 1.1 * 1.1;
        let radius = spectral_radius(&grown.first, &grown.second);
        assert!((radius / (1.1 * 0.97) - 1.0).abs() < 1e-3, "{radius}");
    }
}
