//! DSNet: dynamic skin deformation prediction by a recurrent neural network (Seo, Zou, Cordier 2021).
//!
//! First the mesh autoencoder is trained on frames of offsets, then the predictor on sequences of its
//! latents. What is held out, the features and the evaluation are the project's; sizes and training are
//! the paper's as far as it gives them (`config`), and comments say what was chosen where it does not.

mod autoencoder;
mod compress;
mod config;
mod export;
mod learn;
mod predictor;
mod stage;

use std::path::Path;

use dynaskin_body::SHAPE_COUNT;
use dynaskin_onnx::Precision;
use dynaskin_runtime::features::FeatureKind;
use serde_json::json;

pub use autoencoder::{Autoencoder, decoder_parameter_count, parameter_count};
pub use compress::{Compressor, OffsetFrames, train_autoencoder};
pub use config::{AutoencoderSizes, DsnetConfig, ShapeInput};
pub use export::{PredictorParts, decoder_onnx, predictor_onnx};
pub use learn::{LatentData, LatentSequence, train_predictor};
pub use predictor::{DsnetPredictor, RadialBasis, Sequences};
pub use stage::{Stage, StageEpoch, Trained};

use dynaskin_train::{
    Checkpoint, DataSet, Networks, Normaliser, Set, Tissue, TrainError, TrainingInput, features_of,
    motion_of,
};

/// What the predictor takes as input.
const KIND: FeatureKind = FeatureKind::PoseShape;

/// What is told while training.
#[derive(Clone, Debug)]
pub enum Progress<'a> {
    /// Clips read so far, and in all.
    Reading(usize, usize),
    /// An epoch is done.
    Epoch(&'a StageEpoch),
}

/// Trains both networks. The state of the autoencoder's training is kept in
/// `checkpoint/autoencoder`, which both variants share, and that of the predictor in
/// `checkpoint/predictor-...`; with `resume` both go on where they stopped. Also gives the seconds of
/// training.
///
/// # Errors
/// [`TrainError::EmptySplit`], [`TrainError::Config`], [`TrainError::Diverged`],
/// [`TrainError::Checkpoint`], [`TrainError::NotFinite`] and whatever reading a clip can give.
pub fn train_dsnet(
    input: &TrainingInput<'_>,
    config: &DsnetConfig,
    checkpoint: &Path,
    resume: bool,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<(Networks, f64), TrainError> {
    config.check()?;
    let data_set = input.data_set;
    for set in [Set::Training, Set::Validation] {
        if data_set.of_set(set, Tissue::Usual).next().is_none() {
            return Err(TrainError::EmptySplit {
                set: set.name(),
                clips: data_set.clips.len(),
            });
        }
    }
    let frames = OffsetFrames::draw(data_set, config, &mut |done, all| {
        progress(Progress::Reading(done, all));
    })?;
    let keep = |network: &str| {
        let checkpoint = Checkpoint::new(&checkpoint.join(network))?;
        Ok::<_, TrainError>(checkpoint.for_data(data_set.fingerprint()))
    };
    let state = keep("autoencoder")?;
    let tell = &mut |epoch: &StageEpoch| progress(Progress::Epoch(epoch));
    let autoencoder = train_autoencoder(&frames, config, input.compute, (&state, resume), tell)?;
    drop(frames);
    let compressor = &autoencoder.model;

    let encoded = encode(input, config, compressor, progress)?;
    let (name, inputs) = match config.shape_input {
        ShapeInput::EveryStep => ("predictor-every-step", KIND.count()),
        ShapeInput::FirstState => ("predictor-first-state", KIND.motion_count()),
    };
    let state = keep(name)?;
    let tell = &mut |epoch: &StageEpoch| progress(Progress::Epoch(epoch));
    let predictor = train_predictor(
        (&encoded.data, inputs),
        config,
        input.compute,
        (&state, resume),
        tell,
    )?;
    let seconds = autoencoder.seconds + predictor.seconds;
    let networks = networks(config, compressor, &encoded, &predictor)?;
    Ok((networks, seconds))
}

/// Clips in the autoencoder's latents, and what scaled them.
struct Encoded {
    data: LatentData,
    normaliser: Normaliser,
    latent_unit: f32,
    basis: Option<RadialBasis>,
}

fn networks(
    config: &DsnetConfig,
    compressor: &Compressor,
    encoded: &Encoded,
    predictor: &Trained<DsnetPredictor>,
) -> Result<Networks, TrainError> {
    let decoder_weights = decoder_parameter_count(&config.autoencoder, compressor.vertices);
    let predictor_weights = predictor.model.weight_count();
    Ok(Networks {
        feature_kind: KIND,
        predictor_onnx: predictor_onnx(&PredictorParts {
            model: &predictor.model,
            normaliser: &encoded.normaliser,
            shape_input: config.shape_input,
            basis: encoded.basis.as_ref(),
            latent_unit: encoded.latent_unit,
        })?,
        decoder_onnx: decoder_onnx(compressor, Precision::Half)?,
        latent_count: config.autoencoder.latents,
        parameters: decoder_weights + predictor_weights,
        description: config.description(decoder_weights, predictor_weights),
        config: json!(config),
        best_epoch: predictor.best_epoch,
    })
}

/// A clip before scaling.
struct RawSequence {
    features: Vec<f32>,
    latents: Vec<f32>,
    set: Set,
}

/// Reads, clips and encodes the training and validation clips.
fn encode(
    input: &TrainingInput<'_>,
    config: &DsnetConfig,
    compressor: &Compressor,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Encoded, TrainError> {
    let data_set: &DataSet = input.data_set;
    let clips = |set| data_set.of_set(set, Tissue::Usual);
    let all = clips(Set::Training).count() + clips(Set::Validation).count();
    let mut raw = Vec::new();
    for set in [Set::Training, Set::Validation] {
        for entry in clips(set) {
            let clip = data_set.read(entry)?;
            let frames = clip.frame_count().min(config.frames);
            let offsets = (0..frames).flat_map(|frame| clip.frame_offsets_rest_m(frame));
            let offsets_m: Vec<f32> = offsets.map(|x| x.to_f32()).collect();
            let mut features = features_of(KIND, input.body, &motion_of(&clip), &clip)?;
            features.truncate(frames * KIND.count());
            raw.push(RawSequence {
                features,
                latents: compressor.encode(&offsets_m),
                set,
            });
            progress(Progress::Reading(raw.len(), all));
        }
    }
    let training = || raw.iter().filter(|sequence| sequence.set == Set::Training);
    let normaliser = Normaliser::fit(
        KIND,
        &input.body.shaped(&[0.0; SHAPE_COUNT]),
        training().map(|sequence| sequence.features.as_slice()),
    );
    // One unit for all latents: how they compare with each other is the autoencoder's business.
    let numbers = || training().flat_map(|sequence| &sequence.latents);
    let squares: f64 = numbers().map(|x| f64::from(*x).powi(2)).sum();
    let square = squares * config.autoencoder.latents as f64 / numbers().count().max(1) as f64;
    let latent_unit = (square.sqrt() as f32).max(f32::MIN_POSITIVE);

    let scaled: Vec<(LatentSequence, Vec<f32>, Set)> = raw
        .iter()
        .map(|sequence| scale(sequence, &normaliser, config, latent_unit))
        .collect();
    let basis = (config.shape_input == ShapeInput::FirstState).then(|| {
        let of_training = scaled.iter().filter(|(_, _, set)| *set == Set::Training);
        RadialBasis::of_shapes(of_training.filter_map(|(_, shape, _)| shape[..].try_into().ok()))
    });
    let rest = compressor.encode(&vec![0.0; 3 * compressor.vertices]);
    let mut data = LatentData {
        training: Vec::new(),
        validation: Vec::new(),
        rest: rest.iter().map(|x| x / latent_unit).collect(),
    };
    for (mut sequence, shape, set) in scaled {
        if let Some(basis) = &basis {
            sequence.basis = basis.values(&shape);
        }
        if set == Set::Training {
            data.training.push(sequence);
        } else {
            data.validation.push(sequence);
        }
    }
    Ok(Encoded {
        data,
        normaliser,
        latent_unit,
        basis,
    })
}

/// A sequence as the network sees it, its normalised shape, and its set.
fn scale(
    raw: &RawSequence,
    normaliser: &Normaliser,
    config: &DsnetConfig,
    latent_unit: f32,
) -> (LatentSequence, Vec<f32>, Set) {
    let (poses, shapes) = normaliser.apply(&raw.features);
    let shape = shapes[..SHAPE_COUNT.min(shapes.len())].to_vec();
    let inputs = match config.shape_input {
        ShapeInput::FirstState => poses,
        ShapeInput::EveryStep => {
            let frames = poses.chunks_exact(KIND.motion_count());
            let frames = frames.zip(shapes.chunks_exact(SHAPE_COUNT));
            frames
                .flat_map(|(pose, shape)| [pose, shape].concat())
                .collect()
        }
    };
    let sequence = LatentSequence {
        inputs,
        latents: raw.latents.iter().map(|x| x / latent_unit).collect(),
        basis: Vec::new(),
        frames: raw.features.len() / KIND.count(),
    };
    (sequence, shape, raw.set)
}
