//! Training the predictor on sequences of latents.

use burn::tensor::{Device, Int, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::json;

use super::config::DsnetConfig;
use super::predictor::{DsnetPredictor, Sequences};
use super::stage::{Run, Stage, StageEpoch, Trained};
use dynaskin_train::{Checkpoint, Compute, Course, TrainError, Validation, part};

/// Keeps the root's slope finite where a prediction is exact.
const SMALLEST_SQUARE: f32 = 1e-8;

/// One clip as the network sees it.
#[derive(Clone, Debug)]
pub struct LatentSequence {
    /// Normalised inputs, `[frame][input]` flat.
    pub inputs: Vec<f32>,
    /// Scaled latents, `[frame][latent]` flat.
    pub latents: Vec<f32>,
    /// Basis functions of its shape; empty where the network does not take them.
    pub basis: Vec<f32>,
    /// Number of frames.
    pub frames: usize,
}

/// What the predictor learns from.
#[derive(Clone, Debug)]
pub struct LatentData {
    /// Learned from.
    pub training: Vec<LatentSequence>,
    /// Decides which epoch is kept.
    pub validation: Vec<LatentSequence>,
    /// Scaled latent of no offset: what predicting no motion at all comes to.
    pub rest: Vec<f32>,
}

/// Sequences as tensors, and what the network should say about the rows that count.
struct Batch {
    sequences: Sequences,
    latents: Tensor<2>,
}

/// Sequences padded to `frames`, or to the longest of them where padding does not count.
fn batch(
    picked: &[&LatentSequence],
    widths: (usize, usize),
    frames: usize,
    mask: bool,
    device: &Device,
) -> Batch {
    let lanes = picked.len();
    let longest = picked.iter().map(|s| s.frames.min(frames)).max();
    let frames = if mask { longest.unwrap_or(0) } else { frames };
    let (inputs, latents) = widths;
    let mut input_rows = vec![0.0; frames * lanes * inputs];
    let mut counted = Vec::new();
    let mut targets = Vec::new();
    for frame in 0..frames {
        for (lane, sequence) in picked.iter().enumerate() {
            let row = frame * lanes + lane;
            let inside = frame < sequence.frames;
            if inside {
                let source = &sequence.inputs[frame * inputs..(frame + 1) * inputs];
                input_rows[row * inputs..(row + 1) * inputs].copy_from_slice(source);
                let source = &sequence.latents[frame * latents..(frame + 1) * latents];
                targets.extend_from_slice(source);
                counted.push(row as i32);
            } else if !mask {
                targets.extend(std::iter::repeat_n(0.0, latents));
                counted.push(row as i32);
            }
        }
    }
    let rows = counted.len();
    let functions = picked.first().map_or(0, |s| s.basis.len());
    let basis: Vec<f32> = picked.iter().flat_map(|s| &s.basis).copied().collect();
    let matrix = |numbers: Vec<f32>, shape: [usize; 2]| {
        Tensor::<2>::from_data(TensorData::new(numbers, shape), device)
    };
    Batch {
        sequences: Sequences {
            inputs: matrix(input_rows, [frames * lanes, inputs]),
            lanes,
            basis: (functions > 0).then(|| matrix(basis, [lanes, functions])),
            counted: (rows < frames * lanes)
                .then(|| Tensor::<1, Int>::from_data(TensorData::new(counted, [rows]), device)),
        },
        latents: matrix(targets, [rows, latents]),
    }
}

/// Mean over the rows of the distance in latent space.
fn distance(latents: Tensor<2>, targets: Tensor<2>) -> Tensor<1> {
    let square = (latents - targets).powi_scalar(2).sum_dim(1);
    (square + SMALLEST_SQUARE).sqrt().mean()
}

/// Trains a predictor on so many `inputs` a frame, keeps its state in `checkpoint` and gives the weights of
/// the epoch that did best on the validation clips: the distance in latent space, averaged over the frames of each batch (the paper
/// sums them, which for Adam is the same but for the padding).
///
/// # Errors
/// [`TrainError::Diverged`], [`TrainError::Checkpoint`], [`TrainError::Io`].
pub fn train_predictor(
    (data, inputs): (&LatentData, usize),
    config: &DsnetConfig,
    compute: Compute,
    (checkpoint, resume): (&Checkpoint, bool),
    progress: &mut dyn FnMut(&StageEpoch),
) -> Result<Trained<DsnetPredictor>, TrainError> {
    let run = Run {
        stage: Stage::Predictor,
        checkpoint,
        // When the run ends may differ.
        settings: json!({
            "config": DsnetConfig { epochs: 0, patience_epochs: 0, ..config.clone() }
        }),
        epochs: config.epochs,
        patience_epochs: config.patience_epochs,
        learning_rate: config.learning_rate,
        resume,
    };
    let device = compute.device()?.autodiff();
    device.seed(config.seed);
    let widths = (inputs, config.autoencoder.latents);
    let functions = data.training.first().map(|s| s.basis.len());
    let model = DsnetPredictor::new(config, inputs, functions.filter(|n| *n > 0), &device);
    let course = SequenceCourse {
        data,
        config,
        widths,
        device,
        order: Vec::new(),
    };
    run.train(model, course, progress)
}

/// The training sequences in random order.
struct SequenceCourse<'a> {
    data: &'a LatentData,
    config: &'a DsnetConfig,
    /// Inputs and latents of a frame.
    widths: (usize, usize),
    device: Device,
    /// Sequences of the epoch.
    order: Vec<&'a LatentSequence>,
}

impl Course<DsnetPredictor> for SequenceCourse<'_> {
    fn begin(&mut self, epoch: usize) -> usize {
        let config = self.config;
        self.order = self.data.training.iter().collect();
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed.wrapping_mul(1_000_003) + epoch as u64);
        self.order.shuffle(&mut rng as &mut dyn Rng);
        self.order.len().div_ceil(config.batch)
    }

    fn loss(&mut self, model: &DsnetPredictor, step: usize) -> (Tensor<1>, f64) {
        let config = self.config;
        let picked = part(&self.order, step, config.batch);
        let batch = batch(
            picked,
            self.widths,
            config.frames,
            config.mask,
            &self.device,
        );
        let loss = distance(model.forward(&batch.sequences), batch.latents);
        (loss, 1.0)
    }

    fn validate(&self, model: &DsnetPredictor) -> Validation {
        validate(model, self.data, self.widths, self.config)
    }
}

/// Mean distance in latent space over the frames of the validation clips, never their padding, beside
/// that of predicting no offset.
fn validate(
    model: &DsnetPredictor,
    data: &LatentData,
    widths: (usize, usize),
    config: &DsnetConfig,
) -> Validation {
    let device = model.from_hidden.val().device();
    let rest = TensorData::new(data.rest.clone(), [1, data.rest.len()]);
    let rest = Tensor::<2>::from_data(rest, &device);
    let (mut error, mut still, mut frames) = (0.0f64, 0.0f64, 0.0f64);
    let sequences: Vec<&LatentSequence> = data.validation.iter().collect();
    for picked in sequences.chunks(config.batch) {
        let batch = batch(picked, widths, config.frames, true, &device);
        let [rows, _] = batch.latents.dims();
        let mean = |latents: Tensor<2>| {
            f64::from(distance(latents, batch.latents.clone()).into_scalar::<f32>())
        };
        error += rows as f64 * mean(model.forward(&batch.sequences));
        still += rows as f64 * mean(rest.clone().repeat_dim(0, rows));
        frames += rows as f64;
    }
    Validation {
        loss: (error / frames.max(1.0)) as f32,
        ratio: (error / still.max(f64::MIN_POSITIVE)) as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(frames: usize, first: f32) -> LatentSequence {
        LatentSequence {
            inputs: (0..2 * frames).map(|i| first + i as f32).collect(),
            latents: (0..frames).map(|i| first - i as f32).collect(),
            basis: Vec::new(),
            frames,
        }
    }

    fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
        tensor.into_data().iter::<f32>().collect()
    }

    #[test]
    fn the_mask_leaves_padding_out_and_tails_are_clipped() {
        let (short, long) = (sequence(1, 10.0), sequence(4, 20.0));
        let device = Device::flex();
        let masked = batch(&[&short, &long], (2, 1), 3, true, &device);
        // Frames 0 of both, then 1 and 2 of the long one, whose fourth frame is clipped.
        assert_eq!(numbers(masked.latents), [10.0, 20.0, 19.0, 18.0]);
        let rows = masked.sequences.counted.expect("rows that count");
        let rows: Vec<i32> = rows.into_data().iter::<i32>().collect();
        assert_eq!(rows, [0, 1, 3, 5]);
        let inputs = numbers(masked.sequences.inputs);
        assert_eq!(
            inputs,
            [10., 11., 20., 21., 0., 0., 22., 23., 0., 0., 24., 25.]
        );

        let counted = batch(&[&short], (2, 1), 3, false, &device);
        assert!(counted.sequences.counted.is_none());
        assert_eq!(numbers(counted.latents), [10.0, 0.0, 0.0]);
    }
}
