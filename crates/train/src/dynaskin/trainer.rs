//! The training loop of the predictor: AdamW, cosine decay, checkpoints, early best.

use burn::grad_clipping::GradientClippingConfig;
use burn::optim::AdamWConfig;
use burn::tensor::{Device, Tensor, TensorData};

use super::blocks::Block;
use super::config::TrainConfig;
use super::lanes::{Batch, Lanes, Sequence};
use super::locality::Locality;
use super::predictor::{Predictor, PredictorSizes, PredictorState};
use crate::TrainError;
use crate::checkpoint::{Checkpoint, EpochRecord};
use crate::compute::Compute;
use crate::epochs::{Course, EpochRun, Schedule, Validation};

/// Rounds the corner of the loss at zero error, in millimetres: below it frames count as done.
const LOSS_FLOOR_MM: f32 = 0.05;
const VALIDATION_LANES: usize = 32;

/// The predictor's data: sequences, and what turns latents into vertex errors.
#[derive(Debug)]
pub struct PredictorData {
    /// Learned from.
    pub training: Vec<Sequence>,
    /// Decides which epoch's weights are kept.
    pub validation: Vec<Sequence>,
    /// Deviation of each latent in metres.
    pub deviation_m: Vec<f32>,
    /// The blocks that the latents belong to, in order.
    pub blocks: Vec<BlockSize>,
    /// Which blocks feel which features.
    pub locality: Locality,
    /// Motion features a frame.
    pub motion: usize,
    /// Features of the body.
    pub conditions: usize,
}

/// Size of a block of the body ([`crate::BlockBasis`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSize {
    /// Number of latents.
    pub latents: usize,
    /// Number of vertices.
    pub vertices: usize,
}

impl BlockSize {
    /// Of a block.
    pub fn of(block: &Block) -> Self {
        Self {
            latents: block.basis.components(),
            vertices: block.slots.len(),
        }
    }
}

/// Trains a predictor and gives the weights of the epoch that did best on the validation set.
///
/// The loss of a frame is the mean over the blocks, weighted by their vertices, of the root mean
/// square over a block's vertices of the offset error within the subspace, in millimetres. It is
/// computed on latents: with an orthonormal basis the squared distance of two latents in metres is
/// that of the two offset fields. Not squaring the whole keeps violent frames and loose regions from
/// drowning the rest, and is close to the mean vertex error that models are judged by. To it comes, by
/// [`TrainConfig::velocity_weight`], the same of how the error changes from frame to frame; validation
/// goes by offsets alone.
///
/// # Errors
/// [`TrainError::Device`], [`TrainError::Diverged`], [`TrainError::Checkpoint`], [`TrainError::Io`].
pub fn train(
    data: &PredictorData,
    config: &TrainConfig,
    compute: Compute,
    (checkpoint, resume): (&Checkpoint, bool),
    mut progress: impl FnMut(&EpochRecord),
) -> Result<(Predictor, EpochRecord), TrainError> {
    let plain = compute.device()?;
    let device = plain.clone().autodiff();
    device.seed(config.seed);
    let sizes = PredictorSizes {
        motion: data.motion,
        conditions: data.conditions,
        encoding: config.encoding,
        springs: config.springs,
        hidden: config.hidden,
        latent: data.deviation_m.len(),
    };
    let model = Predictor::new(sizes, &data.locality, &device);
    let optimizer = AdamWConfig::new()
        .with_weight_decay(config.weight_decay)
        .with_epsilon(1e-8)
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
    let course = PredictorCourse {
        data,
        config,
        metric: Metric::new(data, &device),
        plain_metric: Metric::new(data, &plain),
        lanes: None,
        state: None,
    };
    let best = run.run(model, optimizer, course, &mut progress)?;
    let model = checkpoint.load_best(Predictor::new(sizes, &data.locality, &Device::flex()))?;
    Ok((model, best))
}

/// Windows of the training sequences, one after the other; losses in millimetres.
struct PredictorCourse<'a> {
    data: &'a PredictorData,
    config: &'a TrainConfig,
    /// With gradients.
    metric: Metric,
    /// Without.
    plain_metric: Metric,
    /// Those of the epoch.
    lanes: Option<Lanes<'a>>,
    /// After the window before; none where an epoch begins.
    state: Option<PredictorState>,
}

impl PredictorCourse<'_> {
    /// Motion features and latents of a frame.
    fn widths(&self) -> (usize, usize) {
        (self.data.motion, self.data.deviation_m.len())
    }
}

impl Course<Predictor> for PredictorCourse<'_> {
    fn begin(&mut self, epoch: usize) -> usize {
        let (config, widths) = (self.config, self.widths());
        let seed = config.seed.wrapping_mul(1_000_003) + epoch as u64;
        let training = &self.data.training;
        let lanes = Lanes::new(training, config.lanes, config.window, widths, seed);
        self.state = None;
        self.lanes.insert(lanes).window_count()
    }

    fn loss(&mut self, model: &Predictor, step: usize) -> (Tensor<1>, f64) {
        let metric = &self.metric;
        let device = &metric.device;
        let Some(lanes) = &self.lanes else {
            return (Tensor::zeros([1], device), 0.0);
        };
        let state = self.state.take();
        let state = state.unwrap_or_else(|| model.rest_state(lanes.count(), device));
        let batch = lanes.window(step, device);
        let (latents, next) = model.forward(&batch.window, state);
        self.state = Some(next.detached());
        let velocity = metric.velocity_loss_mm(latents.clone(), &batch);
        let loss = metric.loss_mm(latents, &batch) + velocity * self.config.velocity_weight;
        (loss, batch.frames as f64)
    }

    fn validate(&self, model: &Predictor) -> Validation {
        let (config, metric) = (self.config, &self.plain_metric);
        let lanes = Lanes::new(
            &self.data.validation,
            VALIDATION_LANES,
            config.window,
            self.widths(),
            config.seed,
        );
        let mut state = model.rest_state(lanes.count(), &metric.device);
        let (mut error, mut still, mut frames) = (0.0f64, 0.0f64, 0usize);
        for index in 0..lanes.window_count() {
            let batch = lanes.window(index, &metric.device);
            let (latents, next) = model.forward(&batch.window, state);
            state = next;
            let zeros = Tensor::zeros(latents.dims(), &metric.device);
            let weight = batch.frames as f64;
            error += f64::from(metric.loss_mm(latents, &batch).into_scalar::<f32>()) * weight;
            still += f64::from(metric.loss_mm(zeros, &batch).into_scalar::<f32>()) * weight;
            frames += batch.frames;
        }
        Validation {
            loss: (error / frames.max(1) as f64) as f32,
            ratio: (error / still.max(f64::MIN_POSITIVE)) as f32,
        }
    }
}

/// Turns latent errors into vertex errors.
struct Metric {
    /// `[1, latent]`: millimetres of a block's root-mean-square vertex error a unit of normalised
    /// latent.
    scale_mm: Tensor<2>,
    /// `[latent, block]`: 1 where the latent belongs to the block.
    membership: Tensor<2>,
    /// `[block, 1]`: each block's share of the vertices.
    share: Tensor<2>,
    device: Device,
}

impl Metric {
    fn new(data: &PredictorData, device: &Device) -> Self {
        let vertices: usize = data.blocks.iter().map(|block| block.vertices).sum();
        let of_latents = data.blocks.iter().enumerate();
        let of_latents: Vec<(usize, BlockSize)> = of_latents
            .flat_map(|(index, block)| std::iter::repeat_n((index, *block), block.latents))
            .collect();
        let scale_mm = data.deviation_m.iter().zip(&of_latents);
        let scale_mm: Vec<f32> = scale_mm
            .map(|(deviation_m, (_, block))| 1000.0 * deviation_m / (block.vertices as f32).sqrt())
            .collect();
        let blocks = data.blocks.len();
        let mut membership = vec![0.0; of_latents.len() * blocks];
        for (latent, (block, _)) in of_latents.iter().enumerate() {
            membership[latent * blocks + block] = 1.0;
        }
        let share = data.blocks.iter();
        let share: Vec<f32> = share.map(|b| b.vertices as f32 / vertices as f32).collect();
        let matrix = |numbers: Vec<f32>, columns: usize| {
            let shape = [numbers.len() / columns, columns];
            Tensor::from_data(TensorData::new(numbers, shape), device)
        };
        let latents = scale_mm.len();
        Self {
            scale_mm: matrix(scale_mm, latents),
            membership: matrix(membership, blocks),
            share: matrix(share, 1),
            device: device.clone(),
        }
    }

    /// Mean over the frames that count of the vertex error in millimetres.
    fn loss_mm(&self, latents: Tensor<2>, batch: &Batch) -> Tensor<1> {
        let error_mm = (latents - batch.latents.clone()) * self.scale_mm.clone();
        self.vertex_mm(error_mm).mul(batch.weights.clone()).sum() / batch.frames.max(1) as f32
    }

    /// Mean over the frames that count of how far the vertex error moves in a tick, in millimetres.
    fn velocity_loss_mm(&self, latents: Tensor<2>, batch: &Batch) -> Tensor<1> {
        let error_mm = (latents - batch.latents.clone()) * self.scale_mm.clone();
        let lanes = batch.window.lanes;
        let [rows, _] = error_mm.dims();
        let after = error_mm.clone().narrow(0, lanes, rows - lanes);
        let change_mm = after - error_mm.narrow(0, 0, rows - lanes);
        let follows = batch.follows.clone().narrow(0, lanes, rows - lanes);
        self.vertex_mm(change_mm).mul(follows).sum() / batch.frames.max(1) as f32
    }

    /// Vertex distance of each row of scaled latents: the mean over the blocks, by their vertices, of the
    /// root mean square over a block. `[rows]`.
    fn vertex_mm(&self, error_mm: Tensor<2>) -> Tensor<1> {
        let square = error_mm.powi_scalar(2).matmul(self.membership.clone());
        let blocks = (square + LOSS_FLOOR_MM * LOSS_FLOOR_MM).sqrt() - LOSS_FLOOR_MM;
        let frame = blocks.matmul(self.share.clone()); // [rows, 1]
        frame.squeeze_dim::<1>(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynaskin::predictor::Window;

    /// Two lanes of three frames whose errors are `errors`, in units in which a latent is a
    /// millimetre; the second lane's last frame begins a clip.
    fn losses_mm(errors: [[f32; 2]; 3]) -> (f32, f32) {
        let device = Device::flex();
        let data = PredictorData {
            training: Vec::new(),
            validation: Vec::new(),
            deviation_m: vec![0.002],
            blocks: vec![BlockSize {
                latents: 1,
                vertices: 4,
            }],
            locality: Locality::everywhere(1, 1, 1),
            motion: 1,
            conditions: 1,
        };
        let column = |numbers: Vec<f32>| {
            let shape = [numbers.len(), 1];
            Tensor::<2>::from_data(TensorData::new(numbers, shape), &device)
        };
        let row = |numbers: [f32; 6]| {
            Tensor::<1>::from_data(TensorData::new(numbers.to_vec(), [6]), &device)
        };
        let batch = Batch {
            window: Window {
                motion: column(vec![0.0; 6]),
                condition: column(vec![0.0; 6]),
                keep: vec![None, None, None],
                lanes: 2,
            },
            latents: column(vec![5.0; 6]),
            weights: row([1.0; 6]),
            follows: row([0.0, 0.0, 1.0, 1.0, 1.0, 0.0]),
            frames: 6,
        };
        let metric = Metric::new(&data, &device);
        let latents = column(errors.as_flattened().iter().map(|e| 5.0 + e).collect());
        let mean = metric.loss_mm(latents.clone(), &batch).into_scalar::<f32>();
        let velocity = metric
            .velocity_loss_mm(latents, &batch)
            .into_scalar::<f32>();
        (mean, velocity)
    }

    #[test]
    fn an_error_that_stays_costs_nothing_in_velocity() {
        let (offset_mm, velocity_mm) = losses_mm([[3.0, -3.0]; 3]);
        assert!((offset_mm - 3.0).abs() < LOSS_FLOOR_MM, "{offset_mm}");
        assert!(velocity_mm.abs() < 1e-6, "{velocity_mm}");
    }

    #[test]
    fn changes_count_within_a_clip_and_a_lane_only() {
        // The first lane's error rises by 2 mm a tick, the second's jumps where a clip begins.
        let (_, velocity_mm) = losses_mm([[1.0, 4.0], [3.0, 4.0], [5.0, -60.0]]);
        assert!(
            (velocity_mm - 4.0 / 6.0).abs() < LOSS_FLOOR_MM,
            "{velocity_mm}"
        );
    }
}
