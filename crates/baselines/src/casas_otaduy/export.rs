//! The trained networks as ONNX files of the project's contract (ARCHITECTURE.md, "ONNX").

use burn::tensor::{Device, Tensor};
use dynaskin_onnx::{Graph, Precision};

use super::autoencoder::numbers_of;
use super::head::{Head, LatentScale};
use super::regressor::{Regressor, input_count, row};
use super::span::Span;
use super::window::{KIND, POSE};
use dynaskin_train::{Normaliser, TrainError};

/// The trained networks and their scaling.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trained<'a> {
    pub span: &'a Span,
    pub normaliser: &'a Normaliser,
    pub scale: &'a LatentScale,
    pub regressor: &'a Regressor,
    pub head: &'a Head,
}

/// `predictor.onnx`: `features` [1,235] and the latents before, `state_1` and, one tick earlier,
/// `state_2` [1,L], in; `latent` [1,L] and the next states out. Latents are counted from that of a
/// body whose tissue is at rest. The differences of poses and the normalisation are computed in
/// single precision; matrices are stored in `precision`.
///
/// # Errors
/// [`TrainError::Onnx`], such as for weights that are not finite.
pub(super) fn predictor_onnx(
    trained: Trained<'_>,
    precision: Precision,
) -> Result<Vec<u8>, TrainError> {
    let Trained {
        normaliser,
        scale,
        regressor,
        ..
    } = trained;
    let latents = scale.count();
    let mut graph = Graph::new("predictor");
    let vector = |graph: &mut Graph, name: &str, numbers: &[f32]| {
        graph.weights(name, &[numbers.len()], numbers, Precision::Single)
    };
    let inverse = |numbers: &[f32]| numbers.iter().map(|x| 1.0 / x).collect::<Vec<_>>();
    let features = graph.input("features", &[1, KIND.count()])?;
    let newest = graph.input("state_1", &[1, latents])?;
    let before = graph.input("state_2", &[1, latents])?;

    let parts = graph.split(&features, 1, &[POSE, POSE, POSE, KIND.condition_count()])?;
    let velocity = graph.sub(&parts[0], &parts[1])?;
    let velocity_before = graph.sub(&parts[1], &parts[2])?;
    let acceleration = graph.sub(&velocity, &velocity_before)?;
    let window = graph.concat(&[&parts[0], &velocity, &acceleration, &parts[3]], 1)?;
    let origin = vector(&mut graph, "feature_mean", &normaliser.origin)?;
    let gain = vector(&mut graph, "feature_scale", &normaliser.scale)?;
    let window = graph.sub(&window, &origin)?;
    let window = graph.mul(&window, &gain)?;

    let mean = vector(&mut graph, "latent_mean", &scale.mean)?;
    let latent_scale = vector(&mut graph, "latent_scale", &inverse(&scale.deviation))?;
    let step_scale = vector(&mut graph, "step_scale", &inverse(&scale.step_deviation))?;
    let latent = graph.sub(&newest, &mean)?;
    let latent = graph.mul(&latent, &latent_scale)?;
    let step = graph.sub(&newest, &before)?;
    let step = graph.mul(&step, &step_scale)?;

    let (weight, bias) = numbers_of(&regressor.hidden);
    let shape = [input_count(latents), bias.len()];
    let weight = graph.weights("hidden", &shape, &weight, precision)?;
    let bias = vector(&mut graph, "hidden_bias", &bias)?;
    let input = graph.concat(&[&window, &latent, &step], 1)?;
    let hidden = graph.dense(&input, &weight, &bias)?;
    let hidden = graph.relu(&hidden);

    let (weight, bias) = numbers_of(&regressor.output);
    let shape = [weight.len() / latents, latents];
    let weight = graph.weights("output", &shape, &weight, precision)?;
    let bias = vector(&mut graph, "output_bias", &bias)?;
    let deviation = vector(&mut graph, "latent_deviation", &scale.deviation)?;
    let next = graph.dense(&hidden, &weight, &bias)?;
    let next = graph.mul(&next, &deviation)?;
    let next = graph.add(&next, &mean)?;
    graph.output("latent", &next)?;
    graph.output("state_1_out", &next)?;
    graph.output("state_2_out", &newest)?;
    Ok(graph.into_bytes())
}

/// `decoder.onnx`: `latent` [1,L] to `offsets` [1,V,3] in metres. The decoder's two last layers are
/// linear: they are stored as their product, on the coordinates of the offsets, in `precision`.
///
/// # Errors
/// [`TrainError::Onnx`].
pub(super) fn decoder_onnx(
    trained: Trained<'_>,
    precision: Precision,
) -> Result<Vec<u8>, TrainError> {
    let Trained {
        span, scale, head, ..
    } = trained;
    let device = Device::flex();
    let deviation = row(&scale.deviation, &device).transpose();
    let mean = row(&scale.mean, &device);
    let inner = head.inner.clone() / deviation;
    let inner_bias = head.inner_bias.clone() - mean.matmul(inner.clone());
    let numbers = |x: Tensor<2>| x.into_data().iter::<f32>().collect::<Vec<_>>();
    let [latents, width] = inner.dims();
    let coordinates = span.basis.coordinates();
    let field_bias_m = span.offsets_m(&numbers(head.field_bias.clone()));
    // Directions, not fields: the mean goes into the bias only.
    let rows = Span {
        mean_m: vec![0.0; span.width()],
        ..span.clone()
    };
    let field_m = rows.offsets_m(&numbers(head.field.clone()));

    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, latents])?;
    let weight = graph.weights("inner", &[latents, width], &numbers(inner), precision)?;
    let bias = graph.weights(
        "inner_bias",
        &[width],
        &numbers(inner_bias),
        Precision::Single,
    )?;
    let inner = graph.dense(&latent, &weight, &bias)?;
    let inner = graph.tanh(&inner);
    let weight = graph.weights("field", &[width, coordinates], &field_m, precision)?;
    let single = Precision::Single;
    let bias = graph.weights("field_bias", &[coordinates], &field_bias_m, single)?;
    let flat = graph.dense(&inner, &weight, &bias)?;
    let offsets = graph.reshape(&flat, &[1, coordinates / 3, 3])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::autoencoder::Autoencoder;
    use super::super::config::AutoencoderWidths;
    use super::super::data::{ClipFields, Prepared};
    use super::super::fit_regressor::roll_out;
    use super::super::span::tests::sample;
    use super::super::window::{differenced, normalise, normaliser};
    use super::*;
    use dynaskin_evaluate::Player;

    #[test]
    fn the_files_play_what_the_networks_play() {
        let device = Device::flex();
        device.seed(5);
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let offsets = sample(90, 30, 6);
        let span = Span::fit(&offsets, 8, 1).expect("a span");
        let raw: Vec<f32> = (0..90 * KIND.count())
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let changes = differenced(&raw);
        let normaliser = normaliser([changes.as_slice()].into_iter());
        let mut features = changes.clone();
        normalise(&mut features, &normaliser);
        let clip = ClipFields {
            features,
            fields: span.normalised(offsets.transpose().as_slice()),
            frames: 90,
        };
        let data = Prepared {
            weights: vec![1.0; 10],
            training: vec![clip.clone()],
            validation: Vec::new(),
            normaliser,
            span,
        };
        let widths = AutoencoderWidths {
            outer: 12,
            inner: 7,
            latent: 4,
        };
        let autoencoder = Autoencoder::new(widths, &data.span.deviations, &device);
        let (scale, _) = LatentScale::fit(&autoencoder, &data);
        let head = Head::new(&autoencoder, &scale);
        let regressor = Regressor::new(4, 9, &device);
        let trained = Trained {
            span: &data.span,
            normaliser: &data.normaliser,
            scale: &scale,
            regressor: &regressor,
            head: &head,
        };
        let played = roll_out(&regressor, &scale, &[&clip]).remove(0);
        // Through the autoencoder's own layers, not the product of them.
        let latents: Vec<f32> = played
            .chunks_exact(4)
            .flat_map(|n| {
                let k = 0..4;
                k.map(|k| n[k] * scale.deviation[k] + scale.mean[k] + scale.rest[k])
                    .collect::<Vec<f32>>()
            })
            .collect();
        let latents = burn::tensor::TensorData::new(latents, [90, 4]);
        let fields = autoencoder
            .decode(Tensor::from_data(latents, &device))
            .into_data();
        let expected = data
            .span
            .offsets_m(&fields.iter::<f32>().collect::<Vec<_>>());

        let single = Precision::Single;
        let predictor = predictor_onnx(trained, single).expect("a predictor");
        let decoder = decoder_onnx(trained, single).expect("a decoder");
        let mut player = Player::new(KIND, &predictor, &decoder).expect("graphs of the contract");
        let got = player.play(&raw).expect("offsets");
        let largest = expected.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        assert!(largest > 1e-3, "nothing moves: {largest}");
        for (got, expected) in got.iter().zip(&expected) {
            assert!(
                (got - expected).abs() < 1e-5 * largest,
                "{got} {expected} {largest}"
            );
        }
    }
}
