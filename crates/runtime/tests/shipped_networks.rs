//! The networks in `models/`, those of the compared methods among them, run on a hop by tract and by
//! onnxruntime: the same numbers.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod plain_tract;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::Result;
use dynaskin_body::{BodyModel, SHAPE_COUNT};
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::Bundle;
use dynaskin_runtime::features::{Materials, clip_features};
use plain_tract::PlainTract;
use serde_json::{Value, json};

/// Long enough for a flight and a landing.
const TICKS: usize = 90;

/// Latents and offsets may differ by this share of the largest number of their kind.
const TOLERANCE: f64 = 1e-4;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every bundle of a body: the default one, and those of the compared methods.
fn bundles(body_folder: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = vec![body_folder.to_owned()];
    let methods = body_folder.join("methods");
    if methods.is_dir() {
        let entries = std::fs::read_dir(methods)?.map(|entry| Ok(entry?.path()));
        folders.extend(entries.collect::<Result<Vec<_>>>()?);
    }
    folders.retain(|folder| folder.join("bundle.json").is_file());
    folders.sort();
    Ok(folders)
}

/// Features of a hop on the body of `body_folder`, one row a tick.
fn hop_features(folder: &Path, body_folder: &Path) -> Result<Vec<Vec<f32>>> {
    let kind = Bundle::from_json(&std::fs::read(folder.join("bundle.json"))?)?.feature_kind;
    let body = BodyModel::from_glb(&std::fs::read(body_folder.join("body.glb"))?)?;
    let shape = [0.0; SHAPE_COUNT];
    let joints_m = body.shaped(&shape).joints_m;
    let clip = Procedural::new(ProceduralKind::Hop).clip(&joints_m)?;
    let features = clip_features(
        kind,
        &clip.frames,
        clip.rate_hz,
        &joints_m,
        &shape,
        &Materials::default(),
    )?;
    let width = kind.count();
    Ok(features
        .chunks(width)
        .take(TICKS)
        .map(<[f32]>::to_vec)
        .collect())
}

/// Latent and offsets of every tick.
fn run_tract(folder: &Path, features: &[Vec<f32>]) -> Value {
    let mut networks = PlainTract::load(folder);
    let latents: Vec<Vec<f32>> = features.iter().map(|row| networks.tick(row)).collect();
    let offsets_m: Vec<Vec<f32>> = latents.iter().map(|row| networks.decode(row)).collect();
    json!({ "latents": latents, "offsets_m": offsets_m })
}

/// Needs Python with the packages onnx, onnxruntime and numpy: `DYNASKIN_PYTHON` names the
/// interpreter, else `python3`.
#[test]
fn shipped_networks_give_onnxruntimes_numbers() {
    let python = std::env::var("DYNASKIN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let packages = Command::new(&python)
        .args(["-c", "import onnx, onnxruntime, numpy"])
        .output();
    if !packages.is_ok_and(|output| output.status.success()) {
        println!(
            "skipped: shipped_networks_give_onnxruntimes_numbers needs Python with onnx, \
             onnxruntime and numpy"
        );
        return;
    }
    let bodies = ["female", "male"].map(|name| repository().join("models").join(name));
    let bundles = bodies.iter().flat_map(|body| {
        let folders = bundles(body).unwrap();
        folders.into_iter().map(move |folder| (folder, body))
    });
    for (folder, body_folder) in bundles {
        let name = folder.strip_prefix(repository()).unwrap().display();
        let features = hop_features(&folder, body_folder).unwrap();
        let mut case = run_tract(&folder, &features);
        case["features"] = json!(features);
        case["tolerance"] = json!(TOLERANCE);

        let mut script = Command::new(&python)
            .arg(repository().join("tests/python/onnx_parity.py"))
            .arg(&folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdin = script.stdin.take().unwrap();
        stdin.write_all(case.to_string().as_bytes()).unwrap();
        drop(stdin);
        let output = script.wait_with_output().unwrap();
        println!("{name}: {}", String::from_utf8_lossy(&output.stdout).trim());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {stderr}");
    }
}
