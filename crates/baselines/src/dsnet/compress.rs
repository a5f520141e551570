//! Training the autoencoder, and encoding clips with it.

use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::json;

use super::autoencoder::Autoencoder;
use super::config::{AutoencoderSizes, DsnetConfig};
use super::stage::{Run, Stage, StageEpoch, Trained};
use dynaskin_train::{
    Checkpoint, ClipEntry, Compute, Course, DataSet, Set, Tissue, TrainError, Validation, part,
};

/// Frames that are encoded or decoded at once outside training.
const CHUNK: usize = 64;
/// A validation frame for so many training frames.
const VALIDATION_SHARE: usize = 5;

/// Frames of offsets in metres, `[frame][vertex][xyz]` flat.
#[derive(Debug)]
pub struct OffsetFrames {
    /// Learned from.
    pub training: Vec<f32>,
    /// Decide which epoch is kept.
    pub validation: Vec<f32>,
    /// Vertices of a frame.
    pub vertices: usize,
}

impl OffsetFrames {
    /// Draws frames of the usual tissue evenly from the training and the validation clips.
    ///
    /// # Errors
    /// What reading a clip can give; [`TrainError::NotFinite`].
    pub fn draw(
        data_set: &DataSet,
        config: &DsnetConfig,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Self, TrainError> {
        let clips = |set| data_set.of_set(set, Tissue::Usual);
        let all = clips(Set::Training).count() + clips(Set::Validation).count();
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
        let mut done = 0;
        let mut draw = |set, wanted: usize| -> Result<Vec<f32>, TrainError> {
            let entries: Vec<&ClipEntry> = clips(set).collect();
            let frames: usize = entries.iter().map(|clip| clip.frames).sum();
            let share = wanted as f64 / frames.max(1) as f64;
            let mut drawn = Vec::new();
            for entry in entries {
                let clip = data_set.read(entry)?;
                for frame in 0..clip.frame_count() {
                    if rng.random::<f64>() < share {
                        let offsets = clip.frame_offsets_rest_m(frame);
                        drawn.extend(offsets.iter().map(|x| x.to_f32()));
                    }
                }
                if !drawn.iter().map(|x| x * 0.0).sum::<f32>().is_finite() {
                    return Err(TrainError::NotFinite {
                        place: entry.path.display().to_string(),
                    });
                }
                done += 1;
                progress(done, all);
            }
            Ok(drawn)
        };
        Ok(Self {
            training: draw(Set::Training, config.autoencoder_frames)?,
            validation: draw(
                Set::Validation,
                config.autoencoder_frames.div_ceil(VALIDATION_SHARE),
            )?,
            vertices: data_set.vertices.len(),
        })
    }

    /// What scales the offsets to -1..1: the largest coordinate of the training frames, in metres.
    fn largest_m(&self) -> f32 {
        self.training
            .iter()
            .fold(f32::MIN_POSITIVE, |most, x| most.max(x.abs()))
    }
}

/// A trained autoencoder with its scale.
#[derive(Debug)]
pub struct Compressor {
    /// The network.
    pub model: Autoencoder,
    /// Its sizes.
    pub sizes: AutoencoderSizes,
    /// Vertices of a field.
    pub vertices: usize,
    /// Metres that are 1 for the network.
    pub largest_m: f32,
}

impl Compressor {
    /// Latents of offsets in metres, `[frame][latent]` flat.
    pub fn encode(&self, offsets_m: &[f32]) -> Vec<f32> {
        let device = self.model.encode.weights.val().device();
        let mut latents = Vec::new();
        for chunk in offsets_m.chunks(CHUNK * 3 * self.vertices) {
            let field = fields(chunk, self.vertices, self.largest_m, &device);
            latents.extend(
                self.model
                    .encode(&self.sizes, field)
                    .into_data()
                    .iter::<f32>(),
            );
        }
        latents
    }

    /// Offsets in metres of latents.
    pub fn decode(&self, latents: &[f32]) -> Vec<f32> {
        let device = self.model.encode.weights.val().device();
        let count = self.sizes.latents;
        let mut offsets_m = Vec::new();
        for chunk in latents.chunks(CHUNK * count) {
            let data = TensorData::new(chunk.to_vec(), [chunk.len() / count, count]);
            let latents = Tensor::from_data(data, &device);
            let field = self.model.decode(&self.sizes, latents, self.vertices);
            offsets_m.extend((field * self.largest_m).into_data().iter::<f32>());
        }
        offsets_m
    }

    /// Mean distance of vertices and what is left of them, and their mean length, in millimetres.
    fn errors_mm(&self, offsets_m: &[f32]) -> (f32, f32) {
        let decoded = self.decode(&self.encode(offsets_m));
        let (mut error, mut size) = (0.0f64, 0.0f64);
        for (a, b) in offsets_m.chunks_exact(3).zip(decoded.chunks_exact(3)) {
            let square: f32 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            error += f64::from(square.sqrt());
            size += f64::from(a.iter().map(|a| a * a).sum::<f32>().sqrt());
        }
        let vertices = (offsets_m.len() / 3).max(1) as f64;
        (
            (1000.0 * error / vertices) as f32,
            (1000.0 * size / vertices) as f32,
        )
    }
}

/// `[frames, vertices, 3]`, divided by `unit_m`.
fn fields(offsets_m: &[f32], vertices: usize, unit_m: f32, device: &Device) -> Tensor<3> {
    let frames = offsets_m.len() / (3 * vertices);
    let scaled: Vec<f32> = offsets_m.iter().map(|x| x / unit_m).collect();
    Tensor::from_data(TensorData::new(scaled, [frames, vertices, 3]), device)
}

/// Trains an autoencoder on `frames`, keeps its state in `checkpoint` and gives the weights of the epoch
/// that did best on the validation frames: mean squared error of the scaled coordinates (the paper does not
/// name its loss), divided by that of no offset so that 1 means nothing learned.
///
/// # Errors
/// [`TrainError::Diverged`], [`TrainError::Checkpoint`], [`TrainError::Io`].
pub fn train_autoencoder(
    frames: &OffsetFrames,
    config: &DsnetConfig,
    compute: Compute,
    (checkpoint, resume): (&Checkpoint, bool),
    progress: &mut dyn FnMut(&StageEpoch),
) -> Result<Trained<Compressor>, TrainError> {
    let run = Run {
        stage: Stage::Autoencoder,
        checkpoint,
        settings: json!({
            "seed": config.seed,
            "sizes": config.autoencoder,
            "frames": config.autoencoder_frames,
            "batch": config.autoencoder_batch,
            "learning_rate": config.autoencoder_learning_rate,
            "vertices": frames.vertices,
        }),
        epochs: config.autoencoder_epochs,
        patience_epochs: config.patience_epochs,
        learning_rate: config.autoencoder_learning_rate,
        resume,
    };
    let device = compute.device()?.autodiff();
    device.seed(config.seed);
    let (sizes, vertices) = (config.autoencoder, frames.vertices);
    let largest_m = frames.largest_m();
    let squares: f64 = frames
        .training
        .iter()
        .map(|x| f64::from(x / largest_m).powi(2))
        .sum();
    let unit = (squares / frames.training.len().max(1) as f64).max(f64::MIN_POSITIVE) as f32;
    let model = Autoencoder::new(&sizes, vertices, &device);
    let course = FrameCourse {
        frames,
        config,
        device,
        largest_m,
        unit,
        order: Vec::new(),
    };
    let trained = run.train(model, course, progress)?;
    Ok(Trained {
        model: Compressor {
            model: trained.model,
            sizes,
            vertices,
            largest_m,
        },
        best_epoch: trained.best_epoch,
        seconds: trained.seconds,
    })
}

/// The training frames in random order.
struct FrameCourse<'a> {
    frames: &'a OffsetFrames,
    config: &'a DsnetConfig,
    device: Device,
    /// Metres that are 1 for the network.
    largest_m: f32,
    /// Mean square of the scaled coordinates, which is a loss of 1.
    unit: f32,
    /// Frames of the epoch.
    order: Vec<usize>,
}

impl Course<Autoencoder> for FrameCourse<'_> {
    fn begin(&mut self, epoch: usize) -> usize {
        let config = self.config;
        self.order = (0..self.frames.training.len() / (3 * self.frames.vertices)).collect();
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed.wrapping_mul(1_000_003) + epoch as u64);
        self.order.shuffle(&mut rng as &mut dyn Rng);
        self.order.len().div_ceil(config.autoencoder_batch)
    }

    fn loss(&mut self, model: &Autoencoder, step: usize) -> (Tensor<1>, f64) {
        let (sizes, vertices) = (&self.config.autoencoder, self.frames.vertices);
        let width = 3 * vertices;
        let picked: Vec<f32> = part(&self.order, step, self.config.autoencoder_batch)
            .iter()
            .flat_map(|frame| &self.frames.training[frame * width..(frame + 1) * width])
            .copied()
            .collect();
        let field = fields(&picked, vertices, self.largest_m, &self.device);
        let back = model.decode(sizes, model.encode(sizes, field.clone()), vertices);
        ((back - field).powi_scalar(2).mean() / self.unit, 1.0)
    }

    fn validate(&self, model: &Autoencoder) -> Validation {
        let compressor = Compressor {
            model: model.clone(),
            sizes: self.config.autoencoder,
            vertices: self.frames.vertices,
            largest_m: self.largest_m,
        };
        let (error_mm, size_mm) = compressor.errors_mm(&self.frames.validation);
        Validation {
            loss: error_mm,
            ratio: error_mm / size_mm.max(f32::MIN_POSITIVE),
        }
    }
}
