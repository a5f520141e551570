//! Training of the autoencoder.

use burn::module::Module;
use burn::optim::AdamConfig;
use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::autoencoder::Autoencoder;
use super::config::AutoencoderConfig;
use super::data::{ClipFields, Prepared};
use super::span::Span;
use dynaskin_train::{
    Checkpoint, Compute, Course, EpochRecord, EpochRun, Schedule, TrainError, Validation, part,
};

/// Frames encoded at a time where no gradient is needed.
pub(super) const BLOCK_FRAMES: usize = 2048;

/// Trains an autoencoder on the squared distance of fields, and gives the weights of the epoch that
/// did best on the validation clips.
///
/// # Errors
/// [`TrainError::Diverged`], [`TrainError::Checkpoint`], [`TrainError::Io`].
pub(super) fn fit_autoencoder(
    data: &Prepared,
    config: &AutoencoderConfig,
    compute: Compute,
    (checkpoint, resume): (&Checkpoint, bool),
    mut progress: impl FnMut(&EpochRecord),
) -> Result<(Autoencoder, EpochRecord), TrainError> {
    let device = compute.device()?.autodiff();
    device.seed(config.seed);
    let model = Autoencoder::new(config.widths, &data.span.deviations, &device);
    let run = EpochRun {
        checkpoint,
        config,
        epochs: config.epochs,
        patience_epochs: config.patience_epochs,
        learning_rate: config.learning_rate,
        schedule: Schedule::WarmUp,
        resume,
    };
    let course = AutoencoderCourse {
        data,
        config,
        device: &device,
        order: Vec::new(),
    };
    let best = run.run(model, AdamConfig::new().init(), course, &mut progress)?;
    let plain = Device::flex();
    let model = Autoencoder::new(config.widths, &data.span.deviations, &plain);
    Ok((checkpoint.load_best(model)?, best))
}

/// Frames of the training clips in random order; losses in millimetres.
struct AutoencoderCourse<'a> {
    data: &'a Prepared,
    config: &'a AutoencoderConfig,
    device: &'a Device,
    /// Clip and frame, those of the epoch.
    order: Vec<(usize, usize)>,
}

impl Course<Autoencoder> for AutoencoderCourse<'_> {
    fn begin(&mut self, epoch: usize) -> usize {
        let clips = self.data.training.iter().enumerate();
        self.order = clips
            .flat_map(|(index, clip)| (0..clip.frames).map(move |frame| (index, frame)))
            .collect();
        let seed = self.config.seed.wrapping_mul(1_000_003) + epoch as u64;
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        self.order.shuffle(&mut rng as &mut dyn Rng);
        self.order.truncate(self.config.frames);
        self.order.len().div_ceil(self.config.batch)
    }

    fn loss(&mut self, model: &Autoencoder, step: usize) -> (Tensor<1>, f64) {
        let width = self.data.span.width();
        let frames = part(&self.order, step, self.config.batch);
        let mut numbers = Vec::with_capacity(frames.len() * width);
        for (clip, frame) in frames {
            let fields = &self.data.training[*clip].fields;
            numbers.extend_from_slice(&fields[frame * width..(frame + 1) * width]);
        }
        let fields = TensorData::new(numbers, [frames.len(), width]);
        let fields = Tensor::<2>::from_data(fields, self.device);
        let error = model.decode(model.encode(fields.clone())) - fields;
        (error.powi_scalar(2).mean(), frames.len() as f64)
    }

    fn in_unit(&self, mean: f64) -> f32 {
        let span = &self.data.span;
        ((mean * span.width() as f64).sqrt() * unit_mm(span)) as f32
    }

    fn validate(&self, model: &Autoencoder) -> Validation {
        let span = &self.data.span;
        let mut sums = Distances::new(span);
        for clip in &self.data.validation {
            let latents = encode(model, clip, span.width());
            for (latents, truth) in latents
                .chunks(BLOCK_FRAMES * latent_count(model))
                .zip(clip.fields.chunks(BLOCK_FRAMES * span.width()))
            {
                let shape = [latents.len() / latent_count(model), latent_count(model)];
                let latents = TensorData::new(latents.to_vec(), shape);
                let fields = model.decode(Tensor::from_data(latents, &home(model)));
                let fields: Vec<f32> = fields.into_data().iter::<f32>().collect();
                sums.add(&fields, truth);
            }
        }
        sums.validation()
    }
}

/// Millimetres of root-mean-square vertex distance that a distance of 1 between fields is.
pub(super) fn unit_mm(span: &Span) -> f64 {
    let vertices = span.basis.coordinates() as f64 / 3.0;
    1000.0 * f64::from(span.deviation_m) / vertices.sqrt()
}

/// The device that the network lives on.
fn home(model: &Autoencoder) -> Device {
    model.encoder_latent.weight.val().device()
}

fn latent_count(model: &Autoencoder) -> usize {
    model.encoder_latent.weight.val().dims()[1]
}

/// Latents of a clip, `[frame][latent]` flat.
pub(super) fn encode(model: &Autoencoder, clip: &ClipFields, width: usize) -> Vec<f32> {
    let model = model.valid();
    let mut latents = Vec::with_capacity(clip.frames * latent_count(&model));
    for fields in clip.fields.chunks(BLOCK_FRAMES * width) {
        let shape = [fields.len() / width, width];
        let fields = Tensor::from_data(TensorData::new(fields.to_vec(), shape), &home(&model));
        latents.extend(model.encode(fields).into_data().iter::<f32>());
    }
    latents
}

/// Root-mean-square vertex distances of frames, summed.
pub(super) struct Distances {
    zero: Vec<f32>,
    unit_mm: f64,
    error: f64,
    still: f64,
    frames: usize,
}

/// An error that left the numbers counts as a hundred metres.
const LOST_MM: f64 = 1e5;

impl Distances {
    /// For fields in the coordinates of `span`.
    pub fn new(span: &Span) -> Self {
        Self {
            zero: span.zero(),
            unit_mm: unit_mm(span),
            error: 0.0,
            still: 0.0,
            frames: 0,
        }
    }

    /// Adds frames, `[frame][span]` flat.
    pub fn add(&mut self, fields: &[f32], truth: &[f32]) {
        let width = self.zero.len();
        for (field, truth) in fields.chunks_exact(width).zip(truth.chunks_exact(width)) {
            let error = self.unit_mm * distance(field, truth);
            self.error += if error.is_finite() {
                error.min(LOST_MM)
            } else {
                LOST_MM
            };
            self.still += self.unit_mm * distance(&self.zero, truth);
            self.frames += 1;
        }
    }

    /// Means over frames.
    pub fn validation(&self) -> Validation {
        Validation {
            loss: (self.error / self.frames.max(1) as f64) as f32,
            ratio: (self.error / self.still.max(f64::MIN_POSITIVE)) as f32,
        }
    }
}

fn distance(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>().sqrt()
}
