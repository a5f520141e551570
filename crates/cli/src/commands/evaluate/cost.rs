//! What a method costs: numbers, bytes and time.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use anyhow::Context as _;

use super::bundles::Found;

/// What one method costs.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// Clips learned from; none where the bundle does not tell.
    pub clips: Option<u64>,
    /// Their frames.
    pub frames: Option<u64>,
    /// Trained weights; none where the bundle does not tell.
    pub parameters: Option<u64>,
    /// Bytes of both graphs.
    pub bytes: usize,
    /// Bytes of both graphs compressed with brotli.
    pub wire_bytes: usize,
    /// Milliseconds that predictor and decoder take for one avatar and frame, median, native.
    pub native_ms: [f64; 2],
    /// Milliseconds for both in wasm, where measured.
    pub wasm_ms: Option<f64>,
}

/// Measures a bundle; `features` are those of a clip for its kind, frame by frame.
pub fn of(
    found: &mut Found,
    features: &[f32],
    wasm_ms: &HashMap<String, f64>,
) -> anyhow::Result<Cost> {
    let told = |what: &str| found.bundle.training.get(what)?.as_u64();
    let mut cost = Cost {
        clips: told("clips"),
        frames: told("frames"),
        parameters: told("parameters"),
        native_ms: found.player.time_ms(features)?,
        wasm_ms: wasm_ms.get(&found.name).copied(),
        ..Cost::default()
    };
    for file in [&found.bundle.predictor.file, &found.bundle.decoder.file] {
        let path = found.folder.join(file);
        let bytes = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        cost.bytes += bytes.len();
        cost.wire_bytes += compressed(&bytes)?;
    }
    Ok(cost)
}

/// Length after brotli at its highest setting, as servers keep static files.
fn compressed(bytes: &[u8]) -> anyhow::Result<usize> {
    let parameters = brotli::enc::BrotliEncoderParams {
        quality: 11,
        lgwin: 24,
        ..Default::default()
    };
    let mut out = Vec::new();
    brotli::BrotliCompress(&mut &bytes[..], &mut out, &parameters)?;
    Ok(out.len())
}

/// Milliseconds in wasm by method, from the file that `npm run bench:methods` writes.
pub fn wasm_times(path: Option<&Path>) -> anyhow::Result<HashMap<String, f64>> {
    let Some(path) = path else {
        return Ok(HashMap::new());
    };
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| {
        format!(
            "{} should hold a JSON object of milliseconds by method, as `npm run bench:methods` \
             writes it",
            path.display()
        )
    })
}
