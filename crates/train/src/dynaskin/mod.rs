//! Our own method: damped springs and an LSTM over inertial features, materials and the body's build,
//! read out into a basis for each block of the body.

mod blocks;
mod build;
mod clamped;
mod compliance;
mod config;
mod export;
mod inputs;
mod lanes;
mod locality;
mod masks;
mod predictor;
mod prepare;
mod spin;
mod symmetry;
mod thickness;
mod trainer;

pub use blocks::{Block, BlockBasis, Part, partition};
pub use build::{Build, TissueMeasure};
pub use compliance::Compliance;
pub use config::TrainConfig;
pub use export::{decoder_onnx, predictor_onnx};
pub use inputs::PredictorInputs;
pub use lanes::Sequence;
pub use locality::{Locality, LocalityMirror, Units};
pub use predictor::{Predictor, PredictorSizes, PredictorState};
pub use prepare::{Prepared, prepare};
pub use spin::Spin;
pub use symmetry::SignedPermutation;
pub use thickness::Thickness;
pub use trainer::{BlockSize, PredictorData, train};
