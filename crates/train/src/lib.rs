//! Training of dynaskin's models: from a folder of clips to ONNX files and a bundle.
//!
//! The offsets' principal components give the decoder; damped springs and an LSTM learn to predict
//! their coefficients from the runtime's own features. Held-out clips are then played through the
//! exported files by the runtime itself, and the errors go into the bundle and the model card.

mod bundle;
mod card;
mod checkpoint;
mod compute;
mod data;
mod epochs;
mod error;
mod evaluate;
#[cfg(test)]
mod fixture;
mod methods;
mod mirror;
mod normaliser;
mod pca;
mod placement;
mod player;
mod sample;
mod settings;
mod split;
pub mod study;

pub use bundle::{BundleParts, TrainingFacts, write_bundle};
pub use card::model_card;
pub use checkpoint::{Checkpoint, EpochRecord};
pub use compute::Compute;
pub use data::{ClipEntry, DataSet, Tissue, motion_features};
pub use dynaskin_onnx::Precision;
pub use error::TrainError;
pub use evaluate::{Errors, LinearDecoder, Report, SetReport, evaluate};
pub use methods::dsnet;
pub use methods::dynaskin::{
    Block, BlockBasis, BlockSize, Build, Compliance, Hearing, Locality, Part, Predictor,
    PredictorData, PredictorSizes, PredictorState, Prepared, Sequence, Spin, Thickness,
    TissueMeasure, TrainConfig, decoder_onnx, partition, predictor_onnx, prepare, train,
};
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
pub use split::{ClipName, Set, Split};
