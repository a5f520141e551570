//! The runtime of dynaskin: takes a skeleton's motion and returns offsets of the soft tissue.
//!
//! A [`Model`] is a body with its two networks, checked against each other; an [`Avatar`] is one
//! instance of it. In each display frame the host passes a pose and the time since the last frame:
//!
//! ```no_run
//! # use std::sync::Arc;
//! # use dynaskin_body::Pose;
//! # use dynaskin_runtime::{Avatar, Model, RuntimeError};
//! # fn run(bundle_json: &[u8], next_pose: impl Fn() -> Option<Pose>) -> Result<(), RuntimeError> {
//! let mut read = |file: &str| std::fs::read(file).map_err(|error| error.to_string());
//! let model = Arc::new(Model::load(bundle_json, &mut read)?);
//! let mut avatar = Avatar::new(model, &[0.0; 10])?;
//! while let Some(pose) = next_pose() {
//!     avatar.step(&pose, 1.0 / 60.0)?;
//!     let offsets_rest_m = avatar.offsets_rest_m();
//! #   let _ = offsets_rest_m;
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The networks tick at 60 Hz whatever the host's rate, and the surface is one tick behind the
//! host (see [`Avatar`]). This crate opens no file and depends on no JavaScript and no GPU.

mod avatar;
mod bundle;
mod controls;
mod crowd;
mod error;
pub mod features;
mod measure;
mod model;
mod networks;
#[cfg(feature = "tract")]
mod onnx;
mod pipeline;
mod ports;
mod pose;
mod shapes;
mod state;
mod surface;
mod timeline;
mod tissue;

pub use avatar::{Avatar, Decoding, MAX_SCALE, MIN_SCALE, StepReport};
pub use bundle::{BUNDLE_FORMAT, BUNDLE_VERSION, Bundle, BundleFile, Learned, LoweredFiles};
pub use controls::{
    Controls, MAX_GAIN, MAX_RESPONSE, OFFSET_LIMIT_M, REGION_LIMITS_M, RegionControls,
};
pub use crowd::{Crowd, CrowdReport, LevelOfDetail};
pub use dynaskin_body::{MAX_SHAPE_COEFFICIENT, Skinning};
pub use dynaskin_conditioning::{Diagnosis, PoseSource};
pub use dynaskin_skeleton::{
    CUT_ANGULAR_VELOCITY_CHANGE_RAD_S, CUT_VELOCITY_CHANGE_M_S, MAX_STEP_SECONDS,
};
pub use error::{Network, RuntimeError};
pub use model::Model;
#[cfg(feature = "tract")]
pub use networks::{Comparison, LoweredNetworks, lower};
pub use networks::{
    Decoder, DecoderSession, LinearDecoder, Predictor, PredictorSession, PredictorState,
};
pub use pipeline::{StageSeconds, Stopwatch};
pub use state::STATE_VERSION;
pub use timeline::{Detail, Settled};
pub use tissue::FADE_SECONDS;
