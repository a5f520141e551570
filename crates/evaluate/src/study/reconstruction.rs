//! The best that any predictor could achieve with a decoder: the offsets nearest to given ones that it can
//! represent.

use dynaskin_runtime::{Decoder, DecoderSession};
use nalgebra::{DMatrix, DMatrixView, DVector};

use dynaskin_train::TrainError;

/// Most steps of a search.
const MOST_STEPS: usize = 20;
/// How often a step that makes it worse is tried again, each time ten times shorter or so.
const MOST_TRIALS: usize = 8;
/// A search ends where a step takes less than this share off the square error.
const LEAST_GAIN: f64 = 1e-4;
/// How far latents are moved to see what they do, relative to their size or to 1.
const PROBE: f32 = 0.01;
/// Directions with less than this share of the largest one's square add nothing.
const LEAST_SHARE: f64 = 1e-8;

/// A bundle's decoder by itself.
pub struct Reach {
    session: DecoderSession,
    latents: usize,
    coordinates: usize,
}

impl Reach {
    /// Of the graph `decoder_onnx`.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where the runtime refuses it.
    pub fn load(decoder_onnx: &[u8]) -> Result<Self, TrainError> {
        let decoder = Decoder::load(decoder_onnx)?;
        Ok(Self {
            session: DecoderSession::new(&decoder)?,
            latents: decoder.latent_count(),
            coordinates: 3 * decoder.vertex_count(),
        })
    }

    /// Numbers that it makes a frame from.
    pub fn latent_count(&self) -> usize {
        self.latents
    }

    /// What it gives with the latents that suit one frame of offsets best (`[slot][xyz]` in metres,
    /// least squares). Exact where it is linear; otherwise what a search from latents of 0 finds,
    /// which need not be the best there is.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where the decoder fails.
    pub fn nearest(&mut self, truth_m: &[f32]) -> Result<Vec<f32>, TrainError> {
        let session = &mut self.session;
        search(self.latents, truth_m, |latents, field_m| {
            Ok(session.decode(latents, field_m)?)
        })
    }

    /// What it spans, if it is linear.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where the decoder fails.
    pub(super) fn span(&mut self) -> Result<Span, TrainError> {
        let mut fields = vec![0.0; self.latents * self.coordinates];
        let mut latents = vec![0.0; self.latents];
        for (index, field) in fields.chunks_exact_mut(self.coordinates).enumerate() {
            latents[index] = 1.0;
            self.session.decode(&latents, field)?;
            latents[index] = 0.0;
        }
        Ok(Span::of(&fields, self.coordinates))
    }
}

/// Levenberg's and Marquardt's search for the latents whose field comes nearest to `truth_m`; gives
/// the field.
fn search(
    latents: usize,
    truth_m: &[f32],
    mut decode: impl FnMut(&[f32], &mut [f32]) -> Result<(), TrainError>,
) -> Result<Vec<f32>, TrainError> {
    let mut at = vec![0.0; latents];
    let mut field_m = vec![0.0; truth_m.len()];
    decode(&at, &mut field_m)?;
    let mut square = square_error(&field_m, truth_m);
    let (mut damping, mut tried_m) = (1e-6, field_m.clone());
    for _ in 0..MOST_STEPS {
        let size = (at.iter().map(|x| x * x).sum::<f32>() / latents.max(1) as f32).sqrt();
        let probe = PROBE * size.max(1.0);
        let mut slopes = DMatrix::zeros(truth_m.len(), latents);
        for index in 0..latents {
            let was = at[index];
            at[index] = was + probe;
            decode(&at, &mut tried_m)?;
            at[index] = was;
            for (row, (moved, still)) in tried_m.iter().zip(&field_m).enumerate() {
                slopes[(row, index)] = f64::from((moved - still) / probe);
            }
        }
        let missing = truth_m.iter().zip(&field_m);
        let missing = missing.map(|(truth, field)| f64::from(truth - field));
        let missing = DVector::from_iterator(truth_m.len(), missing);
        let transposed = slopes.transpose();
        let (normal, pull) = (&transposed * slopes, transposed * missing);

        let before = square;
        for _ in 0..MOST_TRIALS {
            if let Some(step) = damped_step(&normal, &pull, damping) {
                let tried: Vec<f32> = at.iter().zip(&step).map(|(a, s)| a + *s as f32).collect();
                decode(&tried, &mut tried_m)?;
                let reached = square_error(&tried_m, truth_m);
                if reached < square {
                    (at, square) = (tried, reached);
                    field_m.copy_from_slice(&tried_m);
                    damping *= 0.1;
                    break;
                }
            }
            damping *= 10.0;
        }
        if square >= (1.0 - LEAST_GAIN) * before {
            break;
        }
    }
    Ok(field_m)
}

/// The step that solves the normal equations; none where they cannot be solved.
fn damped_step(normal: &DMatrix<f64>, pull: &DVector<f64>, damping: f64) -> Option<Vec<f64>> {
    let mut damped = normal.clone();
    // Latents that do nothing stay where they are.
    let least = LEAST_SHARE * normal.diagonal().max();
    for index in 0..damped.nrows() {
        damped[(index, index)] += damping * normal[(index, index)].max(least);
    }
    let step = damped.cholesky()?.solve(pull);
    Some(step.as_slice().to_vec())
}

fn square_error(field_m: &[f32], truth_m: &[f32]) -> f64 {
    let pairs = field_m.iter().zip(truth_m);
    pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

/// All that a linear decoder can give.
pub(super) struct Span {
    /// Orthonormal, `[coordinate][direction]`.
    directions: DMatrix<f32>,
    transposed: DMatrix<f32>,
}

impl Span {
    /// Of `fields`, `[field][coordinate]` flat; what others among them give already adds nothing.
    pub fn of(fields: &[f32], coordinates: usize) -> Self {
        let mut columns = DMatrix::from_iterator(
            coordinates,
            fields.len() / coordinates.max(1),
            fields.iter().map(|x| f64::from(*x)),
        );
        // Fields of all sizes count alike.
        for mut column in columns.column_iter_mut() {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
        }
        let spectrum = (columns.transpose() * &columns).symmetric_eigen();
        let least = LEAST_SHARE * spectrum.eigenvalues.iter().copied().fold(0.0, f64::max);
        let kept: Vec<usize> = (0..columns.ncols())
            .filter(|index| spectrum.eigenvalues[*index] > least)
            .collect();
        let mut turn = spectrum.eigenvectors.select_columns(&kept);
        for (mut column, index) in turn.column_iter_mut().zip(&kept) {
            column /= spectrum.eigenvalues[*index].sqrt();
        }
        let directions = (columns * turn).map(|x| x as f32);
        Self {
            transposed: directions.transpose(),
            directions,
        }
    }

    /// For each frame of offsets the nearest field, both `[frame][coordinate]` flat.
    pub fn nearest(&self, offsets_m: &[f32]) -> Vec<f32> {
        let coordinates = self.directions.nrows();
        let frames = offsets_m.len() / coordinates.max(1);
        let columns = DMatrixView::from_slice(offsets_m, coordinates, frames);
        let nearest = &self.directions * (&self.transposed * columns);
        nearest.as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bent latents mixed into eight coordinates, some centimetres large.
    fn bent(latents: &[f32], field_m: &mut [f32]) -> Result<(), TrainError> {
        for (row, x) in field_m.iter_mut().enumerate() {
            let mixed = latents.iter().enumerate().map(|(k, latent)| {
                let weight = (1.7 * row as f32 + 2.3 * k as f32).sin();
                weight * (latent.tanh() + 0.2 * latent)
            });
            *x = 0.02 * mixed.sum::<f32>() + 0.003;
        }
        Ok(())
    }

    #[test]
    fn latents_of_a_bent_decoder_are_found() {
        let mut truth_m = vec![0.0; 8];
        bent(&[1.4, -0.8, 2.5], &mut truth_m).expect("a field");
        let found = search(3, &truth_m, bent).expect("a field");
        for (found, truth) in found.iter().zip(&truth_m) {
            assert!((found - truth).abs() < 1e-4, "{found} for {truth}");
        }
    }

    #[test]
    fn of_a_linear_decoder_the_nearest_is_the_projection() {
        // Latents move coordinate 0 (much), 1 and 2 together (a little); the last does nothing.
        let fields = [200.0, 0.0, 0.0, 0.0, 0.01, 0.01, 0.0, 0.0, 0.0];
        let decode = |latents: &[f32], field: &mut [f32]| {
            for (row, x) in field.iter_mut().enumerate() {
                *x = (0..3).map(|k| latents[k] * fields[3 * k + row]).sum();
            }
            Ok(())
        };
        let searched = search(3, &[5.0, 3.0, 1.0], decode).expect("a field");
        let span = Span::of(&fields, 3);
        assert_eq!(span.directions.ncols(), 2);
        let projected = span.nearest(&[5.0, 3.0, 1.0]);
        for (index, expected) in [5.0, 2.0, 2.0].into_iter().enumerate() {
            assert!((searched[index] - expected).abs() < 1e-3, "{searched:?}");
            assert!((projected[index] - expected).abs() < 1e-5, "{projected:?}");
        }
    }
}
