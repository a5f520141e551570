//! A small made-up body and bundle, so that tests need no trained files.

#![allow(dead_code)] // Each test file uses its own part.

use std::sync::Arc;

use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, POSE_DIR_COUNT, Pose, REGION_COUNT, SHAPE_COUNT, SkinWeights,
};
use dynaskin_onnx::{Graph, LstmWeights, Precision, Value, WriteError};
use dynaskin_runtime::features::{FeatureKind, INERTIAL_FEATURE_COUNT};
use dynaskin_runtime::{Bundle, BundleFile, Learned, Model, RuntimeError};
use glam::{DQuat, DVec3, Vec3};

/// How large the made-up body and networks are.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Rings of vertices from the floor to the top, a multiple of 12.
    pub rings: usize,
    /// Vertices of a ring.
    pub segments: usize,
    /// Cells of the LSTM.
    pub cells: usize,
    /// L.
    pub latents: usize,
}

/// For tests.
pub const SMALL: Size = Size {
    rings: 12,
    segments: 8,
    cells: 6,
    latents: 4,
};

/// About as large as the shipped models.
pub const LARGE: Size = Size {
    rings: 84,
    segments: 82,
    cells: 128,
    latents: 64,
};

/// Made-up numbers in -1..1.
pub fn numbers(seed: usize, count: usize) -> Vec<f32> {
    (0..count)
        .map(|idx| ((seed * 7919 + idx * 104_729) as f32 * 0.618_034).sin())
        .collect()
}

/// The variant of an error.
pub fn kind(error: &RuntimeError) -> String {
    let text = format!("{error:?}");
    text.split([' ', '(']).next().unwrap_or_default().to_owned()
}

/// A tube from the floor to 1.8 m; the rings in the middle are belly, the topmost is skull.
pub fn body() -> BodyModel {
    body_of(SMALL)
}

/// As [`body`], in another size.
pub fn body_of(size: Size) -> BodyModel {
    let (rings, segments) = (size.rings, size.segments);
    let mut template_m = Vec::new();
    let mut skin = Vec::new();
    let mut region_weights = vec![Vec::new(); REGION_COUNT];
    for ring in 0..rings {
        let twelfth = 12 * ring / rings;
        let height = 1.8 * ring as f32 / (rings - 1) as f32;
        for segment in 0..segments {
            let angle = std::f32::consts::TAU * segment as f32 / segments as f32;
            template_m.push(Vec3::new(0.2 * angle.cos(), height, 0.15 * angle.sin()));
            let upper = if twelfth < 6 {
                Joint::Pelvis
            } else {
                Joint::Spine2
            };
            let lower = if twelfth < 6 {
                Joint::LeftHip
            } else {
                Joint::Pelvis
            };
            skin.push(SkinWeights {
                joints: [upper as u8, lower as u8, 0, 0],
                weights: [0.75, 0.25, 0.0, 0.0],
            });
            for (region, weights) in region_weights.iter_mut().enumerate() {
                let chest = region == 0 && (7..=8).contains(&twelfth);
                let belly = region == 1 && (4..=7).contains(&twelfth);
                weights.push(if chest || belly { 0.5 } else { 0.0 });
            }
        }
    }
    let at = |ring: usize, segment: usize| (ring * segments + segment % segments) as u32;
    let mut faces = Vec::new();
    for ring in 0..rings - 1 {
        for segment in 0..segments {
            let (a, b) = (at(ring, segment), at(ring, segment + 1));
            let (c, d) = (at(ring + 1, segment), at(ring + 1, segment + 1));
            faces.push([a, c, b]);
            faces.push([b, c, d]);
        }
    }
    let shape_dirs_m = (0..SHAPE_COUNT)
        .map(|k| {
            template_m
                .iter()
                .map(|p| *p * 0.01 * (k + 1) as f32)
                .collect()
        })
        .collect();
    let joint_template_m: [Vec3; JOINT_COUNT] = std::array::from_fn(|joint| {
        let side = (joint % 3) as f32 - 1.0;
        Vec3::new(0.1 * side, 0.5 + 0.05 * joint as f32, 0.0)
    });
    BodyModel {
        name: "tube".to_owned(),
        copyright: String::new(),
        joint_shape_dirs_m: (0..SHAPE_COUNT)
            .map(|k| joint_template_m.map(|j| j * 0.01 * (k + 1) as f32))
            .collect(),
        joint_template_m,
        faces,
        shape_dirs_m,
        pose_dirs_m: Vec::new(),
        skin,
        thickness_template_m: Vec::new(),
        thickness_shape_dirs_m: Vec::new(),
        region_weights,
        colors_srgba: Vec::new(),
        template_m,
    }
}

/// As [`body_of`], with pose correctives of some millimetres.
pub fn corrected_body_of(size: Size) -> BodyModel {
    let mut body = body_of(size);
    let count = body.vertex_count();
    let field = |field: usize| {
        let numbers = numbers(40 + field, 3 * count);
        let dirs = numbers.as_chunks::<3>().0.iter();
        dirs.map(|xyz| 0.004 * Vec3::from_array(*xyz)).collect()
    };
    body.pose_dirs_m = (0..POSE_DIR_COUNT).map(field).collect();
    body
}

/// The vertices that the made-up decoder moves: the middle rings and, wrongly, the topmost.
pub fn vertices() -> Vec<u32> {
    vertices_of(SMALL)
}

/// Of the given size.
pub fn vertices_of(size: Size) -> Vec<u32> {
    let twelfth = size.rings / 12 * size.segments;
    let middle = 3 * twelfth..9 * twelfth;
    let top = 11 * twelfth..12 * twelfth;
    middle.chain(top).map(|v| v as u32).collect()
}

/// An LSTM over normalised features, then a dense layer.
pub fn predictor_onnx() -> Vec<u8> {
    predictor_of(SMALL)
}

/// Of the given size.
pub fn predictor_of(size: Size) -> Vec<u8> {
    let (cells, latents) = (size.cells, size.latents);
    let build = || -> Result<Vec<u8>, WriteError> {
        let features = INERTIAL_FEATURE_COUNT;
        let gates = 4 * cells;
        let mut graph = Graph::new("predictor");
        let input = graph.input("features", &[1, features])?;
        let hidden = graph.input("state_h", &[1, cells])?;
        let cell = graph.input("state_c", &[1, cells])?;
        let mut weights = |name: &str, shape: &[usize], seed, size: f32| {
            let list = numbers(seed, shape.iter().product());
            let list: Vec<f32> = list.iter().map(|n| n * size).collect();
            graph.weights(name, shape, &list, Precision::Single)
        };
        let scale = weights("scale", &[features], 1, 0.05)?;
        let from_input = weights("w", &[features, gates], 2, 0.3)?;
        let from_hidden = weights("r", &[cells, gates], 3, 0.5)?;
        let bias = weights("b", &[gates], 4, 0.2)?;
        let dense: Value = weights("dense", &[cells, latents], 5, 1.0)?;
        let dense_bias = weights("dense_bias", &[latents], 6, 0.1)?;
        let x = graph.mul(&input, &scale)?;
        let weights = LstmWeights {
            from_input: &from_input,
            from_hidden: &from_hidden,
            bias: &bias,
        };
        let (next_hidden, next_cell) = graph.lstm_cell(&x, &hidden, &cell, weights)?;
        let latent = graph.dense(&next_hidden, &dense, &dense_bias)?;
        graph.output("state_h_out", &next_hidden)?;
        graph.output("latent", &latent)?;
        graph.output("state_c_out", &next_cell)?;
        Ok(graph.into_bytes())
    };
    build().expect("the made-up predictor is a valid graph")
}

/// A dense layer, stored in half precision.
pub fn decoder_onnx() -> Vec<u8> {
    decoder_of(SMALL)
}

/// Of the given size.
pub fn decoder_of(size: Size) -> Vec<u8> {
    let latents = size.latents;
    let vertices = vertices_of(size).len();
    let build = || -> Result<Vec<u8>, WriteError> {
        let count = 3 * vertices;
        let mut graph = Graph::new("decoder");
        let latent = graph.input("latent", &[1, latents])?;
        let basis: Vec<f32> = numbers(7, latents * count)
            .iter()
            .map(|n| n * 0.1)
            .collect();
        let basis = graph.weights("basis", &[latents, count], &basis, Precision::Half)?;
        let mean: Vec<f32> = numbers(8, count).iter().map(|n| n * 0.01).collect();
        let mean = graph.weights("mean", &[count], &mean, Precision::Single)?;
        let flat = graph.dense(&latent, &basis, &mean)?;
        let offsets = graph.reshape(&flat, &[1, vertices, 3])?;
        graph.output("offsets", &offsets)?;
        Ok(graph.into_bytes())
    };
    build().expect("the made-up decoder is a valid graph")
}

pub fn bundle(predictor: &[u8], decoder: &[u8]) -> Bundle {
    bundle_of(SMALL, predictor, decoder)
}

/// Of the given size.
pub fn bundle_of(size: Size, predictor: &[u8], decoder: &[u8]) -> Bundle {
    Bundle {
        format: "dynaskin-bundle".to_owned(),
        version: 2,
        name: "tube".to_owned(),
        rate_hz: 60.0,
        body: BundleFile::of("body.glb", b"made in memory"),
        predictor: BundleFile::of("predictor.onnx", predictor),
        decoder: BundleFile::of("decoder.onnx", decoder),
        lowered: None,
        feature_kind: FeatureKind::Inertial,
        feature_count: INERTIAL_FEATURE_COUNT,
        latent_count: size.latents,
        learned: Learned::USUAL,
        traits: Vec::new(),
        vertices: vertices_of(size),
        training: Default::default(),
        measured: Default::default(),
        licence: "made up".to_owned(),
    }
}

pub fn model() -> Arc<Model> {
    model_of(SMALL)
}

/// As [`model`], in another size.
pub fn model_of(size: Size) -> Arc<Model> {
    model_with(size, body_of(size))
}

/// Of a body of this size.
pub fn model_with(size: Size, body: BodyModel) -> Arc<Model> {
    let (predictor, decoder) = (predictor_of(size), decoder_of(size));
    let bundle = bundle_of(size, &predictor, &decoder);
    let model = Model::from_parts(bundle, Arc::new(body), &predictor, &decoder);
    Arc::new(model.expect("the made-up bundle loads"))
}

/// A made-up motion of limited violence, smooth in time.
pub fn pose_at(time_seconds: f64) -> Pose {
    let t = time_seconds;
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(0.2 * (3.0 * t).sin(), 0.1 * (9.0 * t).cos(), 0.3 * t);
    for joint in Joint::ALL {
        let idx = f64::from(joint as u8);
        let axis = DVec3::new(idx.sin(), 1.0, (2.0 * idx).cos()).normalize();
        pose.parent_from_joint[joint as usize] =
            DQuat::from_axis_angle(axis, 0.25 * (4.0 * t + idx).sin());
    }
    pose
}
