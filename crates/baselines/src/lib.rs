//! The methods that dynaskin is compared with, trained on its data by its training loop.
//!
//! Nothing of ours depends on them. Each returns [`Networks`](dynaskin_train::Networks),
//! which become a bundle like ours.

mod casas_otaduy;
mod dmpl;
pub mod dsnet;
mod spring_bones;

pub use casas_otaduy::{
    AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, CasasOtaduyProgress, RegressorConfig,
    RunFolder, SubspaceErrors, compare_subspaces, train_casas_otaduy,
};
pub use dmpl::{DmplConfig, train_dmpl};
pub use spring_bones::{SpringBonesConfig, train_spring_bones};
