//! Binary glTF files made of BVH motions.

use dynaskin_motion::{Bvh, SourceMotion};
use glam::DQuat;
use serde_json::{Value, json};

/// How the rotations are stored.
#[derive(Clone, Copy, PartialEq)]
pub enum Storage {
    Float,
    ShortInteger,
    Spline,
}

/// A GLB of the motion of a BVH file at 60 frames a second. Every node's own axes are turned
/// differently; an armature above turns and scales them by a hundredth.
pub struct GlbFile {
    /// The document, to be changed by tests.
    pub json: Value,
    /// The buffer.
    pub binary: Vec<u8>,
}

impl GlbFile {
    pub fn new(bvh: &Bvh, storage: Storage) -> Self {
        let armature = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let axes = |joint: usize| {
            let angle = |k: f64| 2.5 * (1.3 * joint as f64 + k).sin();
            DQuat::from_rotation_y(angle(0.0)) * DQuat::from_rotation_x(angle(1.0))
        };
        let axes_above = |joint: usize| bvh.joints[joint].parent.map_or(armature, axes);
        let count = bvh.frame_count();
        let mut file = Self {
            json: Value::Null,
            binary: Vec::new(),
        };
        let (mut views, mut accessors) = (Vec::new(), Vec::new());
        let mut accessor = |bytes: Vec<u8>, component: u32, kind: &str, count: usize| {
            views.push(json!({
                "buffer": 0, "byteOffset": file.binary.len(), "byteLength": bytes.len()
            }));
            file.binary.extend(bytes);
            accessors.push(json!({
                "bufferView": views.len() - 1, "componentType": component, "type": kind,
                "count": count, "normalized": component != 5126
            }));
            accessors.len() - 1
        };
        let floats = |values: Vec<f32>| -> Vec<u8> {
            values.into_iter().flat_map(f32::to_le_bytes).collect()
        };
        let times = (0..count).map(|frame| 0.5 + frame as f32 / 60.0).collect();
        let times = accessor(floats(times), 5126, "SCALAR", count);
        let (mut channels, mut samplers) = (Vec::new(), Vec::new());
        let mut nodes = Vec::new();
        for (joint, source) in bvh.joints.iter().enumerate() {
            let turn = axes_above(joint).inverse();
            let children: Vec<usize> = (0..bvh.joints.len())
                .filter(|child| bvh.joints[*child].parent == Some(joint))
                .collect();
            let mut node = json!({
                "name": source.name,
                "translation": (turn * source.offset).to_array(),
                "rotation": (turn * axes(joint)).to_array(),
            });
            if !children.is_empty() {
                node["children"] = json!(children);
            }
            nodes.push(node);
            let spline = storage == Storage::Spline;
            let mut numbers: Vec<f64> = Vec::new();
            for frame in 0..count {
                let rotation = turn * bvh.parent_from_joint(frame, joint) * axes(joint);
                let tangent = [0.0; 4];
                numbers.extend(spline.then_some(tangent).into_iter().flatten());
                numbers.extend(rotation.to_array());
                numbers.extend(spline.then_some(tangent).into_iter().flatten());
            }
            let (bytes, component) = if storage == Storage::ShortInteger {
                let shorts = numbers.iter().map(|x| (x * 32767.0).round() as i16);
                (shorts.flat_map(i16::to_le_bytes).collect(), 5122)
            } else {
                (floats(numbers.iter().map(|x| *x as f32).collect()), 5126)
            };
            let output = accessor(bytes, component, "VEC4", numbers.len() / 4);
            let mut channel = |path: &str, output: usize, interpolation: &str| {
                samplers.push(json!({
                    "input": times, "output": output, "interpolation": interpolation
                }));
                channels.push(json!({
                    "sampler": samplers.len() - 1, "target": { "node": joint, "path": path }
                }));
            };
            let interpolation = if spline { "CUBICSPLINE" } else { "LINEAR" };
            channel("rotation", output, interpolation);
            if joint == 0 {
                let place = |frame| (turn * bvh.joint_in_parent(frame, 0)).to_array();
                let values = (0..count).flat_map(place).map(|x| x as f32).collect();
                let output = accessor(floats(values), 5126, "VEC3", count);
                channel("translation", output, "LINEAR");
            }
        }
        nodes.push(json!({
            "name": "Armature", "children": [0], "rotation": armature.to_array(),
            "scale": [0.01, 0.01, 0.01]
        }));
        file.json = json!({
            "asset": { "version": "2.0" },
            "nodes": nodes,
            "buffers": [{ "byteLength": file.binary.len() }],
            "bufferViews": views,
            "accessors": accessors,
            "animations": [
                { "name": "nothing", "channels": [], "samplers": [] },
                { "name": "as the BVH", "channels": channels, "samplers": samplers }
            ],
        });
        file
    }

    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + binary.len();
        let mut bytes = b"glTF".to_vec();
        bytes.extend(2_u32.to_le_bytes());
        bytes.extend((length as u32).to_le_bytes());
        for (chunk, kind) in [(json, b"JSON"), (binary, b"BIN\0")] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }
}
