//! A bundle's folder: the ONNX files, `bundle.json` and the model card.

use std::fs;
use std::path::Path;

use dynaskin_body::Trait;
use dynaskin_motion::MODEL_RATE_HZ;
use dynaskin_runtime::{BUNDLE_FORMAT, BUNDLE_VERSION, Bundle, BundleFile, Learned};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::card::model_card;
use crate::facts::TrainingFacts;
use crate::report::Report;
use dynaskin_train::Networks;
use dynaskin_train::TrainError;

const BODY_FILE: &str = "body.glb";
const PREDICTOR_FILE: &str = "predictor.onnx";
const DECODER_FILE: &str = "decoder.onnx";
const CARD_FILE: &str = "MODEL_CARD.md";
const BUNDLE_FILE: &str = "bundle.json";
/// Of bundles that are made of simulated clips on the default bodies.
pub(crate) const LICENCE: &str = "MIT OR Apache-2.0";

/// The parts of a bundle that training makes.
#[derive(Debug)]
pub struct BundleParts<'a> {
    /// Name, such as `female`.
    pub name: &'a str,
    /// The body GLB of the clips.
    pub body_glb: &'a [u8],
    /// Its `asset.copyright`.
    pub body_copyright: &'a str,
    /// Whether to write the body, too; bundles of one body may share one in another folder.
    pub with_body: bool,
    /// The networks.
    pub networks: &'a Networks,
    /// Body vertices that have offsets, ascending.
    pub vertices: &'a [u32],
    /// What the networks learned from.
    pub learned: Learned,
    /// What the body's shapes look like; empty where it is not known.
    pub traits: &'a [Trait],
    /// How it came to be.
    pub training: &'a TrainingFacts,
}

/// Writes the files of a bundle, measured by `report`, into the folder `dir`. All are written aside
/// before the first is put in its place, and `bundle.json` comes last: a full disk leaves an earlier
/// bundle as it was.
///
/// # Errors
/// [`TrainError::Io`], [`TrainError::File`], [`TrainError::Runtime`] for numbers that JSON cannot hold.
pub fn write_bundle(
    dir: &Path,
    parts: &BundleParts<'_>,
    report: &Report,
) -> Result<(), TrainError> {
    fs::create_dir_all(dir).map_err(TrainError::io(dir, "making the folder"))?;
    let networks = parts.networks;
    let bundle = Bundle {
        format: BUNDLE_FORMAT.into(),
        version: BUNDLE_VERSION,
        name: parts.name.into(),
        rate_hz: MODEL_RATE_HZ,
        body: BundleFile::of(BODY_FILE, parts.body_glb),
        predictor: BundleFile::of(PREDICTOR_FILE, &networks.predictor_onnx),
        decoder: BundleFile::of(DECODER_FILE, &networks.decoder_onnx),
        lowered: None,
        feature_kind: networks.feature_kind,
        feature_count: networks.feature_kind.count(),
        latent_count: networks.latent_count,
        learned: parts.learned.clone(),
        traits: parts.traits.to_vec(),
        vertices: parts.vertices.to_vec(),
        training: object(parts.training),
        measured: object(report),
        licence: licence(parts.body_copyright, parts.training),
    };
    let json = bundle.to_json()?;
    let card = model_card(&bundle, parts.training, report);
    let mut files: Vec<(&str, &[u8])> = vec![
        (PREDICTOR_FILE, &networks.predictor_onnx),
        (DECODER_FILE, &networks.decoder_onnx),
        (CARD_FILE, card.as_bytes()),
        (BUNDLE_FILE, json.as_bytes()),
    ];
    let has_body = || fs::read(dir.join(BODY_FILE)).ok().as_deref() == Some(parts.body_glb);
    if parts.with_body && !has_body() {
        files.insert(0, (BODY_FILE, parts.body_glb));
    }
    let paths: Vec<_> = files.iter().map(|(name, _)| dir.join(name)).collect();
    let files = paths.iter().zip(&files);
    let files: Vec<(&Path, &[u8])> = files.map(|(path, (_, bytes))| (&**path, *bytes)).collect();
    Ok(dynaskin_files::replace_all(&files)?)
}

/// Under what a bundle may be passed on. Only what was made here, from what nobody holds rights in, is ours to
/// license.
fn licence(body_copyright: &str, training: &TrainingFacts) -> String {
    let mut bound = Vec::new();
    if body_copyright.is_empty() {
        bound.push("The body's licence is not known".to_owned());
    } else if !body_copyright.starts_with("CC0") {
        bound.push(format!("The body is licensed {body_copyright}"));
    }
    if !training.is_simulated() {
        let captures = "The networks learned from captures and may be bound by their licence";
        bound.push(captures.to_owned());
    }
    match bound.is_empty() {
        true => LICENCE.to_owned(),
        false => bound.join(". "),
    }
}

/// A struct as a JSON object; structs with finite numbers and text keys always are one.
fn object(value: impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(value) {
        Ok(Value::Object(object)) => object,
        _ => Map::new(),
    }
}
