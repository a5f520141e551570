//! What training the autoencoder and training the predictor have in common.

use burn::module::Module;
use burn::optim::AdamConfig;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use dynaskin_train::{Checkpoint, Course, EpochRecord, EpochRun, Schedule, TrainError};

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
    /// least validation loss.
    pub fn train<M: Module>(
        &self,
        model: M,
        course: impl Course<M>,
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
            learning_rate: self.learning_rate,
            schedule: Schedule::Cosine,
            resume: self.resume && checkpoint.holds_run(),
        };
        let optimizer = AdamConfig::new().with_epsilon(1e-8).init();
        let best = run.run(model, optimizer, course, |record| {
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
}
