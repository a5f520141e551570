//! Training of dynaskin's models: from a folder of clips to ONNX files and a bundle.
//!
//! The offsets' principal components give the decoder; damped springs and an LSTM learn to predict
//! their coefficients from the runtime's own features. Held-out clips are then played through the
//! exported files by the runtime itself, and the errors go into the bundle and the model card.

mod blocks;
mod build;
mod bundle;
mod card;
mod checkpoint;
mod config;
mod data;
mod epochs;
mod error;
mod evaluate;
mod export;
#[cfg(test)]
mod fixture;
mod lanes;
mod locality;
mod methods;
mod mirror;
mod normaliser;
mod pca;
mod placement;
mod player;
mod predictor;
mod prepare;
mod split;
pub mod study;
mod trainer;

pub use blocks::{Block, BlockBasis, Part, partition};
pub use build::Build;
pub use bundle::{BundleParts, TrainingFacts, write_bundle};
pub use card::model_card;
pub use checkpoint::{Checkpoint, EpochRecord};
pub use config::TrainConfig;
pub use data::{ClipEntry, DataSet, Tissue, motion_features};
pub use dynaskin_onnx_writer::Precision;
pub use error::TrainError;
pub use evaluate::{Errors, LinearDecoder, Report, SetReport, evaluate};
pub use export::{decoder_onnx, predictor_onnx};
pub use lanes::Sequence;
pub use locality::Locality;
pub use methods::dsnet;
pub use methods::{
    AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, CasasOtaduyProgress, DmplConfig,
    Method, Networks, RegressorConfig, RunFolder, SpringBonesConfig, SubspaceErrors, TrainingInput,
    compare_subspaces, train_casas_otaduy, train_dmpl, train_spring_bones,
};
pub use mirror::Mirror;
pub use normaliser::Normaliser;
pub use pca::Basis;
pub use placement::{Placement, PlacementErrors, evaluate_placements};
pub use player::Player;
pub use predictor::{Predictor, PredictorSizes, PredictorState};
pub use prepare::{Prepared, prepare};
pub use split::{ClipName, Set, Split};
pub use trainer::{BlockSize, PredictorData, train};
