//! The clip format: round trip, equal bytes, and refusal of damaged files.

use std::fs;

use dynaskin_body::Pose;
use dynaskin_sim::{ClipData, ClipHeader, DatasetError, drawn_materials};
use glam::{DQuat, DVec3};
use half::f16;

fn clip() -> ClipData {
    let mut turned = Pose::REST;
    turned.root_translation_m = DVec3::new(1.0, 2.0, 3.0);
    turned.parent_from_joint[5] = DQuat::from_rotation_x(0.3);
    ClipData {
        name: "hop__s1".to_owned(),
        body_sha256: "ab".repeat(32),
        rate_hz: 60.0,
        seed: 7,
        sim_json: r#"{"substeps":24}"#.to_owned(),
        materials: drawn_materials("hop", 7),
        shape: std::array::from_fn(|k| k as f32 * 0.5 - 1.0),
        vertices: vec![3, 9, 4000],
        poses: vec![Pose::REST, turned],
        offsets_rest_m: (0..18).map(|k| f16::from_f32(k as f32 * 1e-3)).collect(),
    }
}

#[test]
fn a_clip_round_trips_with_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (
        folder.path().join("a.safetensors"),
        folder.path().join("b.safetensors"),
    );
    let clip = clip();
    clip.write(&a).unwrap();
    clip.write(&b).unwrap();
    assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
    let read = ClipData::read(&a).unwrap();
    assert_eq!(read, clip);
    assert_eq!(read.frame_offsets_rest_m(1)[0], f16::from_f32(9e-3));
    assert!((read.offset_rest_m(1, 2).y - 16e-3).abs() < 1e-5);
    let header = ClipHeader::read(&a).unwrap();
    assert_eq!(
        (header.frame_count, header.vertices.len(), header.seed),
        (2, 3, 7)
    );
    assert_eq!(header.name, clip.name);
    // No temporary file stays behind.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn every_truncation_and_every_bit_flip_of_the_header_is_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.safetensors");
    clip().write(&path).unwrap();
    let bytes = fs::read(&path).unwrap();
    for length in (0..bytes.len()).step_by(7) {
        fs::write(&path, &bytes[..length]).unwrap();
        assert!(matches!(
            ClipData::read(&path),
            Err(DatasetError::Malformed { .. })
        ));
        assert!(matches!(
            ClipHeader::read(&path),
            Err(DatasetError::Malformed { .. })
        ));
    }
    for at in 0..bytes.len().min(900) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        fs::write(&path, &damaged).unwrap();
        // Either is fine (a flip may only change the name); it must not panic.
        let _ = ClipData::read(&path);
        let _ = ClipHeader::read(&path);
    }
}

#[test]
fn rounding_to_half_precision_costs_less_than_a_tenth_of_a_millimetre() {
    // Every offset up to 20 cm, far above the largest of a data set, in steps of 1.3 µm.
    let largest = (0..150_000)
        .map(|k| 1.3e-6 * k as f32)
        .map(|metres| (f16::from_f32(metres).to_f32() - metres).abs())
        .fold(0.0, f32::max);
    println!("largest rounding error per axis: {:.4} mm", largest * 1e3);
    assert!(largest * 3.0_f32.sqrt() < 1.1e-4, "{largest} m");
    assert!(largest < 1e-4, "{largest} m");
}

#[test]
fn wrong_contents_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.safetensors");
    clip().write(&path).unwrap();
    let bytes = fs::read(&path).unwrap();
    let replace = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = bytes
            .windows(from.len())
            .position(|w| w == from.as_bytes())
            .unwrap();
        let mut changed = bytes.clone();
        changed[at..at + to.len()].copy_from_slice(to.as_bytes());
        fs::write(&path, changed).unwrap();
        ClipData::read(&path)
    };
    let error = replace("dynaskin-clip", "dynaskin-clap").unwrap_err();
    assert!(
        matches!(error, DatasetError::Metadata { key: "format", .. }),
        "{error}"
    );
    let error = replace(r#""version":"2""#, r#""version":"1""#).unwrap_err();
    assert!(
        matches!(error, DatasetError::Metadata { key: "version", .. }),
        "{error}"
    );
    // Even where the older version lacks a tensor, the version is what is named.
    let error = replace(r#""version":"2""#, r#""version":"0""#).unwrap_err();
    assert!(error.to_string().contains("version"), "{error}");
    let error = replace(r#""rate_hz":"60""#, r#""rate_hz":"-1""#).unwrap_err();
    assert!(
        matches!(error, DatasetError::Metadata { key: "rate_hz", .. }),
        "{error}"
    );
    let error = replace(r#""vertices":"#, r#""verticez":"#).unwrap_err();
    assert!(
        matches!(
            error,
            DatasetError::Tensor {
                tensor: "vertices",
                ..
            }
        ),
        "{error}"
    );

    // The last six bytes are the last offset: make it NaN.
    let mut nan = bytes.clone();
    let end = nan.len();
    nan[end - 2..].copy_from_slice(&f16::NAN.to_le_bytes());
    fs::write(&path, nan).unwrap();
    let error = ClipData::read(&path).unwrap_err();
    assert!(
        matches!(
            error,
            DatasetError::Value {
                tensor: "offsets_m",
                frame: 1,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn an_inconsistent_clip_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.safetensors");
    let mut short = clip();
    short.offsets_rest_m.pop();
    assert!(matches!(
        short.write(&path),
        Err(DatasetError::Inconsistent { .. })
    ));
    let mut nan = clip();
    nan.offsets_rest_m[4] = f16::NAN;
    assert!(matches!(
        nan.write(&path),
        Err(DatasetError::Inconsistent { .. })
    ));
    let mut unordered = clip();
    unordered.vertices.swap(0, 1);
    assert!(matches!(
        unordered.write(&path),
        Err(DatasetError::Inconsistent { .. })
    ));
    assert!(!path.exists());
    let nowhere = folder.path().join("missing/clip.safetensors");
    assert!(matches!(
        clip().write(&nowhere),
        Err(DatasetError::Io { .. })
    ));
}
