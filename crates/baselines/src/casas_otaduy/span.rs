//! The subspace that the training offsets span, in which the networks are trained.
//!
//! The autoencoder's first and last layers are linear and as wide as the offsets. Gradients of the
//! first never leave the span of what it is given, and the best last layer lies in the span of its
//! targets, so both are trained in coordinates of that span, which is far narrower, and multiplied
//! with its basis afterwards: the same network for a fraction of the time. The basis is
//! orthonormal: distances are those of offset fields.

use nalgebra::DMatrix;

use dynaskin_train::{Basis, TrainError};

/// Fields that vary by less than this share of their mean square do not vary: it is rounding.
const STILL_SHARE: f64 = 1e-9;

/// Offset fields as few numbers, normalised (section 3.5): mean 0, and one deviation for all
/// coordinates, so that distances keep their meaning.
#[derive(Clone, Debug)]
pub(super) struct Span {
    /// Directions in offset space, largest variance first.
    pub basis: Basis,
    /// Mean of each coordinate in metres.
    pub mean_m: Vec<f32>,
    /// What one unit is, in metres.
    pub deviation_m: f32,
    /// Deviation of each normalised coordinate.
    pub deviations: Vec<f32>,
}

impl Span {
    /// The `components` leading directions of `sample`, one frame a row, or as many as it has.
    ///
    /// # Errors
    /// [`TrainError::Config`] for an empty sample, [`TrainError::NotFinite`].
    pub fn fit(sample: &DMatrix<f32>, components: usize, seed: u64) -> Result<Self, TrainError> {
        let most = sample.nrows().min(sample.ncols());
        let basis = Basis::fit(sample, components.min(most), seed)?;
        let coordinates = basis.project(sample.transpose().as_slice());
        let (width, frames) = (basis.components(), sample.nrows() as f64);
        let mut mean_m = vec![0.0f64; width];
        let mut squares = vec![0.0f64; width];
        for frame in coordinates.chunks_exact(width) {
            for (k, x) in frame.iter().enumerate() {
                mean_m[k] += f64::from(*x) / frames;
                squares[k] += f64::from(*x).powi(2) / frames;
            }
        }
        let variances: Vec<f64> = (0..width)
            .map(|k| (squares[k] - mean_m[k].powi(2)).max(0.0))
            .collect();
        let variance = variances.iter().sum::<f64>() / width as f64;
        let square = squares.iter().sum::<f64>() / width as f64;
        if variance <= STILL_SHARE * square {
            return Err(TrainError::Config {
                setting: "data",
                got: "offsets that are the same in every frame sampled".into(),
                expected: "soft tissue that moves".into(),
            });
        }
        let deviation_m = variance.sqrt();
        Ok(Self {
            basis,
            mean_m: mean_m.iter().map(|m| *m as f32).collect(),
            deviation_m: deviation_m as f32,
            deviations: variances
                .iter()
                .map(|v| (v.sqrt() / deviation_m) as f32)
                .collect(),
        })
    }

    /// Number of coordinates of a field.
    pub fn width(&self) -> usize {
        self.basis.components()
    }

    /// Normalised coordinates of frames of offsets (metres), both flat.
    pub fn normalised(&self, offsets_m: &[f32]) -> Vec<f32> {
        let mut fields = self.basis.project(offsets_m);
        for field in fields.chunks_exact_mut(self.width()) {
            for (x, mean_m) in field.iter_mut().zip(&self.mean_m) {
                *x = (*x - mean_m) / self.deviation_m;
            }
        }
        fields
    }

    /// Frames of offsets in metres from normalised coordinates, both flat.
    pub fn offsets_m(&self, fields: &[f32]) -> Vec<f32> {
        let (width, coordinates) = (self.width(), self.basis.coordinates());
        let rows = DMatrix::from_vec(coordinates, width, self.basis.rows());
        let mut metres = DMatrix::from_column_slice(width, fields.len() / width, fields);
        for mut frame in metres.column_iter_mut() {
            for (x, mean_m) in frame.iter_mut().zip(&self.mean_m) {
                *x = *x * self.deviation_m + mean_m;
            }
        }
        (rows * metres).as_slice().to_vec()
    }

    /// Normalised coordinates of no offset at all.
    pub fn zero(&self) -> Vec<f32> {
        let mean = self.mean_m.iter();
        mean.map(|mean_m| -mean_m / self.deviation_m).collect()
    }

    /// R, `[coordinate][coordinate]` row-major, such that the squared length of `R e` is the sum of
    /// squared distances of vertices that e moves, each times its weight.
    ///
    /// # Errors
    /// [`TrainError::NotFinite`] for weights that are not finite.
    pub fn weighting(&self, weights: &[f32]) -> Result<Vec<f32>, TrainError> {
        let width = self.width();
        let rows = self.basis.rows();
        let coordinates = self.basis.coordinates();
        let basis = DMatrix::from_iterator(coordinates, width, rows.iter().map(|x| f64::from(*x)));
        let mut weighted = basis.clone();
        for (coordinate, mut row) in weighted.row_iter_mut().enumerate() {
            row *= f64::from(weights[coordinate / 3]);
        }
        let mut gram = basis.transpose() * weighted;
        // Vertices that hardly weigh leave directions that are nearly free.
        let floor = 1e-9 * gram.trace() / width as f64;
        for k in 0..width {
            gram[(k, k)] += floor;
        }
        let root = gram.cholesky().ok_or_else(|| TrainError::NotFinite {
            place: "the rigidity weights".into(),
        })?;
        // gram = L Lᵀ, so R = Lᵀ; L column-major is R row-major.
        Ok(root.l().iter().map(|x| *x as f32).collect())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Frames that mix `rank` smooth fields about a mean.
    pub fn sample(frames: usize, coordinates: usize, rank: usize) -> DMatrix<f32> {
        DMatrix::from_fn(frames, coordinates, |frame, coordinate| {
            let waves = (0..rank).map(|k| {
                let time = (frame as f32 * (0.31 + 0.17 * k as f32)).sin() * 0.7f32.powi(k as i32);
                let place = (coordinate as f32 * (0.2 + 0.13 * k as f32) + k as f32).cos();
                0.01 * time * place
            });
            0.003 + waves.sum::<f32>()
        })
    }

    #[test]
    fn fields_of_the_span_come_back_and_zero_is_zero() {
        let sample = sample(60, 24, 4);
        let span = Span::fit(&sample, 9, 1).expect("a span");
        let offsets_m: Vec<f32> = sample.transpose().as_slice().to_vec();
        let back = span.offsets_m(&span.normalised(&offsets_m));
        for (got, expected) in back.iter().zip(&offsets_m) {
            assert!((got - expected).abs() < 1e-6, "{got} {expected}");
        }
        assert!(span.offsets_m(&span.zero()).iter().all(|x| x.abs() < 1e-7));
    }

    #[test]
    fn the_weighted_length_is_that_of_weighted_vertices() {
        let sample = sample(60, 24, 4);
        let span = Span::fit(&sample, 4, 1).expect("a span");
        let weights = [0.1, 3.0, 1.0, 0.0, 2.0, 0.5, 1.0, 0.4];
        let root = span.weighting(&weights).expect("a root");
        let error = [0.3f32, -1.0, 0.5, 0.8];
        let directions = span.basis.rows();
        let mut expected = 0.0;
        for coordinate in 0..24 {
            let moved: f32 = (0..4)
                .map(|k| error[k] * directions[k * 24 + coordinate])
                .sum();
            expected += weights[coordinate / 3] * moved * moved;
        }
        let got: f32 = (0..4)
            .map(|row| {
                (0..4)
                    .map(|k| root[row * 4 + k] * error[k])
                    .sum::<f32>()
                    .powi(2)
            })
            .sum();
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} {expected}");
    }

    #[test]
    fn tissue_that_never_moves_is_refused() {
        let still = DMatrix::from_element(10, 6, 0.002);
        assert!(Span::fit(&still, 3, 1).is_err());
    }
}
