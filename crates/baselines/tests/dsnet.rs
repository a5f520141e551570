//! DSNet on small made-up data: it learns, its files give its own numbers, and the first state is set
//! once.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use dynaskin_baselines::dsnet::{
    Autoencoder, AutoencoderSizes, Compressor, DsnetConfig, DsnetPredictor, OffsetFrames,
    PredictorParts, RadialBasis, Sequences, ShapeInput, StageEpoch, decoder_onnx, predictor_onnx,
    train_autoencoder, train_predictor,
};
use dynaskin_baselines::dsnet::{LatentData, LatentSequence};
use dynaskin_body::SHAPE_COUNT;
use dynaskin_evaluate::Player;
use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::{Checkpoint, Compute, Normaliser, Precision};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const VERTICES: usize = 37;
const KIND: FeatureKind = FeatureKind::PoseShape;

fn config() -> DsnetConfig {
    DsnetConfig {
        autoencoder: AutoencoderSizes {
            channels: [6, 8],
            kernel: 5,
            strides: [2, 2, 1, 2],
            latents: 5,
        },
        autoencoder_epochs: 30,
        autoencoder_batch: 16,
        autoencoder_learning_rate: 5e-3,
        linear: 8,
        tanh: 12,
        hidden: 9,
        frames: 40,
        batch: 8,
        epochs: 40,
        learning_rate: 1e-2,
        ..DsnetConfig::default()
    }
}

/// Fields that swing in two ways, smooth along the vertices.
fn fields(frames: usize, seed: u64) -> Vec<f32> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut offsets_m = Vec::new();
    for _ in 0..frames {
        let (a, b): (f32, f32) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        for vertex in 0..VERTICES {
            let place = vertex as f32 / VERTICES as f32;
            offsets_m.extend([a * place, b * (3.0 * place).sin(), a * b * place].map(|x| 0.02 * x));
        }
    }
    offsets_m
}

fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

#[test]
fn the_autoencoder_learns_a_curved_family_of_fields_and_can_be_resumed() {
    let frames = OffsetFrames {
        training: fields(256, 1),
        validation: fields(64, 2),
        vertices: VERTICES,
    };
    let dir = tempfile::tempdir().expect("a folder");
    let train = |folder: &Path, config: &DsnetConfig, resume: bool| {
        let mut ratios = Vec::new();
        let progress = &mut |epoch: &StageEpoch| ratios.push(epoch.record.validation_ratio);
        let checkpoint = Checkpoint::new(folder).expect("a checkpoint");
        let state = (&checkpoint, resume);
        train_autoencoder(&frames, config, Compute::Cpu, state, progress)
            .expect("training succeeds");
        ratios
    };
    let ratios = train(&dir.path().join("whole"), &config(), false);
    let best = ratios.iter().copied().fold(f32::INFINITY, f32::min);
    assert!(best < 0.25, "{ratios:?}");

    // The same numbers again, and after a stop.
    let again = train(&dir.path().join("again"), &config(), false);
    assert_eq!(ratios, again);
    let resumed = train(&dir.path().join("again"), &config(), true);
    assert!(resumed.is_empty());
    let other = DsnetConfig {
        seed: 2,
        ..config()
    };
    let nothing = &mut |_: &StageEpoch| {};
    let checkpoint = Checkpoint::new(&dir.path().join("again")).expect("a checkpoint");
    let error = train_autoencoder(&frames, &other, Compute::Cpu, (&checkpoint, true), nothing);
    assert!(error.is_err());
}

/// Latents that follow the input with a lag, about an amplitude that the shape sets.
fn sequences(count: usize, seed: u64, functions: Option<&RadialBasis>) -> Vec<LatentSequence> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let latent_count = config().autoencoder.latents;
    (0..count)
        .map(|index| {
            let frames = 20 + index % 30;
            let size = [0.5f32, 1.5][index % 2];
            let (mut inputs, mut latents) = (Vec::new(), Vec::new());
            let (mut push, mut lag) = (0.0f32, 0.0f32);
            for _ in 0..frames {
                push = 0.8 * push + rng.random_range(-0.6..0.6);
                lag = 0.7 * lag + 0.3 * push;
                inputs.push(push);
                if functions.is_none() {
                    inputs.push(size - 1.0);
                }
                latents.extend((0..latent_count).map(|k| size * lag * (1.0 + 0.2 * k as f32)));
            }
            let mut shape = [0.0; SHAPE_COUNT];
            shape[0] = size;
            LatentSequence {
                inputs,
                latents,
                basis: functions.map_or(Vec::new(), |basis| basis.values(&shape)),
                frames,
            }
        })
        .collect()
}

#[test]
fn both_variants_learn_a_lag_whose_size_the_shape_sets() {
    let mut shapes = [[0.0; SHAPE_COUNT]; 2];
    (shapes[0][0], shapes[1][0]) = (0.5, 1.5);
    let basis = RadialBasis::of_shapes(shapes.into_iter());
    // Without the size the best guess is the mean size, which is off by half. The first state has to
    // be remembered over the whole sequence.
    for (functions, inputs, most) in [(None, 2, 0.3), (Some(&basis), 1, 0.42)] {
        let data = LatentData {
            training: sequences(48, 3, functions),
            validation: sequences(12, 4, functions),
            rest: vec![0.0; config().autoencoder.latents],
        };
        let dir = tempfile::tempdir().expect("a folder");
        let mut ratios = Vec::new();
        let progress = &mut |epoch: &StageEpoch| ratios.push(epoch.record.validation_ratio);
        train_predictor(
            (&data, inputs),
            &config(),
            Compute::Cpu,
            (&Checkpoint::new(dir.path()).expect("a checkpoint"), false),
            progress,
        )
        .expect("training succeeds");
        let best = ratios.iter().copied().fold(f32::INFINITY, f32::min);
        assert!(best < most, "{inputs} inputs: {ratios:?}");
    }
}

fn normaliser() -> Normaliser {
    let count = KIND.count();
    Normaliser {
        origin: (0..count).map(|i| (i as f32).sin()).collect(),
        scale: (0..count).map(|i| 1.0 + 0.01 * i as f32).collect(),
        motion: KIND.motion_count(),
    }
}

/// Ten frames of features of one body.
fn features() -> Vec<f32> {
    let (count, poses) = (KIND.count(), KIND.motion_count());
    let number = |frame: usize, i: usize| {
        let frame = if i < poses { frame } else { 0 };
        (1.3 * frame as f32 + 0.7 * i as f32).sin()
    };
    (0..10 * count)
        .map(|i| number(i / count, i % count))
        .collect()
}

/// The network's own answer to [`features`], in the autoencoder's latents.
fn own_latents(
    model: &DsnetPredictor,
    config: &DsnetConfig,
    basis: &RadialBasis,
    unit: f32,
) -> Vec<f32> {
    let (poses, shapes) = normaliser().apply(&features());
    let (pose, shape) = (KIND.motion_count(), SHAPE_COUNT);
    let inputs: Vec<f32> = match config.shape_input {
        ShapeInput::FirstState => poses,
        ShapeInput::EveryStep => poses
            .chunks_exact(pose)
            .zip(shapes.chunks_exact(shape))
            .flat_map(|(pose, shape)| [pose, shape].concat())
            .collect(),
    };
    let width = inputs.len() / 10;
    let device = Device::flex();
    let values = basis.values(&shapes[..shape]);
    let functions = values.len();
    let sequences = Sequences {
        inputs: Tensor::from_data(TensorData::new(inputs, [10, width]), &device),
        lanes: 1,
        basis: model
            .first_state
            .is_some()
            .then(|| Tensor::from_data(TensorData::new(values, [1, functions]), &device)),
        counted: None,
    };
    numbers(model.forward(&sequences) * unit)
}

#[test]
fn the_exported_predictors_give_the_networks_own_numbers() {
    let mut shapes = [[0.0; SHAPE_COUNT]; 3];
    (shapes[1][2], shapes[2][7]) = (2.5, -2.0);
    let basis = RadialBasis::of_shapes(shapes.into_iter());
    let compressor = compressor(3);
    let decoder = decoder_onnx(&compressor, Precision::Single).expect("a decoder");
    for shape_input in [ShapeInput::EveryStep, ShapeInput::FirstState] {
        let config = DsnetConfig {
            shape_input,
            ..config()
        };
        let (inputs, functions) = match shape_input {
            ShapeInput::EveryStep => (KIND.count(), None),
            ShapeInput::FirstState => (KIND.motion_count(), Some(3)),
        };
        // A training step moves the statistics of the batch normalisation away from 0 and 1.
        let device = Device::flex().autodiff();
        device.seed(7);
        let model = DsnetPredictor::new(&config, inputs, functions, &device);
        let _ = model.forward(&Sequences {
            inputs: Tensor::ones([6, inputs], &device) * 0.5,
            lanes: 2,
            basis: functions.map(|n| Tensor::ones([2, n], &device)),
            counted: None,
        });
        let model = burn::module::Module::valid(&model);
        let onnx_bytes = predictor_onnx(&PredictorParts {
            model: &model,
            normaliser: &normaliser(),
            shape_input,
            basis: functions.map(|_| &basis),
            latent_unit: 3.0,
        })
        .expect("a predictor");
        let expected = compressor.decode(&own_latents(&model, &config, &basis, 3.0));
        let mut player = Player::new(KIND, &onnx_bytes, &decoder).expect("the runtime takes it");
        let got = player.play(&features()).expect("offsets");
        let size = expected.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        assert_eq!(got.len(), expected.len());
        for (got, expected) in got.iter().zip(&expected) {
            assert!(
                (got - expected).abs() < 1e-5 * size,
                "{shape_input:?}: {got} {expected}"
            );
        }
        // Played again from zeros it starts again.
        assert_eq!(player.play(&features()).expect("offsets"), got);
    }
}

fn compressor(seed: u64) -> Compressor {
    let sizes = config().autoencoder;
    let device = Device::flex();
    device.seed(seed);
    Compressor {
        model: Autoencoder::new(&sizes, VERTICES, &device),
        sizes,
        vertices: VERTICES,
        largest_m: 0.03,
    }
}

#[test]
fn what_is_encoded_in_chunks_is_what_is_encoded_alone() {
    let compressor = compressor(5);
    let offsets_m = fields(70, 9);
    let together = compressor.encode(&offsets_m);
    let last = compressor.encode(&offsets_m[69 * 3 * VERTICES..]);
    for (a, b) in together[69 * 5..].iter().zip(&last) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    assert_eq!(compressor.decode(&together).len(), offsets_m.len());
}
