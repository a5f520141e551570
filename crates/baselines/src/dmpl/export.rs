//! The auto-regression as an ONNX file of the project's contract (ARCHITECTURE.md, "ONNX").

use dynaskin_onnx::{Graph, Precision};
use nalgebra::DMatrix;

use super::regression::Regression;
use dynaskin_train::{Basis, Normaliser, TrainError};

/// `predictor.onnx`: the states `state_latest` and `state_before` [1,L] are δ_{t-1} and δ_{t-2} in
/// units of their deviations; the latent [1,L] is δ_t in metres.
///
/// # Errors
/// [`TrainError::Onnx`].
pub(super) fn predictor_onnx(
    regression: &Regression,
    normaliser: &Normaliser,
    deviation_m: &[f32],
) -> Result<Vec<u8>, TrainError> {
    let (inputs, components) = (normaliser.origin.len(), deviation_m.len());
    let single = Precision::Single;
    let mut graph = Graph::new("predictor");
    let features = graph.input("features", &[1, inputs])?;
    let latest = graph.input("state_latest", &[1, components])?;
    let before = graph.input("state_before", &[1, components])?;

    let origin = graph.weights("origin", &[inputs], &normaliser.origin, single)?;
    let centred = graph.sub(&features, &origin)?;
    let mut control = regression.control.clone();
    for (mut column, scale) in control.column_iter_mut().zip(&normaliser.scale) {
        column *= f64::from(*scale);
    }
    let control = graph.weights("control", &[inputs, components], &rows(&control), single)?;
    let driven = graph.matmul(&centred, &control)?;
    let mut memory = rows(&regression.first);
    memory.extend(rows(&regression.second));
    let memory = graph.weights("memory", &[2 * components, components], &memory, single)?;
    let past = graph.concat(&[&latest, &before], 1)?;
    let remembered = graph.matmul(&past, &memory)?;
    let next = graph.add(&driven, &remembered)?;
    let deviation = graph.weights("deviation", &[components], deviation_m, single)?;
    let latent = graph.mul(&next, &deviation)?;
    graph.output("latent", &latent)?;
    graph.output("state_latest_out", &next)?;
    graph.output("state_before_out", &latest)?;
    Ok(graph.into_bytes())
}

/// `decoder.onnx`: the latent [1,L] in metres times the components, stored in half precision.
///
/// # Errors
/// [`TrainError::Onnx`].
pub(super) fn decoder_onnx(basis: &Basis) -> Result<Vec<u8>, TrainError> {
    let (components, coordinates) = (basis.components(), basis.coordinates());
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, components])?;
    let shape = [components, coordinates];
    let rows = graph.weights("components", &shape, &basis.rows(), Precision::Half)?;
    let flat = graph.matmul(&latent, &rows)?;
    let offsets = graph.reshape(&flat, &[1, coordinates / 3, 3])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

/// `[to][from]` as rows of a matrix that a row of inputs is multiplied with.
fn rows(matrix: &DMatrix<f64>) -> Vec<f32> {
    // Column-major [to][from] is row-major [from][to].
    matrix.iter().map(|x| *x as f32).collect()
}

#[cfg(test)]
mod tests {
    use dynaskin_runtime::features::FeatureKind;

    use super::super::regression::Series;
    use super::*;
    use dynaskin_evaluate::Player;

    #[test]
    fn the_exported_regression_rolls_out_as_the_fitted_one() {
        let (components, inputs) = (3, FeatureKind::Inertial.count());
        let wave = |row: usize, column: usize| ((3 * row + 7 * column) as f64 * 0.61).sin();
        let regression = Regression {
            first: DMatrix::from_fn(3, 3, |r, c| 0.2 * wave(r, c)),
            second: DMatrix::from_fn(3, 3, |r, c| -0.1 * wave(c, r + 1)),
            control: DMatrix::from_fn(3, inputs, |r, c| 0.1 * wave(r + 2, c)),
            fitted_radius: 1.0,
            pole_scale: 1.0,
        };
        let normaliser = Normaliser {
            origin: (0..inputs).map(|i| 0.2 * (i % 5) as f32).collect(),
            scale: vec![0.5; inputs],
            motion: FeatureKind::Inertial.motion_count(),
        };
        let deviation_m = [0.02f32, 0.01, 0.005];
        let features: Vec<f32> = (0..20 * inputs)
            .map(|k| normaliser.origin[k % inputs] + (k as f32 * 0.37).sin())
            .collect();
        let series = Series::new(&normaliser, &features, &[0.0; 60], &deviation_m);
        let expected = regression.roll_out(&series);

        let predictor =
            predictor_onnx(&regression, &normaliser, &deviation_m).expect("a predictor");
        let mut graph = Graph::new("decoder");
        let latent = graph.input("latent", &[1, components]).expect("an input");
        let offsets = graph.reshape(&latent, &[1, 1, 3]).expect("a shape");
        graph.output("offsets", &offsets).expect("an output");
        let mut player =
            Player::new(FeatureKind::Inertial, &predictor, &graph.into_bytes()).expect("networks");
        let got = player.play(&features).expect("offsets");
        for (frame, column) in got.chunks_exact(3).zip(expected.column_iter()) {
            for component in 0..3 {
                let expected = column[component] * f64::from(deviation_m[component]);
                let error = (f64::from(frame[component]) - expected).abs();
                assert!(
                    error < 1e-6 + 1e-5 * expected.abs(),
                    "{frame:?} {expected} {error}"
                );
            }
        }
        assert!(got.iter().any(|x| x.abs() > 1e-4), "nothing moved");
    }
}
