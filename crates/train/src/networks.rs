//! Input and output of the training of every method, ours or a compared one.

use dynaskin_body::BodyModel;
use dynaskin_runtime::features::FeatureKind;
use serde_json::Value;

use crate::TrainError;
use crate::compute::Compute;
use crate::data::{DataSet, Tissue};
use crate::split::Set;

/// The input of every method's training.
#[derive(Clone, Copy, Debug)]
pub struct TrainingInput<'a> {
    /// The clips.
    pub data_set: &'a DataSet,
    /// The body that they were simulated on.
    pub body: &'a BodyModel,
    /// Seed of everything random: the same seed and data give the same weights on one machine.
    pub seed: u64,
    /// What to train on.
    pub compute: Compute,
}

impl TrainingInput<'_> {
    /// Refuses a data set whose `sets` are not all there, for networks with features of `kind`.
    ///
    /// # Errors
    /// [`TrainError::EmptySplit`].
    pub fn require(&self, sets: &[Set], kind: FeatureKind) -> Result<(), TrainError> {
        let tissue = Tissue::known_to(kind);
        for set in sets {
            if self.data_set.of_set(*set, tissue).next().is_none() {
                return Err(TrainError::EmptySplit {
                    set: set.name(),
                    clips: self.data_set.clips.len(),
                });
            }
        }
        Ok(())
    }
}

/// The networks that a method trained, in the contract of ARCHITECTURE.md.
#[derive(Clone, Debug)]
pub struct Networks {
    /// What the predictor takes as input.
    pub feature_kind: FeatureKind,
    /// The predictor's file.
    pub predictor_onnx: Vec<u8>,
    /// The decoder's file.
    pub decoder_onnx: Vec<u8>,
    /// Number of latents.
    pub latent_count: usize,
    /// Trained weights of predictor and decoder together.
    pub parameters: usize,
    /// What the networks are, in one or two sentences for the model card.
    pub description: String,
    /// Settings of the training, stored beside the weights.
    pub config: Value,
    /// The epoch of the predictor whose weights these are, from 1.
    pub best_epoch: usize,
}
