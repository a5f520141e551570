//! The shape space: stature as one coefficient, a principal component analysis of
//! stature-normalised random adults as the other nine, and linear fits of joints and thickness.

use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use dynaskin_body::{JOINT_COUNT, SHAPE_COUNT};

/// Standard deviation of adult stature over its mean, both sexes.
pub(super) const STATURE_RELATIVE_DEVIATION: f32 = 0.04;

/// One random adult, scaled to the mean stature, soles on y = 0.
pub(super) struct Sample {
    pub positions_m: Vec<Vec3>,
    pub joints_m: [Vec3; JOINT_COUNT],
    pub thickness_m: Vec<f32>,
}

/// Mean and directions of positions, joints and thickness.
pub(super) struct ShapeSpace {
    pub template_m: Vec<Vec3>,
    pub shape_dirs_m: Vec<Vec<Vec3>>,
    pub joint_template_m: [Vec3; JOINT_COUNT],
    pub joint_shape_dirs_m: Vec<[Vec3; JOINT_COUNT]>,
    pub thickness_template_m: Vec<f32>,
    pub thickness_shape_dirs_m: Vec<Vec<f32>>,
    /// The samples' coefficients, a row each; the column of the stature holds ones.
    pub coefficients: DMatrix<f64>,
}

/// Analyses `samples` (at least as many as coefficients).
pub(super) fn analyse(samples: &[Sample]) -> ShapeSpace {
    let n_samples = samples.len();
    let n_vertices = samples[0].positions_m.len();
    let mut mean_m = vec![DVec3::ZERO; n_vertices];
    for sample in samples {
        for (mean, position) in mean_m.iter_mut().zip(&sample.positions_m) {
            *mean += position.as_dvec3() / n_samples as f64;
        }
    }
    // Principal components through the Gram matrix: 300 samples against 20,670 coordinates.
    let centred = DMatrix::from_fn(3 * n_vertices, n_samples, |row, col| {
        f64::from(samples[col].positions_m[row / 3][row % 3]) - mean_m[row / 3][row % 3]
    });
    let eigen = SymmetricEigen::new(centred.tr_mul(&centred) / (n_samples as f64 - 1.0));
    let mut order: Vec<usize> = (0..n_samples).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));

    let mut shape_dirs_m = vec![
        mean_m
            .iter()
            .map(|mean| mean.as_vec3() * STATURE_RELATIVE_DEVIATION)
            .collect::<Vec<_>>(),
    ];
    // Coefficients of the samples in standard deviations, with a first column of ones.
    let mut coefficients = DMatrix::zeros(n_samples, SHAPE_COUNT);
    coefficients.column_mut(0).fill(1.0);
    for (component, &idx) in order.iter().take(SHAPE_COUNT - 1).enumerate() {
        let deviation_m = eigen.eigenvalues[idx].max(0.0).sqrt();
        let vector = eigen.eigenvectors.column(idx);
        // X v has length deviation * sqrt(n - 1): one standard deviation of displacement.
        let mut dir: DVector<f64> = &centred * vector / (n_samples as f64 - 1.0).sqrt();
        // Larger bodies get positive coefficients, whatever sign the solver found.
        let growth: f64 = (0..n_vertices).map(|v| dir[3 * v] * mean_m[v].x).sum();
        let sign = if growth < 0.0 { -1.0 } else { 1.0 };
        dir *= sign;
        for sample in 0..n_samples {
            coefficients[(sample, component + 1)] =
                sign * vector[sample] * (n_samples as f64 - 1.0).sqrt();
        }
        debug_assert!((dir.norm() - deviation_m).abs() <= 1e-6 + 1e-3 * deviation_m);
        shape_dirs_m.push(
            (0..n_vertices)
                .map(|v| DVec3::new(dir[3 * v], dir[3 * v + 1], dir[3 * v + 2]).as_vec3())
                .collect(),
        );
    }

    let joints = DMatrix::from_fn(n_samples, 3 * JOINT_COUNT, |row, col| {
        f64::from(samples[row].joints_m[col / 3][col % 3])
    });
    let thickness = DMatrix::from_fn(n_samples, n_vertices, |row, col| {
        f64::from(samples[row].thickness_m[col])
    });
    // Least squares by the normal equations; the coefficients are uncorrelated by construction.
    let gram = coefficients.tr_mul(&coefficients);
    let inverse = gram
        .try_inverse()
        .unwrap_or_else(|| DMatrix::identity(SHAPE_COUNT, SHAPE_COUNT));
    let joint_fit = &inverse * coefficients.tr_mul(&joints);
    let thickness_fit = &inverse * coefficients.tr_mul(&thickness);

    let joint_row = |row: usize| -> [Vec3; JOINT_COUNT] {
        std::array::from_fn(|j| {
            DVec3::from_array(std::array::from_fn(|k| joint_fit[(row, 3 * j + k)])).as_vec3()
        })
    };
    let thickness_row = |row: usize| -> Vec<f32> {
        (0..n_vertices)
            .map(|v| thickness_fit[(row, v)] as f32)
            .collect()
    };
    let joint_template_m = joint_row(0);
    let thickness_template_m = thickness_row(0);
    let mut joint_shape_dirs_m = vec![joint_template_m.map(|j| j * STATURE_RELATIVE_DEVIATION)];
    let mut thickness_shape_dirs_m = vec![
        thickness_template_m
            .iter()
            .map(|t| t * STATURE_RELATIVE_DEVIATION)
            .collect(),
    ];
    for row in 1..SHAPE_COUNT {
        joint_shape_dirs_m.push(joint_row(row));
        thickness_shape_dirs_m.push(thickness_row(row));
    }
    ShapeSpace {
        template_m: mean_m.iter().map(|mean| mean.as_vec3()).collect(),
        shape_dirs_m,
        joint_template_m,
        joint_shape_dirs_m,
        thickness_template_m,
        thickness_shape_dirs_m,
        coefficients,
    }
}
