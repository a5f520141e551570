//! Bodies as GLB: the round trip, and files that are not what they should be.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use std::sync::LazyLock;

use common::{body, default_bodies, glb, tetrahedron};
use dynaskin_body::{
    BodyError, BodyModel, JOINT_COUNT, POSE_DIR_COUNT, POSITION_STEP_M, SHAPE_COUNT,
};
use dynaskin_clothes::Tones;
use glam::Vec3;
use gltf::json::accessor::{ComponentType, Type};
use proptest::prelude::*;

static SMALL: LazyLock<Vec<u8>> = LazyLock::new(|| tetrahedron().to_glb().unwrap());

fn assert_same(a: &BodyModel, b: &BodyModel) {
    assert_eq!(a.name, b.name);
    assert_eq!(a.template_m, b.template_m);
    assert_eq!(a.faces, b.faces);
    assert_eq!(a.shape_dirs_m, b.shape_dirs_m);
    assert_eq!(a.joint_template_m, b.joint_template_m);
    assert_eq!(a.joint_shape_dirs_m, b.joint_shape_dirs_m);
    assert_eq!(a.skin, b.skin);
    assert_eq!(a.thickness_template_m, b.thickness_template_m);
    assert_eq!(a.thickness_shape_dirs_m, b.thickness_shape_dirs_m);
    assert_eq!(a.region_weights, b.region_weights);
    assert_eq!(a.colors_srgba, b.colors_srgba);
    assert_eq!(a.pose_dirs_m, b.pose_dirs_m);
    assert_eq!(a.copyright, b.copyright);
}

#[test]
fn a_read_body_survives_writing_and_reading() {
    for original in default_bodies() {
        let bytes = original.to_glb().unwrap();
        assert_same(&original, &body(&bytes));
        assert_eq!(body(&bytes).to_glb().unwrap(), bytes);
    }
}

#[test]
fn clothes_are_a_texture_that_steps_at_their_hem() {
    for original in default_bodies() {
        let bytes = original.to_glb().unwrap();
        let file = dynaskin_glb::Document::parse(&bytes).unwrap();
        let root: serde_json::Value = serde_json::from_slice(file.json()).unwrap();
        let attributes = &root["meshes"][0]["primitives"][0]["attributes"];
        assert!(attributes["COLOR_0"].is_null(), "colours would tint it");
        let texels = attributes["TEXCOORD_0"].as_u64().unwrap() as usize;
        let texels = file
            .elements(texels, ComponentType::U16, Type::Vec2)
            .unwrap();
        let shares = Tones::of(&original.colors_srgba).unwrap().shares;
        let pure = texels
            .iter()
            .zip(&shares)
            .filter(|(_, share)| **share <= 0.0 || **share >= 1.0);
        let (right, wrong): (Vec<_>, Vec<_>) = pure.partition(|(texel, share)| {
            let across = u16::from_le_bytes([texel[0], texel[1]]);
            (across > u16::MAX / 2) == (**share > 0.5)
        });
        // The hem is smoothed, and cuts corners of a vertex or two.
        assert!(
            wrong.len() * 200 < right.len(),
            "{} {}",
            wrong.len(),
            right.len()
        );
        let material = &root["materials"][0]["pbrMetallicRoughness"];
        assert_eq!(material["baseColorTexture"]["index"], 0);
        // The texture's palette are the two colours.
        let palette = bytes.windows(4).position(|word| word == b"PLTE").unwrap() + 4;
        let tones = Tones::of(&original.colors_srgba).unwrap().srgb;
        assert_eq!(bytes[palette..palette + 6], *tones.as_flattened());
    }
}

#[test]
fn committed_bodies_are_as_they_are_written_today() {
    for name in ["female", "male"] {
        let bytes = glb(name);
        assert!(
            body(&bytes).to_glb().unwrap() == bytes,
            "{name}: write it anew"
        );
    }
}

#[test]
fn nothing_in_a_file_has_a_unit_other_than_the_metre() {
    let bytes = glb("male");
    let (file, binary) = parts(&bytes);
    let stature_m = file["accessors"][1]["max"][1].as_f64().unwrap();
    assert!((1.6..2.0).contains(&stature_m), "{stature_m}");
    let inverse_binds = file["skins"][0]["inverseBindMatrices"].as_u64().unwrap() as usize;
    let view = file["accessors"][inverse_binds]["bufferView"]
        .as_u64()
        .unwrap() as usize;
    let start = file["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
    for matrix in binary[start..].chunks_exact(64).take(JOINT_COUNT) {
        for diagonal in [0, 20, 40, 60] {
            assert_eq!(matrix[diagonal..diagonal + 4], 1f32.to_le_bytes());
        }
    }
}

#[test]
fn bodies_of_earlier_versions_are_the_same() {
    for original in default_bodies().into_iter().chain([tetrahedron()]) {
        let bytes = original.to_glb().unwrap();
        assert_same(&body(&as_earlier(&bytes)), &body(&bytes));
    }
}

/// A file as earlier versions wrote it: positions and morphs in whole steps, neither in metres nor normalised.
fn as_earlier(bytes: &[u8]) -> Vec<u8> {
    let (mut file, binary) = parts(bytes);
    let mut binary = binary.to_vec();
    let primitive = file["meshes"][0]["primitives"][0].clone();
    let targets = primitive["targets"].as_array().unwrap().iter();
    let places = targets.chain([&primitive["attributes"]]);
    for accessor in places.map(|place| place["POSITION"].as_u64().unwrap() as usize) {
        let view = file["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
        let is_normalized = file["accessors"][accessor]["normalized"] == true;
        let (size, stride) = if is_normalized { (2, 8) } else { (4, 12) };
        let start = file["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
        let count = file["accessors"][accessor]["count"].as_u64().unwrap() as usize;
        for row in binary[start..start + stride * count].chunks_exact_mut(stride) {
            for axis in 0..3 {
                let number = &row[axis * size..(axis + 1) * size];
                let metres = match is_normalized {
                    true => f32::from(i16::from_le_bytes([number[0], number[1]])) / 32_767.0,
                    false => f32::from_le_bytes(number.try_into().unwrap()),
                };
                let step = (metres / POSITION_STEP_M).round() as i16;
                row[axis * 2..axis * 2 + 2].copy_from_slice(&step.to_le_bytes());
            }
        }
        let accessor = file["accessors"][accessor].as_object_mut().unwrap();
        for key in ["normalized", "min", "max"] {
            accessor.remove(key);
        }
        accessor.insert("componentType".into(), 5122.into());
        file["bufferViews"][view]["byteStride"] = stride.into();
    }
    assembled(file.to_string().into_bytes(), &binary)
}

/// The document and the binary chunk of a file.
fn parts(bytes: &[u8]) -> (serde_json::Value, &[u8]) {
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let file = serde_json::from_slice(&bytes[20..20 + json_length]).unwrap();
    (file, &bytes[28 + json_length..])
}

/// A file of a document and a binary chunk, whose length is a multiple of four.
fn assembled(mut json: Vec<u8>, binary: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(((28 + json.len() + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

#[test]
fn quantisation_moves_no_vertex_by_more_than_a_tenth_of_a_millimetre() {
    let mut original = common::default_bodies().remove(0);
    // Coordinates that no step hits: the committed body itself is already on the steps.
    for (vertex, position) in original.template_m.iter_mut().enumerate() {
        let phase = vertex as f32;
        *position += 5e-5 * Vec3::new(phase.sin(), (1.7 * phase).sin(), (2.3 * phase).cos());
    }
    let read = body(&original.to_glb().unwrap());
    let worst_m = original
        .template_m
        .iter()
        .zip(&read.template_m)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max);
    assert!(worst_m > 0.0 && worst_m < 1e-4, "{worst_m}");
}

#[test]
fn a_body_without_thickness_regions_and_colours_survives() {
    let mut plain = tetrahedron();
    plain.thickness_template_m.clear();
    plain.thickness_shape_dirs_m.clear();
    plain.region_weights.clear();
    plain.colors_srgba.clear();
    let read = body(&plain.to_glb().unwrap());
    assert!(read.thickness_template_m.is_empty() && read.thickness_shape_dirs_m.is_empty());
    assert!(read.region_weights.is_empty() && read.colors_srgba.is_empty());
    assert_eq!(read.softness(0), 0.0);
}

/// The small body with pose correctives of very different sizes.
fn corrected() -> BodyModel {
    let mut body = tetrahedron();
    let dir = |field: usize, vertex: usize| {
        let phase = (field * 4 + vertex) as f32;
        0.03 / (1.0 + field as f32).powi(2) * Vec3::new(phase.sin(), phase.cos(), 0.3)
    };
    body.pose_dirs_m = (0..POSE_DIR_COUNT)
        .map(|field| (0..4).map(|vertex| dir(field, vertex)).collect())
        .collect();
    body
}

#[test]
fn pose_correctives_survive_each_in_steps_of_its_own() {
    let original = corrected();
    let bytes = original.to_glb().unwrap();
    let read = body(&bytes);
    for (field, (a, b)) in original
        .pose_dirs_m
        .iter()
        .zip(&read.pose_dirs_m)
        .enumerate()
    {
        let largest = a
            .iter()
            .map(|dir| dir.abs().max_element())
            .fold(0.0, f32::max);
        for (a, b) in a.iter().zip(b) {
            assert!(
                (*a - *b).abs().max_element() <= largest / 32_767.0,
                "field {field}"
            );
        }
    }
    assert_same(&read, &body(&read.to_glb().unwrap()));
    assert_eq!(read.to_glb().unwrap(), bytes);
}

#[test]
fn broken_pose_correctives_are_refused() {
    let bytes = corrected().to_glb().unwrap();
    for (from, to) in [
        ("\"pose_dirs\":", "\"pose_dirz\":"),
        ("\"pose_dir_steps\":", "\"pose_dir_stepz\":"),
        ("\"count\":828", "\"count\":827"),
        ("\"count\":207", "\"count\":206"),
    ] {
        let edited = replaced(&bytes, from, to);
        let error = BodyModel::from_glb(&edited).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("pose_dir"), "{from}: {error}");
    }
    // A step that is no power of two.
    let step = 2.0_f32.powi(-20).to_le_bytes();
    let at = bytes.windows(4).rposition(|word| word == step).unwrap();
    let mut bytes = bytes;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(BodyModel::from_glb(&bytes).is_err());
}

/// The file with the first `from` of its bytes replaced by as long a text.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("{from} is not in the file"));
    let mut bytes = bytes.to_vec();
    bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    bytes
}

#[test]
fn models_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut BodyModel)| {
        let mut model = tetrahedron();
        change(&mut model);
        let error = model.to_glb().unwrap_err();
        assert!(matches!(error, BodyError::Unwritable { .. }), "{error}");
    };
    refused(|model| model.template_m[0].x = 4.0);
    refused(|model| model.template_m[0].x = f32::NAN);
    refused(|model| model.shape_dirs_m[3][1].z = -1.5);
    refused(|model| model.faces[0][0] = 4);
    refused(|model| model.thickness_template_m[0] = 0.5);
    refused(|model| model.pose_dirs_m = vec![vec![Vec3::ZERO; 4]; 206]);
    refused(|model| model.pose_dirs_m = vec![vec![Vec3::ZERO; 3]; 207]);
    refused(|model| model.pose_dirs_m = vec![vec![Vec3::splat(f32::NAN); 4]; 207]);
    refused(|model| {
        model.shape_dirs_m.pop();
    });
    refused(|model| {
        model.skin.pop();
    });
}

#[test]
fn truncated_files_are_refused() {
    for length in 0..SMALL.len() {
        assert!(
            BodyModel::from_glb(&SMALL[..length]).is_err(),
            "{length} bytes"
        );
    }
    let large = glb("female");
    for length in (0..large.len()).step_by(50_021) {
        assert!(
            BodyModel::from_glb(&large[..length]).is_err(),
            "{length} bytes"
        );
    }
}

#[test]
fn a_header_that_lies_about_its_length_is_refused() {
    for length in [0u32, 11, 12, 19, SMALL.len() as u32 + 1, u32::MAX] {
        let mut bytes = SMALL.clone();
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        let outcome = BodyModel::from_glb(&bytes);
        assert!(outcome.is_err() || (12..=SMALL.len() as u32).contains(&length));
    }
}

/// The file with every `from` replaced by `to` in its JSON, chunk lengths put right.
fn with_json(from: &str, to: &str) -> Vec<u8> {
    let json_length = u32::from_le_bytes(SMALL[12..16].try_into().unwrap()) as usize;
    let json = std::str::from_utf8(&SMALL[20..20 + json_length]).unwrap();
    assert!(json.contains(from), "{from} is not in the file");
    let json = json.replace(from, to).into_bytes();
    assembled(json, &SMALL[28 + json_length..])
}

#[test]
fn nonsense_in_the_json_is_refused() {
    assert!(BodyModel::from_glb(&with_json("\"count\":4", "\"count\":4")).is_ok());
    for (from, to) in [
        ("\"count\":4", "\"count\":400000000000"),
        ("\"count\":4", "\"count\":18446744073709551615"),
        ("\"byteOffset\":0", "\"byteOffset\":18446744073709551615"),
        ("\"byteStride\":8", "\"byteStride\":18446744073709551615"),
        ("\"byteStride\":8", "\"byteStride\":1"),
        ("\"bufferView\":1", "\"bufferView\":99"),
        ("\"buffer\":0", "\"buffer\":7"),
        ("\"POSITION\":", "\"TANGENT\":"),
        ("\"dynaskin\":{", "\"other\":{"),
        ("\"thickness\":", "\"thickness\":9999,\"x\":"),
        ("\"componentType\":5122", "\"componentType\":5126"),
        ("\"componentType\":5126", "\"componentType\":5123"),
        ("\"version\":1", "\"version\":2"),
    ] {
        let outcome = BodyModel::from_glb(&with_json(from, to));
        assert!(outcome.is_err(), "{from} -> {to}");
    }
}

#[test]
fn joints_at_no_place_of_a_body_are_refused() {
    for odd in [f32::NAN, f32::INFINITY, 1e32, -150.0] {
        let error = BodyModel::from_glb(&with_joint_x_m(odd))
            .map(|_| ())
            .unwrap_err();
        let is_number = odd.is_finite();
        assert_eq!(
            error.to_string().contains("joint right_knee"),
            is_number,
            "{error}"
        );
    }
    assert!(BodyModel::from_glb(&with_joint_x_m(50.0)).is_ok());
}

/// The small body with its right knee at that x.
fn with_joint_x_m(x_m: f32) -> Vec<u8> {
    let needle: Vec<u8> = tetrahedron().joint_template_m[5]
        .to_array()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let at = SMALL.windows(12).position(|w| w == needle).unwrap();
    let mut bytes = SMALL.clone();
    bytes[at..at + 4].copy_from_slice(&x_m.to_le_bytes());
    bytes
}

#[test]
fn positions_that_are_no_numbers_or_far_away_are_refused() {
    for odd in [f32::NAN, f32::INFINITY, -1e9, 3.3] {
        let (file, binary) = parts(&SMALL);
        let start = file["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
        let mut binary = binary.to_vec();
        binary[start..start + 4].copy_from_slice(&odd.to_le_bytes());
        let error = BodyModel::from_glb(&assembled(file.to_string().into_bytes(), &binary))
            .map(|_| ())
            .unwrap_err();
        assert!(error.to_string().contains("POSITION"), "{error}");
    }
}

proptest! {
    #[test]
    fn flipped_bytes_give_an_error_or_a_sound_body(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = SMALL.clone();
        for (index, value) in flips {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(body) = BodyModel::from_glb(&bytes) {
            let count = body.vertex_count();
            let shaped = body.shaped(&[1.0; SHAPE_COUNT]);
            prop_assert!(shaped.positions_m.iter().all(|p| p.is_finite()));
            prop_assert!(shaped.joints_m.iter().all(|p| p.is_finite()));
            prop_assert!(body.faces.iter().flatten().all(|&v| (v as usize) < count));
            prop_assert_eq!(body.skin.len(), count);
            let weights = body.skin.iter().flat_map(|skin| skin.weights);
            prop_assert!(weights.into_iter().all(|w| (0.0..=1.01).contains(&w)));
        }
    }
}
