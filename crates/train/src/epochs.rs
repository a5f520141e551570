//! Epoch after epoch: what every training loop shares.

use std::time::Instant;

use burn::module::Module;
use burn::optim::ModuleOptimizer;
use serde::Serialize;
use serde_json::Value;

use crate::TrainError;
use crate::checkpoint::{Checkpoint, EpochRecord};

/// Share of the steps in which the learning rate rises from zero.
const WARM_UP: f64 = 0.03;
/// The learning rate ends at this share of its peak.
const LAST_RATE: f64 = 0.01;
/// Epochs without progress after which training ends, unless a run says otherwise. DSNet needs it most:
/// its error on what it does not learn from rises again after a third of its epochs.
pub(crate) const PATIENCE_EPOCHS: usize = 12;

/// The learning rate's share of its peak after `done` (0..1) of all steps.
pub(crate) fn rate_share(done: f64) -> f64 {
    let warm_up = (done / WARM_UP).min(1.0);
    let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
    warm_up * (LAST_RATE + (1.0 - LAST_RATE) * cosine)
}

/// What the validation set came to after an epoch.
pub(crate) struct Validation {
    /// Mean loss, in the unit of the training loss or as the network says.
    pub loss: f32,
    /// Over that of offset 0.
    pub ratio: f32,
}

/// A run of epochs with its checkpoint.
pub(crate) struct EpochRun<'a, C> {
    /// Where the state is written after every epoch.
    pub checkpoint: &'a Checkpoint,
    /// Settings: an earlier run is taken up only with the same ones.
    pub config: &'a C,
    /// Number of epochs, those of the earlier run among them.
    pub epochs: usize,
    /// The run ends early once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
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

    /// Runs the epochs and gives the record of the one that did best on the validation set, whose
    /// weights [`Checkpoint::load_best`] reads. `epoch` trains one epoch, counted from 0, and gives
    /// the model and the mean loss; `validate` is given the model without gradients.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`], [`TrainError::Io`], [`TrainError::Config`] for no epoch at all,
    /// [`TrainError::Diverged`] for a validation loss that is no number, and what `epoch` gives.
    pub fn run<M: Module>(
        &self,
        mut model: M,
        mut optimizer: ModuleOptimizer,
        mut epoch: impl FnMut(usize, M, &mut ModuleOptimizer) -> Result<(M, f32), TrainError>,
        validate: impl Fn(&M) -> Validation,
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
            let (next, loss) = epoch(index, model, &mut optimizer)?;
            model = next;
            let validation = validate(&model.valid());
            if !validation.loss.is_finite() {
                return Err(TrainError::Diverged {
                    epoch: index + 1,
                    loss: validation.loss,
                });
            }
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

    /// Whether the last epochs brought nothing.
    fn is_over(&self, history: &[EpochRecord]) -> bool {
        let since_best = best(history).map_or(0, |best| history.len() - best.epoch);
        self.patience_epochs > 0 && since_best >= self.patience_epochs
    }
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
    }
    settings
}
