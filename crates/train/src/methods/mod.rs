//! The methods that are trained on the same data and compared in one table.

mod casas_otaduy;
mod dmpl;
pub mod dsnet;
pub mod dynaskin;
mod spring_bones;

use dynaskin_body::BodyModel;
use dynaskin_runtime::features::FeatureKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::TrainError;
use crate::compute::Compute;
use crate::data::{DataSet, Tissue};
use crate::split::Set;

pub use dmpl::{DmplConfig, train_dmpl};
pub use spring_bones::{SpringBonesConfig, train_spring_bones};

pub use casas_otaduy::{
    AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, CasasOtaduyProgress, RegressorConfig,
    RunFolder, SubspaceErrors, compare_subspaces, train_casas_otaduy,
};

/// A way to predict soft tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Damped springs per region, tuned on the training set: what avatars on the web have today.
    SpringBones,
    /// Principal components and a linear second-order auto-regression (Dyna, Pons-Moll et al. 2015;
    /// DMPL, Loper et al. 2015).
    Dmpl,
    /// Casas & Otaduy 2018, with the loss that weighs vertices by their rigidity (Eqs. 6-7).
    CasasOtaduy,
    /// The same without those weights.
    CasasOtaduyUnweighted,
    /// DSNet (Seo, Zou, Cordier 2021): shape enters at every step.
    Dsnet,
    /// Its variant whose radial basis functions set the LSTM's first state from the shape.
    DsnetRbf,
    /// Ours.
    Dynaskin,
}

impl Method {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::SpringBones,
        Self::Dmpl,
        Self::CasasOtaduy,
        Self::CasasOtaduyUnweighted,
        Self::Dsnet,
        Self::DsnetRbf,
        Self::Dynaskin,
    ];

    /// Name in commands and folders: `casas-otaduy-unweighted`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SpringBones => "spring-bones",
            Self::Dmpl => "dmpl",
            Self::CasasOtaduy => "casas-otaduy",
            Self::CasasOtaduyUnweighted => "casas-otaduy-unweighted",
            Self::Dsnet => "dsnet",
            Self::DsnetRbf => "dsnet-rbf",
            Self::Dynaskin => "dynaskin",
        }
    }

    /// Name in reports.
    pub const fn label(self) -> &'static str {
        match self {
            Self::SpringBones => "spring bones",
            Self::Dmpl => "Dyna / DMPL",
            Self::CasasOtaduy => "Casas-Otaduy",
            Self::CasasOtaduyUnweighted => "Casas-Otaduy, unweighted",
            Self::Dsnet => "DSNet",
            Self::DsnetRbf => "DSNet, RBF",
            Self::Dynaskin => "dynaskin",
        }
    }

    /// The method called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

/// What every method is given to train on.
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
    pub(crate) fn require(&self, sets: &[Set], kind: FeatureKind) -> Result<(), TrainError> {
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

/// The networks that a method made of its training data, of the contract in ARCHITECTURE.md.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_serialised_form() {
        for method in Method::ALL {
            let json = serde_json::to_value(method).expect("a name");
            assert_eq!(json, method.name());
            assert_eq!(Method::from_name(method.name()), Some(method));
        }
    }
}
