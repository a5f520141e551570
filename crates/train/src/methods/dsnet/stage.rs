//! What training the autoencoder and training the predictor have in common: epochs, the best of
//! them, checkpoints, resuming.

use std::path::Path;
use std::time::Instant;

use burn::module::Module;
use burn::optim::{AdamConfig, ModuleOptimizer};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::TrainError;
use crate::checkpoint::Checkpoint;

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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageEpoch {
    /// The network.
    pub stage: Stage,
    /// The epoch, from 1.
    pub epoch: usize,
    /// Of how many.
    pub epochs: usize,
    /// Mean loss while training.
    pub training_loss: f32,
    /// Mean loss on the validation set.
    pub validation_loss: f32,
    /// The same over that of no offset at all.
    pub validation_ratio: f32,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// Losses of one epoch: training, validation, and validation over static.
pub(super) struct Losses {
    pub training: f32,
    pub validation: f32,
    pub ratio: f32,
}

/// Folder, settings and length of a stage.
pub(super) struct Run<'a> {
    pub stage: Stage,
    pub folder: &'a Path,
    /// What must be the same for a run to be resumed.
    pub settings: Value,
    pub epochs: usize,
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
    /// least validation loss. `epoch` is told the epoch (from 0) and takes the model through it.
    pub fn train<M: Module>(
        &self,
        model: M,
        mut epoch: impl FnMut(usize, M, &mut ModuleOptimizer) -> Result<(M, Losses), TrainError>,
        progress: &mut dyn FnMut(&StageEpoch),
    ) -> Result<Trained<M>, TrainError> {
        let checkpoint = Checkpoint::new(self.folder)?;
        // An untrained copy to load the best weights into.
        let fresh = model.valid();
        let mut model = model;
        let mut optimizer = AdamConfig::new().with_epsilon(1e-8).init();
        let mut history: Vec<StageEpoch> = Vec::new();
        if self.resume && checkpoint.holds_run() {
            let same = |earlier: Value| earlier == self.settings;
            (model, history) = checkpoint.load(model, &mut optimizer, same)?;
        } else {
            checkpoint.clear()?;
        }
        for index in history.len()..self.epochs {
            let start = Instant::now();
            let (next, losses) = epoch(index, model, &mut optimizer)?;
            model = next;
            let record = StageEpoch {
                stage: self.stage,
                epoch: index + 1,
                epochs: self.epochs,
                training_loss: losses.training,
                validation_loss: losses.validation,
                validation_ratio: losses.ratio,
                seconds: start.elapsed().as_secs_f64(),
            };
            let best = history
                .iter()
                .all(|earlier| record.validation_loss < earlier.validation_loss);
            history.push(record.clone());
            checkpoint.save(&model, &optimizer, &self.settings, &history, best)?;
            progress(&record);
        }
        let best = history
            .iter()
            .min_by(|a, b| a.validation_loss.total_cmp(&b.validation_loss));
        Ok(Trained {
            best_epoch: best.map_or(0, |best| best.epoch),
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
