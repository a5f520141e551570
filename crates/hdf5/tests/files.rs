//! Files of h5py and of our own, whole and damaged.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_hdf5::{Hdf5, Hdf5Error, Kind, Listed};

const FRAMES: usize = 20;
const VERTICES: usize = 4;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/files")
        .join(name)
}

fn made() -> PathBuf {
    file("made.hdf5")
}

fn number(vertex: usize, axis: usize, frame: usize) -> f32 {
    (1_000 * frame + 10 * vertex + axis) as f32
}

#[test]
fn data_sets_are_listed_with_shapes_and_kinds() {
    for name in ["made.hdf5", "latest.hdf5"] {
        check_list(&Hdf5::open(&file(name)).unwrap().list().unwrap());
    }
}

#[track_caller]
fn check_list(listed: &[Listed]) {
    let found: Vec<_> = listed
        .iter()
        .map(|one| (one.name.as_str(), one.shape.as_slice(), one.kind))
        .collect();
    assert_eq!(
        found,
        [
            ("50002_hips", [4, 3, 20].as_slice(), Kind::Single),
            ("50004_hips", &[4, 3, 20], Kind::Double),
            ("50004_jump", &[20, 4, 3], Kind::Single),
            ("faces", &[2, 3], Kind::Integer),
            ("subject", &[], Kind::Other),
            ("more/deep", &[3, 4, 20], Kind::Double),
        ]
    );
}

#[test]
fn pieces_hold_what_was_written() {
    for name in ["made.hdf5", "latest.hdf5"] {
        check_pieces(&Hdf5::open(&file(name)).unwrap());
    }
}

#[track_caller]
fn check_pieces(file: &Hdf5) {
    // Pieces that lie across chunks, of chunked, packed, big-endian and grouped data.
    for (first, end) in [(0, 20), (0, 1), (7, 17), (19, 20), (5, 5)] {
        for name in ["50002_hips", "50004_hips"] {
            let array = file.array(name).unwrap();
            let got = array.floats(&[0..VERTICES, 0..3, first..end]).unwrap();
            let expected: Vec<f32> = (0..VERTICES)
                .flat_map(|v| (0..3).flat_map(move |x| (first..end).map(move |f| number(v, x, f))))
                .collect();
            assert_eq!(got, expected, "{name} {first}..{end}");
        }
        let got = file.array("50004_jump").unwrap();
        let got = got.floats(&[first..end, 1..3, 0..3]).unwrap();
        let expected: Vec<f32> = (first..end)
            .flat_map(|f| (1..3).flat_map(move |v| (0..3).map(move |x| number(v, x, f))))
            .collect();
        assert_eq!(got, expected, "{first}..{end}");
    }
    let deep = file.array("more/deep").unwrap();
    assert_eq!(
        deep.floats(&[2..3, 3..4, 9..10]).unwrap(),
        [number(3, 2, 9)]
    );
    let faces = file.array("faces").unwrap();
    assert_eq!(faces.integers(&[0..2, 0..3]).unwrap(), [0, 1, 2, 0, 2, 3]);
    assert_eq!(
        file.array("50002_hips").unwrap().chunk(),
        Some(vec![3, 3, 8])
    );
    assert_eq!(file.array("faces").unwrap().chunk(), None);
}

#[test]
fn a_block_of_text_may_stand_before_the_file() {
    // As MATLAB writes them.
    let file = Hdf5::open(&file("odd.hdf5")).unwrap();
    let plain = file.array("plain").unwrap();
    let got = plain.floats(&[1..2, 0..3, 4..6]).unwrap();
    assert_eq!(got, [64.0, 65.0, 84.0, 85.0, 104.0, 105.0]);
    let whole = fs::read(self::file("odd.hdf5")).unwrap();
    let error = Hdf5::from_bytes(Path::new("a"), whole[..whole.len() - 1].to_vec()).unwrap_err();
    assert!(matches!(error, Hdf5Error::CutOff { .. }), "{error}");
}

#[test]
fn what_is_stored_in_ways_that_are_not_read_is_told_with_what_to_do() {
    let odd = Hdf5::open(&file("odd.hdf5")).unwrap();
    let listed = odd.list().unwrap();
    let half = listed.iter().find(|one| one.name == "half").unwrap();
    assert_eq!(half.elements, "16-bit floats");
    for (name, words) in [
        ("lzf", "packed with LZF"),
        ("half", "16-bit floats, expected floats of 32 or 64 bits"),
        ("outside", "lie in another file"),
    ] {
        let array = odd.array(name).unwrap();
        let text = array.floats(&[0..4, 0..3, 0..1]).unwrap_err().to_string();
        assert!(text.contains("odd.hdf5") && text.contains(words), "{text}");
        assert!(name == "half" || text.contains("h5repack"), "{text}");
    }
    let linked = Hdf5::open(&file("elsewhere.hdf5")).unwrap();
    let text = linked.list().unwrap_err().to_string();
    assert!(
        text.contains("elsewhere.hdf5") && text.contains("other.hdf5"),
        "{text}"
    );
    linked.array("50002_hips").unwrap();
}

#[test]
fn what_is_not_there_or_of_another_kind_is_told() {
    let file = Hdf5::open(&made()).unwrap();
    for name in ["50002_walk", "none/deep", "", "more"] {
        let error = file.array(name).unwrap_err();
        assert!(
            matches!(error, Hdf5Error::Missing { .. }),
            "{name}: {error}"
        );
    }
    let told = |error: Hdf5Error, words: &[&str]| {
        let text = error.to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` is missing in: {text}");
        }
    };
    let hips = file.array("50002_hips").unwrap();
    let outside = hips.floats(&[0..4, 0..3, 15..21]).unwrap_err();
    told(outside, &["made.hdf5", "`50002_hips`", "15..21"]);
    told(hips.floats(&[0..4, 0..3]).unwrap_err(), &["0..4"]);
    told(
        hips.integers(&[0..4, 0..3, 0..1]).unwrap_err(),
        &["expected integers"],
    );
    let text = file.array("subject").unwrap();
    told(text.floats(&[]).unwrap_err(), &["expected floats"]);
}

#[test]
fn files_of_other_kinds_and_without_their_end_are_refused() {
    let error = Hdf5::open(&made().with_extension("none")).unwrap_err();
    assert!(matches!(error, Hdf5Error::Io { .. }), "{error}");
    let whole = fs::read(made()).unwrap();
    let path = Path::new("a.hdf5");
    for other in [
        b"PK\x03\x04 an archive".to_vec(),
        Vec::new(),
        vec![0; 9_000],
    ] {
        let error = Hdf5::from_bytes(path, other).unwrap_err();
        assert!(matches!(error, Hdf5Error::NotHdf5 { .. }), "{error}");
    }
    for length in [200, whole.len() / 2, whole.len() - 1] {
        let error = Hdf5::from_bytes(path, whole[..length].to_vec()).unwrap_err();
        assert!(
            matches!(error, Hdf5Error::CutOff { got, .. } if got == length as u64),
            "{error}"
        );
    }
}

/// Reads everything and passes over what is refused.
fn read_all(bytes: Vec<u8>) -> usize {
    let Ok(file) = Hdf5::from_bytes(Path::new("a.hdf5"), bytes) else {
        return 0;
    };
    let listed = file.list().unwrap_or_default();
    let mut numbers = 0;
    for one in &listed {
        let Ok(array) = file.array(&one.name) else {
            continue;
        };
        let piece: Vec<_> = array
            .shape()
            .iter()
            .map(|&length| 0..length.min(50))
            .collect();
        if let Ok(floats) = array.floats(&piece) {
            numbers += floats.len();
        }
        if let Ok(integers) = array.integers(&piece) {
            numbers += integers.len();
        }
    }
    numbers
}

#[test]
fn damaged_files_are_read_or_refused() {
    for name in ["made.hdf5", "latest.hdf5"] {
        check_damaged(&fs::read(file(name)).unwrap());
    }
}

fn check_damaged(whole: &[u8]) {
    let all = 4 * FRAMES * VERTICES * 3 + 6;
    assert_eq!(read_all(whole.to_vec()), all);
    // Every byte that is not padding, one at a time.
    let mut refused = 0;
    for at in 0..whole.len() {
        let bits: &[u8] = if whole[at] == 0 && at % 16 != 0 {
            &[]
        } else {
            &[0x01, 0x80, 0xff]
        };
        for bit in bits {
            let mut damaged = whole.to_vec();
            damaged[at] ^= bit;
            refused += usize::from(read_all(damaged) < all);
        }
    }
    assert!(refused > 100, "{refused}");
}
