//! Moves the fitted body's surface smoothly to the skin that still lies above it.
//!
//! Ten coefficients, limbs and joints cannot represent individual features and loose clothes. A height along
//! the body's normals, smooth over its surface, accounts for them, so that neighbouring vertices
//! follow neighbouring points. Distant vertices still move less: their distance is measured from the body
//! without its drape.

use dynaskin_body::{BodyModel, vertex_normals};
use faer::linalg::solvers::Solve as _;
use faer::prelude::Mat;
use faer::sparse::{SparseColMat, Triplet};
use glam::Vec3;

use crate::BindError;
use crate::samples::Samples;

/// Rounds of closest points.
const ROUNDS: usize = 3;
/// Weight of the difference between the heights of neighbours over that of a point's distance.
const SMOOTH: f64 = 0.25;
/// Weight of a height itself.
const FLAT: f64 = 0.01;
/// Highest and deepest drape, metres.
const MOST_M: f32 = 0.04;

/// Positions of the fitted body with its drape, metres.
///
/// # Errors
/// [`BindError::NoFit`].
pub fn draped(
    body: &BodyModel,
    samples: &Samples,
    fitted_m: &[Vec3],
) -> Result<Vec<Vec3>, BindError> {
    let normals = vertex_normals(fitted_m, &body.faces);
    let mut heights_m = vec![0.0_f32; fitted_m.len()];
    let at = |heights_m: &[f32]| -> Vec<Vec3> {
        let vertices = fitted_m.iter().zip(&normals).zip(heights_m);
        vertices
            .map(|((at, normal), height)| *at + *normal * *height)
            .collect()
    };
    for _ in 0..ROUNDS {
        let positions_m = at(&heights_m);
        let mut equations = Equations::new(samples, fitted_m.len());
        for found in samples.matches(&positions_m) {
            let corners = found.at.corners.map(|corner| corner as usize);
            let now_m: f32 = (0..3)
                .map(|k| heights_m[corners[k]] * found.at.shares[k])
                .sum();
            let wanted_m = f64::from(now_m + found.height_m(&positions_m));
            equations.add(corners, found.at.shares, wanted_m, f64::from(found.weight));
        }
        heights_m = equations.solved()?;
    }
    Ok(at(&heights_m))
}

struct Equations {
    /// Number of each vertex that has a height.
    number: Vec<Option<usize>>,
    count: usize,
    matrix: Vec<Triplet<usize, usize, f64>>,
    right: Vec<f64>,
}

impl Equations {
    fn new(samples: &Samples, vertex_count: usize) -> Self {
        let mut number = vec![None; vertex_count];
        let mut count = 0;
        for (number, wanted) in number.iter_mut().zip(&samples.wanted) {
            if *wanted {
                *number = Some(count);
                count += 1;
            }
        }
        let mut equations = Self {
            number,
            count,
            matrix: (0..count).map(|own| Triplet::new(own, own, FLAT)).collect(),
            right: vec![0.0; count],
        };
        for face in samples.faces() {
            for [a, b] in [[face[0], face[1]], [face[1], face[2]], [face[2], face[0]]] {
                equations.join(a as usize, b as usize);
            }
        }
        equations
    }

    fn join(&mut self, a: usize, b: usize) {
        if let (Some(a), Some(b)) = (self.number[a], self.number[b]) {
            // Each inner edge is joined twice.
            let weight = 0.5 * SMOOTH;
            self.matrix.extend([
                Triplet::new(a, a, weight),
                Triplet::new(b, b, weight),
                Triplet::new(a, b, -weight),
                Triplet::new(b, a, -weight),
            ]);
        }
    }

    fn add(&mut self, corners: [usize; 3], shares: [f32; 3], wanted_m: f64, weight: f64) {
        for (corner, share) in corners.iter().zip(shares) {
            let Some(row) = self.number[*corner] else {
                continue;
            };
            let own = weight * f64::from(share);
            self.right[row] += own * wanted_m;
            for (other, share) in corners.iter().zip(shares) {
                if let Some(column) = self.number[*other] {
                    self.matrix
                        .push(Triplet::new(row, column, own * f64::from(share)));
                }
            }
        }
    }

    /// Heights of all vertices, metres.
    fn solved(&self) -> Result<Vec<f32>, BindError> {
        let failed = BindError::NoFit("its skin cannot be followed");
        if self.count == 0 {
            return Err(failed);
        }
        let right = Mat::from_fn(self.count, 1, |row, _| self.right[row]);
        let matrix =
            SparseColMat::<usize, f64>::try_new_from_triplets(self.count, self.count, &self.matrix);
        let factor = matrix
            .ok()
            .and_then(|matrix| matrix.sp_cholesky(faer::Side::Lower).ok());
        let solution = factor.ok_or(failed)?.solve(&right);
        let height_m = |row: usize| (solution[(row, 0)] as f32).clamp(-MOST_M, MOST_M);
        let numbers = self.number.iter();
        Ok(numbers.map(|number| number.map_or(0.0, height_m)).collect())
    }
}
