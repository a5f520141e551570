//! Our own method: damped springs and an LSTM over inertial features, materials and the body's build,
//! read out into a basis for each block of the body.

mod blocks;
mod build;
mod compliance;
mod config;
mod export;
mod lanes;
mod locality;
mod predictor;
mod prepare;
mod spin;
mod thickness;
mod trainer;

pub use blocks::{Block, BlockBasis, Part, partition};
pub use build::{Build, TissueMeasure};
pub use compliance::Compliance;
pub use config::TrainConfig;
pub use export::{decoder_onnx, predictor_onnx};
pub use lanes::Sequence;
pub use locality::Locality;
pub use predictor::{Predictor, PredictorSizes, PredictorState};
pub use prepare::{Hearing, Prepared, prepare};
pub use spin::Spin;
pub use thickness::Thickness;
pub use trainer::{BlockSize, PredictorData, train};
