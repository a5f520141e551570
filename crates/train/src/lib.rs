//! Training of dynaskin's models: from a folder of clips to ONNX files.
//!
//! The offsets' principal components are the decoder; damped springs and an LSTM learn to predict
//! their coefficients from the runtime's own features. `dynaskin-baselines` trains the compared methods
//! on the same data with the same loop ([`EpochRun`]); `dynaskin-evaluate` plays held-out clips with
//! both.

mod checkpoint;
mod compute;
mod data;
mod dynaskin;
mod epochs;
mod error;
#[cfg(any(test, feature = "fixture"))]
#[doc(hidden)]
pub mod fixture;
mod mirror;
mod networks;
mod normaliser;
mod pca;
mod sample;
mod settings;
mod sources;
mod split;

pub use checkpoint::{Checkpoint, EpochRecord};
pub use compute::Compute;
pub use data::{ClipEntry, DataSet, Tissue, features_of, motion_features, motion_of, offsets_of};
pub use dynaskin::{
    Block, BlockBasis, BlockSize, Build, Compliance, Locality, LocalityMirror, Part, Predictor,
    PredictorData, PredictorInputs, PredictorSizes, PredictorState, Prepared, Sequence,
    SignedPermutation, Spin, Thickness, TissueMeasure, TrainConfig, Units, decoder_onnx, partition,
    predictor_onnx, prepare, train,
};
pub use dynaskin_onnx::Precision;
pub use epochs::{Course, EpochRun, PATIENCE_EPOCHS, Schedule, Validation, part};
pub use error::TrainError;
pub use mirror::Mirror;
pub use networks::{Networks, TrainingInput};
pub use normaliser::{Normaliser, rest_features};
pub use pca::Basis;
pub use sample::{Draw, mirrored_latents, sample_offsets};
pub use settings::within;
pub use split::{ClipName, Set, Split};
