//! How a model came to be.

use dynaskin_train::Split;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::method::Method;

/// How a model came to be, as it stands under `training` in `bundle.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingFacts {
    /// The method.
    pub method: Method,
    /// What the networks are, in words.
    pub networks: String,
    /// The data in words.
    pub data: String,
    /// Seed of the run (also in `config`; here where every bundle has it).
    pub seed: u64,
    /// Clips learned from, not counting mirror images made while training.
    pub clips: usize,
    /// Their frames.
    pub frames: usize,
    /// Frames that decided which epoch to keep.
    pub validation_frames: usize,
    /// Number of vertices with offsets.
    pub vertices: usize,
    /// Number of trained weights of predictor and decoder.
    pub parameters: usize,
    /// The epoch whose weights these are, from 1.
    pub best_epoch: usize,
    /// Minutes of training.
    pub minutes: f64,
    /// Settings.
    pub config: Value,
    /// What was held out.
    pub split: Split,
    /// Settings of the simulator.
    pub simulator: Value,
}

impl TrainingFacts {
    /// Whether it learned from simulated clips; otherwise from fitted captures.
    pub fn is_simulated(&self) -> bool {
        self.simulator
            .as_object()
            .is_some_and(|settings| !settings.is_empty())
    }
}
