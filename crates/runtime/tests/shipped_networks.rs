//! The networks in `models/`, run on a hop by tract and by onnxruntime: the same numbers.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result};
use dynaskin_body::{BodyModel, SHAPE_COUNT};
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::features::{FeatureKind, clip_features};
use serde_json::{Value, json};
use tract_onnx::prelude::*;

/// Latents and offsets may differ by this share of the largest number of their kind.
const TOLERANCE: f64 = 1e-4;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// One ONNX file in tract as it comes, without this project's runtime around it.
struct Network {
    plan: Arc<TypedRunnableModel>,
    inputs: Vec<(String, usize)>,
    outputs: Vec<String>,
}

impl Network {
    fn load(path: &Path) -> Result<Self> {
        let model = tract_onnx::onnx().model_for_path(path)?;
        let outputs = model
            .outputs
            .iter()
            .map(|outlet| {
                model
                    .outlet_labels
                    .get(outlet)
                    .cloned()
                    .context("unnamed output")
            })
            .collect::<Result<_>>()?;
        let model = model.into_optimized()?;
        let inputs = model
            .input_outlets()?
            .iter()
            .map(|outlet| {
                let fact = model.outlet_fact(*outlet)?;
                let width = fact
                    .shape
                    .as_concrete()
                    .context("an input without fixed shape")?[1];
                Ok((model.node(outlet.node).name.clone(), width))
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            plan: model.into_runnable()?,
            inputs,
            outputs,
        })
    }

    fn run(&self, inputs: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
        let rows = inputs
            .iter()
            .map(|row| Ok(Tensor::from_shape(&[1, row.len()], row)?.into_tvalue()))
            .collect::<Result<TVec<TValue>>>()?;
        let outputs = self.plan.run(rows)?;
        outputs
            .iter()
            .map(|value| {
                let values = value.to_plain_array_view::<f32>()?;
                Ok(values.iter().copied().collect())
            })
            .collect()
    }
}

/// Features of a hop, one row a tick.
fn hop_features(folder: &Path) -> Result<Vec<Vec<f32>>> {
    let body = BodyModel::from_glb(&std::fs::read(folder.join("body.glb"))?)?;
    let shape = [0.0; SHAPE_COUNT];
    let joints_m = body.shaped(&shape).joints_m;
    let clip = Procedural::new(ProceduralKind::Hop).clip(&joints_m)?;
    let features = clip_features(FeatureKind::Inertial, &clip, &joints_m, &shape)?;
    let width = FeatureKind::Inertial.count();
    Ok(features
        .chunks(width)
        .take(180)
        .map(<[f32]>::to_vec)
        .collect())
}

/// Latent and offsets of every tick.
fn run_tract(folder: &Path, features: &[Vec<f32>]) -> Result<Value> {
    let predictor = Network::load(&folder.join("predictor.onnx"))?;
    let decoder = Network::load(&folder.join("decoder.onnx"))?;
    let mut inputs: Vec<Vec<f32>> = predictor
        .inputs
        .iter()
        .map(|(_, width)| vec![0.0; *width])
        .collect();
    let (mut latents, mut offsets_m) = (Vec::new(), Vec::new());
    for row in features {
        for (slot, (name, _)) in predictor.inputs.iter().enumerate() {
            if name == "features" {
                inputs[slot].clone_from(row);
            }
        }
        let outputs = predictor.run(&inputs)?;
        let output = |name: &str| {
            let place = predictor.outputs.iter().position(|other| other == name);
            place
                .map(|idx| outputs[idx].clone())
                .context(format!("no output {name}"))
        };
        for (slot, (name, _)) in predictor.inputs.iter().enumerate() {
            if name.starts_with("state_") {
                inputs[slot] = output(&format!("{name}_out"))?;
            }
        }
        let latent = output("latent")?;
        offsets_m.push(decoder.run(std::slice::from_ref(&latent))?.swap_remove(0));
        latents.push(latent);
    }
    Ok(json!({ "latents": latents, "offsets_m": offsets_m }))
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
    for name in ["female", "male"] {
        let folder = repository().join("models").join(name);
        let features = hop_features(&folder).unwrap();
        let mut case = run_tract(&folder, &features).unwrap();
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
