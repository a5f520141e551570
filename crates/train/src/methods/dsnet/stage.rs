//! What training the autoencoder and training the predictor have in common.

use burn::module::Module;
use burn::optim::{AdamConfig, ModuleOptimizer};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::TrainError;
use crate::checkpoint::{Checkpoint, EpochRecord};
use crate::epochs::{EpochRun, Validation};

/// One of the two networks that DSNet trains, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Losses are squared errors of offsets, and mean vertex errors in millimetres on validation.
    Autoencoder,
    /// Losses are distances in latent space, with a root mean square of 1 over the training set.
    Predictor,
}

/// What one epoch of a stage came to.
#[derive(Clone, Debug, PartialEq)]
pub struct StageEpoch {
    /// The network.
    pub stage: Stage,
    /// Of how many epochs.
    pub epochs: usize,
    /// The epoch and its losses.
    pub record: EpochRecord,
}

/// State, settings and length of a stage.
pub(super) struct Run<'a> {
    pub stage: Stage,
    /// Where the state is kept.
    pub checkpoint: &'a Checkpoint,
    /// What must be the same for a run to be resumed.
    pub settings: Value,
    pub epochs: usize,
    pub patience_epochs: usize,
    pub learning_rate: f64,
    pub resume: bool,
}

/// A trained network.
#[derive(Debug)]
pub struct Trained<M> {
    /// It, with the weights of its best epoch.
    pub model: M,
    /// That epoch, from 1.
    pub best_epoch: usize,
    /// Wall-clock seconds of all epochs, over all runs that were resumed.
    pub seconds: f64,
}

impl Run<'_> {
    /// Trains `model` for the epochs that are not done yet; gives the weights of the epoch with the
    /// least validation loss. `epoch` is told the epoch (from 0), takes the model through it and gives
    /// the mean loss.
    pub fn train<M: Module>(
        &self,
        model: M,
        epoch: impl FnMut(usize, M, &mut ModuleOptimizer) -> Result<(M, f32), TrainError>,
        validate: impl Fn(&M) -> Validation,
        progress: &mut dyn FnMut(&StageEpoch),
    ) -> Result<Trained<M>, TrainError> {
        let checkpoint = self.checkpoint;
        // An untrained copy to load the best weights into.
        let fresh = model.valid();
        let run = EpochRun {
            checkpoint,
            config: &self.settings,
            epochs: self.epochs,
            patience_epochs: self.patience_epochs,
            resume: self.resume && checkpoint.holds_run(),
        };
        let optimizer = AdamConfig::new().with_epsilon(1e-8).init();
        let best = run.run(model, optimizer, epoch, validate, |record| {
            progress(&StageEpoch {
                stage: self.stage,
                epochs: self.epochs,
                record: record.clone(),
            });
        })?;
        Ok(Trained {
            best_epoch: best.epoch,
            seconds: checkpoint.seconds()?,
            model: checkpoint.load_best(fresh)?,
        })
    }

    /// The learning rate after `done` of all epochs.
    pub fn rate(&self, done: f64) -> f64 {
        let share = (done / self.epochs as f64).min(1.0);
        0.5 * self.learning_rate * (1.0 + (std::f64::consts::PI * share).cos()).max(1e-3)
    }
}

/// Refuses a loss that is not a number.
pub(super) fn finite(loss: f32, epoch: usize) -> Result<f32, TrainError> {
    if loss.is_finite() {
        Ok(loss)
    } else {
        Err(TrainError::Diverged {
            epoch: epoch + 1,
            loss,
        })
    }
}
