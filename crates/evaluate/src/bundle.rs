//! A bundle's folder: the ONNX files, `bundle.json` and the model card.

use std::fs;
use std::path::Path;

use dynaskin_motion::MODEL_RATE_HZ;
use dynaskin_runtime::{BUNDLE_FORMAT, BUNDLE_VERSION, Bundle, BundleFile};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::card::model_card;
use crate::method::Method;
use crate::report::Report;
use dynaskin_train::TrainError;
use dynaskin_train::{Networks, Split};

const BODY_FILE: &str = "body.glb";
const PREDICTOR_FILE: &str = "predictor.onnx";
const DECODER_FILE: &str = "decoder.onnx";
const LICENCE: &str = "MIT OR Apache-2.0";

/// How a model came to be, as it stands under `training` in `bundle.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingFacts {
    /// The method.
    pub method: Method,
    /// What the networks are, in words.
    pub networks: String,
    /// The data in words.
    pub data: String,
    /// Seed of the run (also in `config`; here where every bundle has it).
    pub seed: u64,
    /// Clips learned from, not counting mirror images made while training.
    pub clips: usize,
    /// Their frames.
    pub frames: usize,
    /// Frames that decided which epoch to keep.
    pub validation_frames: usize,
    /// Number of vertices with offsets.
    pub vertices: usize,
    /// Number of trained weights of predictor and decoder.
    pub parameters: usize,
    /// The epoch whose weights these are, from 1.
    pub best_epoch: usize,
    /// Minutes of training.
    pub minutes: f64,
    /// Settings.
    pub config: Value,
    /// What was held out.
    pub split: Split,
    /// Settings of the simulator.
    pub simulator: Value,
}

/// The parts of a bundle that training makes.
#[derive(Debug)]
pub struct BundleParts<'a> {
    /// Name, such as `female`.
    pub name: &'a str,
    /// The body GLB that the clips were simulated on.
    pub body_glb: &'a [u8],
    /// Whether to write the body, too; bundles of one body may share one in another folder.
    pub with_body: bool,
    /// The networks.
    pub networks: &'a Networks,
    /// Body vertices that have offsets, ascending.
    pub vertices: &'a [u32],
    /// How it came to be.
    pub training: &'a TrainingFacts,
}

/// Writes the files of a bundle, measured by `report`, into the folder `dir`.
///
/// # Errors
/// [`TrainError::Io`], [`TrainError::Runtime`] for numbers that JSON cannot hold.
pub fn write_bundle(
    dir: &Path,
    parts: &BundleParts<'_>,
    report: &Report,
) -> Result<(), TrainError> {
    fs::create_dir_all(dir).map_err(TrainError::io(dir, "making the folder"))?;
    let networks = parts.networks;
    let body = dir.join(BODY_FILE);
    if parts.with_body && fs::read(&body).ok().as_deref() != Some(parts.body_glb) {
        write(&body, parts.body_glb)?;
    }
    write(&dir.join(PREDICTOR_FILE), &networks.predictor_onnx)?;
    write(&dir.join(DECODER_FILE), &networks.decoder_onnx)?;
    let bundle = Bundle {
        format: BUNDLE_FORMAT.into(),
        version: BUNDLE_VERSION,
        name: parts.name.into(),
        rate_hz: MODEL_RATE_HZ,
        body: BundleFile::of(BODY_FILE, parts.body_glb),
        predictor: BundleFile::of(PREDICTOR_FILE, &networks.predictor_onnx),
        decoder: BundleFile::of(DECODER_FILE, &networks.decoder_onnx),
        feature_kind: networks.feature_kind,
        feature_count: networks.feature_kind.count(),
        latent_count: networks.latent_count,
        vertices: parts.vertices.to_vec(),
        training: object(parts.training),
        measured: object(report),
        licence: LICENCE.into(),
    };
    write(&dir.join("bundle.json"), bundle.to_json()?.as_bytes())?;
    let card = model_card(parts.name, LICENCE, parts.training, report);
    write(&dir.join("MODEL_CARD.md"), card.as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), TrainError> {
    fs::write(path, bytes).map_err(TrainError::io(path, "writing"))
}

/// A struct as a JSON object; structs with finite numbers and text keys always are one.
fn object(value: impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(value) {
        Ok(Value::Object(object)) => object,
        _ => Map::new(),
    }
}
