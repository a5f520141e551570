//! Training of the regressor.

use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::AdamConfig;
use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::config::RegressorConfig;
use super::data::{ClipFields, Prepared};
use super::fit_autoencoder::{BLOCK_FRAMES, Distances, unit_mm};
use super::head::{Head, LatentScale};
use super::regressor::{Past, Regressor, input_count, masters_width, row};
use super::window::KIND;
use dynaskin_train::{
    Checkpoint, Compute, Course, EpochRecord, EpochRun, Schedule, TrainError, Validation, part,
};

/// What the regressor learns from beside the clips.
pub(super) struct Lesson<'a> {
    pub data: &'a Prepared,
    pub scale: &'a LatentScale,
    /// Normalised latents of the training clips.
    pub latents: Vec<Vec<f32>>,
    pub head: &'a Head,
}

/// The parts of a training step that do not change.
struct Fixed {
    device: Device,
    /// The decoder, into fields whose squared length is the loss.
    head: Head,
    /// What the clips' fields are multiplied with for that, transposed; none for plain distances.
    turn: Option<Tensor<2>>,
    step_gain: Tensor<2>,
    /// Loss of predicting no offset, which the loss is a share of.
    still: f64,
}

/// Trains a regressor and gives the weights of the epoch that did best on the validation clips,
/// played from rest on its own latents.
///
/// # Errors
/// [`TrainError::Diverged`], [`TrainError::Checkpoint`], [`TrainError::Io`].
pub(super) fn fit_regressor(
    lesson: &Lesson<'_>,
    config: &RegressorConfig,
    compute: Compute,
    (checkpoint, resume): (&Checkpoint, bool),
    mut progress: impl FnMut(&EpochRecord),
) -> Result<(Regressor, EpochRecord), TrainError> {
    let device = compute.device()?.autodiff();
    let latents = lesson.scale.count();
    let coordinates = lesson.data.span.basis.coordinates();
    let rule = || masters_width(input_count(latents), coordinates);
    let hidden = config.hidden.unwrap_or_else(rule);
    device.seed(config.seed);
    let model = Regressor::new(latents, hidden, &device);
    let fixed = Fixed::new(lesson, config, device)?;
    let optimizer = AdamConfig::new()
        .with_grad_clipping(Some(GradientClippingConfig::Norm(config.clip_norm)))
        .init();
    let run = EpochRun {
        checkpoint,
        config,
        epochs: config.epochs,
        patience_epochs: config.patience_epochs,
        learning_rate: config.learning_rate,
        schedule: Schedule::WarmUp,
        resume,
    };
    let course = RegressorCourse {
        lesson,
        config,
        fixed,
        rng: Pcg64Mcg::seed_from_u64(config.seed),
        order: Vec::new(),
    };
    let best = run.run(model, optimizer, course, &mut progress)?;
    let model = Regressor::new(latents, hidden, &Device::flex());
    Ok((checkpoint.load_best(model)?, best))
}

impl Fixed {
    fn new(
        lesson: &Lesson<'_>,
        config: &RegressorConfig,
        device: Device,
    ) -> Result<Self, TrainError> {
        let span = &lesson.data.span;
        let width = span.width();
        let (head, turn) = if config.weighted {
            let root = span.weighting(&lesson.data.weights)?;
            let head = lesson.head.weighted(&root);
            let data = TensorData::new(root, [width, width]);
            (
                head,
                Some(Tensor::<2>::from_data(data, &device).transpose()),
            )
        } else {
            (lesson.head.clone(), None)
        };
        let mut fixed = Self {
            head: head.on(&device),
            step_gain: row(&lesson.scale.step_gain(), &device),
            device,
            turn,
            still: 1.0,
        };
        fixed.still = fixed.still_loss(lesson.data);
        Ok(fixed)
    }

    /// The fields `[frames, span]` that the loss compares.
    fn turned(&self, fields: Vec<f32>, width: usize) -> Tensor<2> {
        let shape = [fields.len() / width, width];
        let fields = Tensor::from_data(TensorData::new(fields, shape), &self.device);
        match &self.turn {
            Some(turn) => fields.matmul(turn.clone()),
            None => fields,
        }
    }

    fn still_loss(&self, data: &Prepared) -> f64 {
        let width = data.span.width();
        let zero = self.turned(data.span.zero(), width);
        let (mut sum, mut frames) = (0.0, 0usize);
        for fields in data
            .training
            .iter()
            .flat_map(|c| c.fields.chunks(BLOCK_FRAMES * width))
        {
            let error = self.turned(fields.to_vec(), width) - zero.clone();
            sum += f64::from(error.powi_scalar(2).sum().into_scalar::<f32>());
            frames += fields.len() / width;
        }
        (sum / frames.max(1) as f64).max(f64::MIN_POSITIVE)
    }
}

/// A stretch of a clip that the network plays on its own.
type Stretch = (usize, usize);

fn stretches(clips: &[ClipFields], config: &RegressorConfig, rng: &mut Pcg64Mcg) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    for (index, clip) in clips.iter().enumerate() {
        // Another phase in each epoch, and the very start in each: there the past is rest.
        let mut first = 0;
        while first + config.rollout <= clip.frames {
            stretches.push((index, first));
            first += match first {
                0 => rng.random_range(1..=config.rollout),
                _ => config.rollout,
            };
        }
    }
    stretches.shuffle(rng as &mut dyn Rng);
    stretches
}

/// Stretches of the training clips in random order; losses in millimetres.
struct RegressorCourse<'a> {
    lesson: &'a Lesson<'a>,
    config: &'a RegressorConfig,
    fixed: Fixed,
    rng: Pcg64Mcg,
    /// Those of the epoch.
    order: Vec<Stretch>,
}

impl Course<Regressor> for RegressorCourse<'_> {
    fn begin(&mut self, epoch: usize) -> usize {
        let seed = self.config.seed.wrapping_mul(1_000_003) + epoch as u64;
        self.rng = Pcg64Mcg::seed_from_u64(seed);
        self.order = stretches(&self.lesson.data.training, self.config, &mut self.rng);
        self.order.len().div_ceil(lanes(self.config))
    }

    fn loss(&mut self, model: &Regressor, step: usize) -> (Tensor<1>, f64) {
        let (lesson, config, fixed) = (self.lesson, self.config, &self.fixed);
        let stretches = part(&self.order, step, lanes(config));
        let (features, past, target) = batch(lesson, config, fixed, stretches, &mut self.rng);
        let (latents, _) = model.play(features, past, &fixed.step_gain);
        let error = fixed.head.fields(latents) - target;
        let frames = stretches.len() * config.rollout;
        let loss = error.powi_scalar(2).sum() / (frames as f64 * fixed.still);
        (loss, stretches.len() as f64)
    }

    fn in_unit(&self, mean: f64) -> f32 {
        ((mean * self.fixed.still).sqrt() * unit_mm(&self.lesson.data.span)) as f32
    }

    fn validate(&self, model: &Regressor) -> Validation {
        validate(model, self.lesson)
    }
}

/// Stretches side by side in a step.
fn lanes(config: &RegressorConfig) -> usize {
    (config.batch / config.rollout).max(1)
}

/// Features, the true latents before, and the fields to come to; rows are time-major.
fn batch(
    lesson: &Lesson<'_>,
    config: &RegressorConfig,
    fixed: &Fixed,
    stretches: &[Stretch],
    rng: &mut Pcg64Mcg,
) -> (Tensor<2>, Past, Tensor<2>) {
    let (lanes, ticks) = (stretches.len(), config.rollout);
    let (count, width) = (lesson.scale.count(), lesson.data.span.width());
    let mut features = Vec::with_capacity(lanes * ticks * KIND.count());
    let mut fields = Vec::with_capacity(lanes * ticks * width);
    for tick in 0..ticks {
        for (clip, first) in stretches {
            let (clip, frame) = (&lesson.data.training[*clip], first + tick);
            let at = frame * KIND.count();
            features.extend_from_slice(&clip.features[at..at + KIND.count()]);
            fields.extend_from_slice(&clip.fields[frame * width..(frame + 1) * width]);
        }
    }
    let at_rest = lesson.scale.at_rest();
    // Uniform noise of the deviation asked for.
    let most = 3f32.sqrt() * config.latent_noise;
    let mut latents_before = |ticks_ago: usize| {
        let mut numbers = Vec::with_capacity(lanes * count);
        for (clip, first) in stretches {
            let latents = &lesson.latents[*clip];
            match first.checked_sub(ticks_ago) {
                Some(frame) => {
                    let true_ones = &latents[frame * count..(frame + 1) * count];
                    let noisy = true_ones
                        .iter()
                        .map(|x| x + rng.random_range(-1.0..1.0) * most);
                    numbers.extend(noisy);
                }
                None => numbers.extend_from_slice(&at_rest),
            }
        }
        Tensor::from_data(TensorData::new(numbers, [lanes, count]), &fixed.device)
    };
    let past = Past {
        newest: latents_before(1),
        before: latents_before(2),
    };
    let shape = [lanes * ticks, KIND.count()];
    let features = Tensor::from_data(TensorData::new(features, shape), &fixed.device);
    (features, past, fixed.turned(fields, width))
}

/// Distances of fields, all vertices alike, on the validation clips side by side.
fn validate(model: &Regressor, lesson: &Lesson<'_>) -> Validation {
    let clips: Vec<&ClipFields> = lesson.data.validation.iter().collect();
    let mut sums = Distances::new(&lesson.data.span);
    let played = roll_out(model, lesson.scale, &clips);
    for (clip, latents) in clips.iter().zip(played) {
        let shape = [clip.frames, lesson.scale.count()];
        let latents = Tensor::from_data(TensorData::new(latents, shape), &Device::flex());
        let fields = lesson.head.fields(latents).into_data();
        sums.add(&fields.iter::<f32>().collect::<Vec<_>>(), &clip.fields);
    }
    sums.validation()
}

/// Normalised latents of whole clips, each played from rest on the network's own latents.
pub(super) fn roll_out(
    model: &Regressor,
    scale: &LatentScale,
    clips: &[&ClipFields],
) -> Vec<Vec<f32>> {
    let model = model.valid();
    let device = model.hidden.weight.val().device();
    let (lanes, count) = (clips.len(), scale.count());
    let step_gain = row(&scale.step_gain(), &device);
    let at_rest = row(&scale.at_rest(), &device).repeat_dim(0, lanes);
    let mut past = Past {
        newest: at_rest.clone(),
        before: at_rest,
    };
    let longest = clips.iter().map(|clip| clip.frames).max().unwrap_or(0);
    let mut played = vec![Vec::new(); lanes];
    for frame in 0..longest {
        let mut features = Vec::with_capacity(lanes * KIND.count());
        for clip in clips {
            // Clips that have ended stand still in their last frame.
            let at = frame.min(clip.frames - 1) * KIND.count();
            features.extend_from_slice(&clip.features[at..at + KIND.count()]);
        }
        let features = TensorData::new(features, [lanes, KIND.count()]);
        let features = Tensor::from_data(features, &device);
        let (latents, next) = model.play(features, past, &step_gain);
        past = next;
        let latents: Vec<f32> = latents.into_data().iter::<f32>().collect();
        for ((clip, latents), played) in clips
            .iter()
            .zip(latents.chunks_exact(count))
            .zip(&mut played)
        {
            if frame < clip.frames {
                played.extend_from_slice(latents);
            }
        }
    }
    played
}
