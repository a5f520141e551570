//! A small person who bends: as BVH, as binary glTF and as SMPL poses.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::container;

/// A joint: its name, its parent, and where it stands from that in metres.
struct Joint(&'static str, Option<usize>, [f32; 3]);

/// A person of 1.7 m with arms to the sides.
const PERSON: [Joint; 17] = [
    Joint("Hips", None, [0.0, 0.95, 0.0]),
    Joint("Spine", Some(0), [0.0, 0.12, 0.0]),
    Joint("Chest", Some(1), [0.0, 0.2, 0.0]),
    Joint("Neck", Some(2), [0.0, 0.2, 0.0]),
    Joint("Head", Some(3), [0.0, 0.12, 0.02]),
    Joint("LeftArm", Some(2), [0.18, 0.12, 0.0]),
    Joint("LeftForeArm", Some(5), [0.28, 0.0, 0.0]),
    Joint("LeftHand", Some(6), [0.25, 0.0, 0.0]),
    Joint("RightArm", Some(2), [-0.18, 0.12, 0.0]),
    Joint("RightForeArm", Some(8), [-0.28, 0.0, 0.0]),
    Joint("RightHand", Some(9), [-0.25, 0.0, 0.0]),
    Joint("LeftUpLeg", Some(0), [0.09, -0.05, 0.0]),
    Joint("LeftLeg", Some(11), [0.0, -0.42, 0.0]),
    Joint("LeftFoot", Some(12), [0.0, -0.4, 0.0]),
    Joint("RightUpLeg", Some(0), [-0.09, -0.05, 0.0]),
    Joint("RightLeg", Some(14), [0.0, -0.42, 0.0]),
    Joint("RightFoot", Some(15), [0.0, -0.4, 0.0]),
];

const FRAMES: usize = 4;

fn children(joint: usize) -> impl Iterator<Item = usize> {
    (0..PERSON.len()).filter(move |child| PERSON[*child].1 == Some(joint))
}

fn hierarchy(text: &mut String, joint: usize) {
    let Joint(name, parent, [x, y, z]) = &PERSON[joint];
    let kind = if parent.is_none() { "ROOT" } else { "JOINT" };
    let channels = match parent {
        None => "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        Some(_) => "3 Zrotation Xrotation Yrotation",
    };
    let _ = writeln!(
        text,
        "{kind} {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS {channels}"
    );
    for child in children(joint) {
        hierarchy(text, child);
    }
    if children(joint).next().is_none() {
        text.push_str("End Site\n{\nOFFSET 0 0.1 0.1\n}\n");
    }
    text.push_str("}\n");
}

/// As it is, in centimetres with other line ends, and with one frame.
pub fn bvh() -> Vec<Vec<u8>> {
    let file = |frames: usize| {
        let mut text = "HIERARCHY\n".to_owned();
        hierarchy(&mut text, 0);
        let _ = writeln!(text, "MOTION\nFrames: {frames}\nFrame Time: 0.0333333");
        for frame in 0..frames {
            let _ = write!(text, "0 {} 0", 0.95 + 0.01 * frame as f32);
            for angle in 0..3 * PERSON.len() {
                let _ = write!(text, " {}", (frame * (angle % 5)) as f32);
            }
            text.push('\n');
        }
        text
    };
    let plain = file(FRAMES);
    let utf16: Vec<u8> = [0xfeff]
        .into_iter()
        .chain(file(1).encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    vec![
        plain.replace('\n', "\r\n").into_bytes(),
        plain.into_bytes(),
        utf16,
    ]
}

/// With rotations as floats, as short integers, and as a spline.
pub fn gltf() -> Vec<Vec<u8>> {
    let kinds = [("LINEAR", false), ("STEP", true), ("CUBICSPLINE", false)];
    kinds
        .into_iter()
        .map(|(interpolation, is_short)| gltf_file(interpolation, is_short))
        .collect()
}

fn gltf_file(interpolation: &str, is_short: bool) -> Vec<u8> {
    let mut binary: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::<Value>::new(), Vec::<Value>::new());
    let mut accessor = |bytes: Vec<u8>, component: u32, kind: &str, count: usize| {
        views.push(json!({
            "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()
        }));
        binary.extend(bytes);
        accessors.push(json!({
            "bufferView": views.len() - 1, "componentType": component, "type": kind,
            "count": count, "normalized": component != 5126
        }));
        accessors.len() - 1
    };
    let floats = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let times: Vec<f32> = (0..FRAMES).map(|frame| frame as f32 / 30.0).collect();
    let input = accessor(floats(&times), 5126, "SCALAR", FRAMES);
    let (mut channels, mut samplers) = (Vec::<Value>::new(), Vec::<Value>::new());
    let mut channel = |joint: usize, path: &str, output: usize| {
        samplers.push(json!({
            "input": input, "output": output, "interpolation": interpolation
        }));
        channels.push(json!({
            "sampler": samplers.len() - 1, "target": { "node": joint, "path": path }
        }));
    };
    let is_spline = interpolation == "CUBICSPLINE";
    let keyed = |value: &[f32]| -> Vec<f32> {
        let tangent = vec![0.0; if is_spline { value.len() } else { 0 }];
        [&tangent, value, &tangent].concat()
    };
    let keys = if is_spline { 3 * FRAMES } else { FRAMES };
    for joint in 0..PERSON.len() {
        let turn = |frame: usize| {
            let half_angle = 0.05 * (frame * (joint % 5)) as f32;
            keyed(&[half_angle.sin(), 0.0, 0.0, half_angle.cos()])
        };
        let numbers: Vec<f32> = (0..FRAMES).flat_map(turn).collect();
        let output = if is_short {
            let shorts = numbers.iter().map(|x| (x * 32767.0) as i16);
            let bytes = shorts.flat_map(i16::to_le_bytes).collect();
            accessor(bytes, 5122, "VEC4", keys)
        } else {
            accessor(floats(&numbers), 5126, "VEC4", keys)
        };
        channel(joint, "rotation", output);
    }
    let place = |frame: usize| keyed(&[0.0, 0.95, 0.01 * frame as f32]);
    let numbers: Vec<f32> = (0..FRAMES).flat_map(place).collect();
    let output = accessor(floats(&numbers), 5126, "VEC3", keys);
    channel(0, "translation", output);
    let node = |joint: usize| {
        let Joint(name, _, offset_m) = &PERSON[joint];
        let children: Vec<usize> = children(joint).collect();
        match children.is_empty() {
            true => json!({ "name": name, "translation": offset_m }),
            false => json!({ "name": name, "translation": offset_m, "children": children }),
        }
    };
    let nodes: Vec<Value> = (0..PERSON.len()).map(node).collect();
    let joints: Vec<usize> = (0..PERSON.len()).collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": nodes,
        "skins": [{ "joints": joints }],
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": views,
        "accessors": accessors,
        "animations": [{ "name": "bends", "channels": channels, "samplers": samplers }],
    });
    container::glb(document.to_string().as_bytes(), &binary)
}

/// As SMPL's 72 numbers, as SMPL-H's with split arrays in single precision, and with an up axis.
pub fn npz() -> Vec<Vec<u8>> {
    let numbers = |count: usize, size: f64| (0..count).map(move |k| size * (k as f64 * 0.7).sin());
    let doubles = |count, size| numbers(count, size).flat_map(f64::to_le_bytes).collect();
    let singles = |count, size| -> Vec<u8> {
        let narrow = numbers(count, size).map(|x| x as f32);
        narrow.flat_map(f32::to_le_bytes).collect()
    };
    let array = |name: &str, descr: &str, shape: &[usize], data: Vec<u8>| {
        (format!("{name}.npy"), container::npy(descr, shape, &data))
    };
    let rate = |name: &str| array(name, "<f8", &[], 60.0_f64.to_le_bytes().to_vec());
    let smpl = vec![
        array("poses", "<f8", &[FRAMES, 72], doubles(FRAMES * 72, 0.3)),
        array("trans", "<f8", &[FRAMES, 3], doubles(FRAMES * 3, 0.1)),
        array("betas", "<f8", &[10], doubles(10, 1.0)),
        rate("mocap_framerate"),
    ];
    let split = vec![
        array("root_orient", "<f4", &[2, 3], singles(6, 0.1)),
        array("pose_body", "<f4", &[2, 63], singles(126, 0.3)),
        array("trans", "<f4", &[2, 3], singles(6, 0.1)),
        array("dmpls", "<f4", &[2, 8], singles(16, 0.1)),
        rate("fps"),
    ];
    let up = vec![
        array("poses", "<f8", &[2, 24, 3], doubles(144, 0.3)),
        array("trans", "<f8", &[2, 3], doubles(6, 0.1)),
        array("up_axis", "<i8", &[], 1_i64.to_le_bytes().to_vec()),
        rate("fps"),
    ];
    [(smpl, false), (split, true), (up, false)]
        .into_iter()
        .filter_map(|(entries, deflates)| container::zip(&entries, deflates))
        .collect()
}
