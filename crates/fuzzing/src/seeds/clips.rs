//! Clips of the data set.

use dynaskin_sim::{ClipData, drawn_materials};
use half::f16;

use crate::stage;

/// A clip of three frames, and one of one.
pub fn clips() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    let path = folder.path().join("clip.safetensors");
    [3, 1]
        .into_iter()
        .map(|frames| {
            clip(frames).write(&path).expect("the made-up clip is one");
            std::fs::read(&path).expect("it was written")
        })
        .collect()
}

fn clip(frames: usize) -> ClipData {
    ClipData {
        name: "hop__s1".to_owned(),
        body_sha256: "ab".repeat(32),
        rate_hz: 60.0,
        seed: 7,
        sim_json: r#"{"substeps":24}"#.to_owned(),
        materials: drawn_materials("hop", 7),
        shape: std::array::from_fn(|k| k as f32 * 0.5 - 1.0),
        vertices: vec![3, 9, 20],
        poses: (0..frames).map(stage::pose_at).collect(),
        offsets_rest_m: (0..9 * frames)
            .map(|k| f16::from_f32(k as f32 * 1e-3))
            .collect(),
    }
}
