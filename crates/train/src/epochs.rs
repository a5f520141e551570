//! Epoch after epoch: the one loop that trains every network, ours and those of other methods.

use std::time::Instant;

use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::Tensor;
use serde::Serialize;
use serde_json::Value;

use crate::TrainError;
use crate::checkpoint::{Checkpoint, EpochRecord};

/// Epochs without progress after which training ends, unless a run says otherwise. DSNet needs it most:
/// its error on what it does not learn from rises again after a third of its epochs.
pub const PATIENCE_EPOCHS: usize = 12;

/// How the learning rate goes from its peak to the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schedule {
    /// Rises from zero, then falls along half a cosine to a hundredth of the peak.
    WarmUp,
    /// Falls from the peak along half a cosine, and ends at a two-thousandth of it.
    Cosine,
}

/// Share of the steps in which the learning rate of [`Schedule::WarmUp`] rises from zero.
const WARM_UP: f64 = 0.03;
/// That rate ends at this share of its peak.
const LAST_RATE: f64 = 0.01;

impl Schedule {
    /// The learning rate after `done` (0..1) of all steps.
    fn rate(self, peak: f64, done: f64) -> f64 {
        match self {
            Self::WarmUp => {
                let warm_up = (done / WARM_UP).min(1.0);
                let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
                peak * (warm_up * (LAST_RATE + (1.0 - LAST_RATE) * cosine))
            }
            Self::Cosine => {
                let done = done.min(1.0);
                0.5 * peak * (1.0 + (std::f64::consts::PI * done).cos()).max(1e-3)
            }
        }
    }
}

/// The validation loss after an epoch.
pub struct Validation {
    /// Mean loss, in the unit of the training loss or as the network says.
    pub loss: f32,
    /// The loss divided by that of zero offsets.
    pub ratio: f32,
}

/// What a network learns: the steps of an epoch, and how well it did after one.
pub trait Course<M> {
    /// Begins an epoch, counted from 0, and gives its number of steps.
    fn begin(&mut self, epoch: usize) -> usize;

    /// The loss of a step, counted from 0, and how much it counts in the mean over the epoch.
    fn loss(&mut self, model: &M, step: usize) -> (Tensor<1>, f64);

    /// The mean over an epoch in the unit of [`EpochRecord::training_loss`].
    fn in_unit(&self, mean: f64) -> f32 {
        mean as f32
    }

    /// What the validation set comes to; `model` has no gradients.
    fn validate(&self, model: &M) -> Validation;
}

/// A run of epochs with its checkpoint.
pub struct EpochRun<'a, C> {
    /// Where the state is written after every epoch.
    pub checkpoint: &'a Checkpoint,
    /// Settings: an earlier run is taken up only with the same ones.
    pub config: &'a C,
    /// Number of epochs, those of the earlier run among them.
    pub epochs: usize,
    /// The run ends early once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
    /// Peak of the learning rate.
    pub learning_rate: f64,
    /// How it goes from there.
    pub schedule: Schedule,
    /// Whether to take up the run in the checkpoint.
    pub resume: bool,
}

impl<C: Serialize> EpochRun<'_, C> {
    /// Settings as they are read back from a file, so that rounding of numbers in text cannot tell
    /// two equal ones apart.
    fn settings(&self) -> Value {
        let value = serde_json::to_value(self.config).unwrap_or_default();
        serde_json::from_str(&value.to_string()).unwrap_or_default()
    }

    /// Runs the epochs of `course` and gives the record of the one that did best on the validation
    /// set, whose weights [`Checkpoint::load_best`] reads.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`], [`TrainError::Io`], [`TrainError::Config`] for no epoch at all,
    /// [`TrainError::Diverged`] for a loss that is no number.
    pub fn run<M: Module>(
        &self,
        mut model: M,
        mut optimizer: ModuleOptimizer,
        mut course: impl Course<M>,
        mut progress: impl FnMut(&EpochRecord),
    ) -> Result<EpochRecord, TrainError> {
        let checkpoint = self.checkpoint;
        let mut history: Vec<EpochRecord> = Vec::new();
        if self.resume {
            let same = |earlier: Value| but_epochs(earlier) == but_epochs(self.settings());
            (model, history) = checkpoint.load(model, &mut optimizer, same)?;
        } else {
            checkpoint.clear()?;
        }
        for index in history.len()..self.epochs {
            if self.is_over(&history) {
                break;
            }
            let start = Instant::now();
            let loss;
            (model, loss) = self.epoch(index, model, &mut optimizer, &mut course)?;
            let validation = course.validate(&model.valid());
            finite(validation.loss, index)?;
            let record = EpochRecord {
                epoch: index + 1,
                training_loss: loss,
                validation_loss: validation.loss,
                validation_ratio: validation.ratio,
                seconds: start.elapsed().as_secs_f64(),
            };
            let is_best =
                best(&history).is_none_or(|best| record.validation_ratio < best.validation_ratio);
            history.push(record.clone());
            checkpoint.save(&model, &optimizer, self.config, &history, is_best)?;
            progress(&record);
        }
        best(&history).cloned().ok_or_else(|| TrainError::Config {
            setting: "epochs",
            got: "0".into(),
            expected: "1 or more".into(),
        })
    }

    /// Takes the model through one epoch; gives the mean loss, too.
    fn epoch<M: Module>(
        &self,
        index: usize,
        mut model: M,
        optimizer: &mut ModuleOptimizer,
        course: &mut impl Course<M>,
    ) -> Result<(M, f32), TrainError> {
        let steps = course.begin(index);
        let (mut sum, mut weights) = (0.0f64, 0.0f64);
        for step in 0..steps {
            let (loss, weight) = course.loss(&model, step);
            sum += f64::from(finite(loss.clone().into_scalar::<f32>(), index)?) * weight;
            weights += weight;
            let gradients = GradientsParams::from_grads(loss.backward(), &model);
            let done = (index as f64 + step as f64 / steps as f64) / self.epochs as f64;
            let rate = self.schedule.rate(self.learning_rate, done);
            model = optimizer.step(rate, model, gradients);
        }
        Ok((model, course.in_unit(sum / weights.max(1.0))))
    }

    /// Whether the last epochs brought nothing.
    fn is_over(&self, history: &[EpochRecord]) -> bool {
        let since_best = best(history).map_or(0, |best| history.len() - best.epoch);
        self.patience_epochs > 0 && since_best >= self.patience_epochs
    }
}

/// The `step`-th part of an epoch's order, in parts of `size`; the last may be shorter.
pub fn part<T>(order: &[T], step: usize, size: usize) -> &[T] {
    let from = (step * size).min(order.len());
    &order[from..(from + size).min(order.len())]
}

/// Refuses a loss of an epoch, counted from 0, that is not a number.
fn finite(loss: f32, epoch: usize) -> Result<f32, TrainError> {
    if loss.is_finite() {
        return Ok(loss);
    }
    Err(TrainError::Diverged {
        epoch: epoch + 1,
        loss,
    })
}

/// The epoch that did best on the validation set, the first of equals.
fn best(history: &[EpochRecord]) -> Option<&EpochRecord> {
    history
        .iter()
        .min_by(|a, b| a.validation_ratio.total_cmp(&b.validation_ratio))
}

/// Settings without those that only say when a run ends, which may differ when it is taken up again.
fn but_epochs(mut settings: Value) -> Value {
    if let Some(fields) = settings.as_object_mut() {
        fields.remove("epochs");
        fields.remove("patience_epochs");
        // As earlier checkpoints call it.
        if let Some(scale) = fields.remove("shape_loudness") {
            fields.insert("shape_scale".to_owned(), scale);
        }
    }
    settings
}
