//! A linear subspace of the offsets: principal components about zero.
//!
//! The mean is not taken out. The rest state is offset zero, so a basis without a mean keeps
//! latent 0 = offset 0 exactly, and a settled body stands exactly on its skin.

use nalgebra::{DMatrix, DMatrixView};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::TrainError;

/// Extra directions carried through the subspace iteration, and how often it goes round: with
/// these the spectra of soft-tissue offsets come out to four digits (tested below).
const OVERSAMPLING: usize = 16;
const ROUNDS: usize = 3;

/// Orthonormal directions in offset space, largest variance first. With them squared distances
/// between latents are squared distances between offset fields, in square metres.
#[derive(Clone, Debug)]
pub struct Basis {
    /// `[coordinate][component]`; coordinate = 3 · slot + axis.
    directions: DMatrix<f32>,
    /// The same, transposed, for blocked products.
    transposed: DMatrix<f32>,
    /// Root mean square of each latent over the sample, in metres.
    pub deviation_m: Vec<f32>,
}

impl Basis {
    /// The `components` leading directions of `sample`, one frame of offsets (metres) a row.
    ///
    /// Randomised subspace iteration (Halko, Martinsson, Tropp 2011, algorithm 4.4).
    ///
    /// # Errors
    /// [`TrainError::Config`] where the sample has fewer rows or columns than `components`;
    /// [`TrainError::NotFinite`].
    pub fn fit(sample: &DMatrix<f32>, components: usize, seed: u64) -> Result<Self, TrainError> {
        let most = sample.nrows().min(sample.ncols());
        if components == 0 || components > most {
            return Err(TrainError::Config {
                setting: "components",
                got: components.to_string(),
                expected: format!("1 to {most}, the frames sampled and the coordinates they have"),
            });
        }
        if sample.iter().any(|x| !x.is_finite()) {
            return Err(TrainError::NotFinite {
                place: "the sample of offsets".into(),
            });
        }
        let width = (components + OVERSAMPLING).min(most);
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let probe = DMatrix::from_fn(sample.nrows(), width, |_, _| rng.random_range(-1.0..1.0));
        // Products of a transposed copy are blocked ones; nalgebra's `tr_mul` is not.
        let transposed = sample.transpose();
        let mut range = (&transposed * probe).qr().q();
        for _ in 0..ROUNDS {
            range = (&transposed * (sample * &range)).qr().q();
        }
        drop(transposed);
        // Not by the eigenvectors of its square: nalgebra's are NaN in single precision where offsets move in few
        // ways.
        let spectrum = (sample * &range).svd(false, true);
        let Some(turned) = spectrum.v_t else {
            return Err(TrainError::NotFinite {
                place: "the principal components".into(),
            });
        };
        let turn = turned.rows(0, components).transpose();
        let frames = sample.nrows() as f32;
        let directions = range * turn;
        Ok(Self {
            transposed: directions.transpose(),
            directions,
            deviation_m: spectrum
                .singular_values
                .iter()
                .take(components)
                .map(|value| value / frames.sqrt())
                .collect(),
        })
    }

    /// The first `components` directions only.
    #[must_use]
    pub fn truncated(&self, components: usize) -> Self {
        let directions = self.directions.columns(0, components).into_owned();
        Self {
            transposed: directions.transpose(),
            directions,
            deviation_m: self.deviation_m[..components].to_vec(),
        }
    }

    /// The same directions, each through `map`, which must be linear and keep lengths and angles.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(&[f32], &mut [f32])) -> Self {
        let mut directions = self.directions.clone();
        for (from, mut to) in self
            .directions
            .column_iter()
            .zip(directions.column_iter_mut())
        {
            map(from.as_slice(), to.as_mut_slice());
        }
        Self {
            transposed: directions.transpose(),
            directions,
            deviation_m: self.deviation_m.clone(),
        }
    }

    /// The directions of two bases that are orthogonal to each other, largest variance first.
    #[must_use]
    pub fn merged(&self, other: &Self) -> Self {
        let all = self.directions.column_iter().zip(&self.deviation_m);
        let mut all: Vec<_> = all
            .chain(other.directions.column_iter().zip(&other.deviation_m))
            .collect();
        all.sort_by(|a, b| b.1.total_cmp(a.1));
        let (columns, deviation_m): (Vec<_>, Vec<f32>) = all.into_iter().unzip();
        let directions = DMatrix::from_columns(&columns);
        Self {
            transposed: directions.transpose(),
            directions,
            deviation_m,
        }
    }

    /// Number of components.
    pub fn components(&self) -> usize {
        self.directions.ncols()
    }

    /// Number of coordinates: three a vertex.
    pub fn coordinates(&self) -> usize {
        self.directions.nrows()
    }

    /// Latents of `frames` of offsets: `[frame][coordinate]` in metres, flat; gives
    /// `[frame][component]`, flat, in metres.
    ///
    /// # Panics
    /// If the length is not a multiple of the coordinates.
    pub fn project(&self, offsets: &[f32]) -> Vec<f32> {
        let frames = offsets.len() / self.coordinates();
        assert_eq!(offsets.len(), frames * self.coordinates());
        // Row-major frames are the columns of nalgebra's column-major matrix.
        let columns = DMatrixView::from_slice(offsets, self.coordinates(), frames);
        (&self.transposed * columns).as_slice().to_vec()
    }

    /// The matrix `[component][coordinate]`, row-major: a latent times it is an offset field.
    pub fn rows(&self) -> Vec<f32> {
        self.directions.as_slice().to_vec()
    }

    /// What a linear map of offset fields does to latents, `[component][component]` row-major:
    /// a latent (row) times it is the latent of the mapped field. Exact where the map keeps the
    /// subspace, as a mirror keeps that of a sample that holds every frame's mirror image.
    pub fn induced(&self, map: impl Fn(&[f32], &mut [f32])) -> Vec<f32> {
        let mut mapped = DMatrix::zeros(self.coordinates(), self.components());
        for component in 0..self.components() {
            let column = self.directions.column(component);
            map(
                column.as_slice(),
                mapped.column_mut(component).as_mut_slice(),
            );
        }
        // Column-major [to][from] is row-major [from][to].
        (&self.transposed * mapped).as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that mix `rank` random orthogonal fields, the k-th with amplitude 0.8^k.
    fn frames(count: usize, coordinates: usize, rank: usize) -> DMatrix<f32> {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let fields =
            DMatrix::from_fn(coordinates, rank, |_, _| rng.random_range(-1.0f32..1.0)).qr();
        let mix = DMatrix::from_fn(count, rank, |_, k| {
            rng.random_range(-1.0f32..1.0) * 0.8f32.powi(k as i32)
        });
        mix * fields.q().transpose()
    }

    #[test]
    fn agrees_with_the_full_decomposition() {
        let sample = frames(300, 90, 40);
        let basis = Basis::fit(&sample, 12, 1).expect("a basis");
        let exact = sample.clone().svd(false, false).singular_values;
        for (k, deviation) in basis.deviation_m.iter().enumerate() {
            let expected = exact[k] / (300f32).sqrt();
            assert!((deviation / expected - 1.0).abs() < 1e-3, "component {k}");
        }
        let gram = basis.directions.tr_mul(&basis.directions);
        assert!((gram - DMatrix::identity(12, 12)).amax() < 1e-5);
    }

    #[test]
    fn offsets_that_move_in_one_way_have_a_basis() {
        // What rounding leaves of the other ways spreads over many orders of magnitude.
        let sample = DMatrix::from_fn(40, 300, |frame, coordinate| {
            let swing = (0.3 * frame as f32).sin();
            let size_m = 0.01 * (-(coordinate as f32) / 20.0).exp();
            swing * size_m
        });
        let basis = Basis::fit(&sample, 24, 1).expect("a basis");
        let rows = basis.rows();
        assert!(rows.iter().all(|x| x.is_finite()));
        assert!(basis.deviation_m[0] > 1e-3 && basis.deviation_m[1] < 1e-6);
        let field: Vec<f32> = sample.row(7).iter().copied().collect();
        let latent = basis.project(&field)[0];
        for (coordinate, metres) in field.iter().enumerate() {
            assert!((latent * rows[coordinate] - metres).abs() < 1e-6);
        }
    }

    #[test]
    fn a_field_in_the_subspace_comes_back() {
        let sample = frames(50, 30, 5);
        let basis = Basis::fit(&sample, 5, 1).expect("a basis");
        let field: Vec<f32> = sample.row(3).iter().copied().collect();
        let latent = basis.project(&field);
        let rows = basis.rows();
        for (coordinate, expected) in field.iter().enumerate() {
            let got: f32 = (0..5).map(|k| latent[k] * rows[k * 30 + coordinate]).sum();
            assert!((got - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn an_induced_map_acts_on_latents() {
        // The subspace of frames and their images under a swap of halves is kept by the swap.
        let swap = |from: &[f32], to: &mut [f32]| {
            to[..15].copy_from_slice(&from[15..]);
            to[15..].copy_from_slice(&from[..15]);
        };
        let half = frames(20, 30, 3);
        let both = DMatrix::from_fn(40, 30, |row, column| {
            half[(row % 20, if row < 20 { column } else { (column + 15) % 30 })]
        });
        let basis = Basis::fit(&both, 6, 1).expect("a basis");
        let induced = basis.induced(swap);
        let field: Vec<f32> = half.row(0).iter().copied().collect();
        let mut swapped = vec![0.0; 30];
        swap(&field, &mut swapped);
        let (latent, expected) = (basis.project(&field), basis.project(&swapped));
        for to in 0..6 {
            let got: f32 = (0..6)
                .map(|from| latent[from] * induced[from * 6 + to])
                .sum();
            assert!((got - expected[to]).abs() < 1e-5);
        }
    }

    #[test]
    fn refuses_more_components_than_frames() {
        let error = Basis::fit(&frames(8, 30, 5), 9, 1).expect_err("too many");
        assert!(error.to_string().contains("1 to 8"), "{error}");
    }
}
