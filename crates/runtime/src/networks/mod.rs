//! The two networks and their runs. A run works on rows of numbers, one or many at once; whose
//! numbers they are is not known here.

mod decoder;
mod fused;
#[cfg(feature = "tract")]
mod graph;
#[cfg(feature = "tract")]
mod lower;
mod lowered;
mod plans;
mod predictor;
mod sessions;

pub(crate) use decoder::DecoderRow;
pub use decoder::{Decoder, DecoderSession};
pub use fused::LinearDecoder;
#[cfg(feature = "tract")]
pub use lower::{Comparison, LoweredNetworks, lower};
pub(crate) use lowered::{is_lowered, onnx_sha256};
pub(crate) use plans::BATCH;
pub(crate) use predictor::PredictorRow;
pub use predictor::{Predictor, PredictorSession, PredictorState};
pub(crate) use sessions::{AtRest, MAX_SETTLE_TICKS, Networks, Sessions, still};
