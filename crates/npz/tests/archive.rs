//! Archives written and read again, and ones that are refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs::{self, File};
use std::io::{Cursor, Write as _};

use dynaskin_npz::{Archive, NpzError, Writer};
use npyz::WriterBuilder as _;

const LIMIT: u64 = 1 << 20;

#[track_caller]
fn refusal<T: std::fmt::Debug>(result: Result<T, NpzError>, words: &[&str]) {
    let text = result.unwrap_err().to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

#[test]
fn arrays_come_back_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let mut writer = Writer::create(&path).unwrap();
    let singles: Vec<f32> = (0..24).map(|i| i as f32 * 0.5).collect();
    writer.array("singles", &[2, 3, 4], &singles).unwrap();
    writer.array("rate", &[], &[120_i64]).unwrap();
    writer.array("odd", &[2], &[f64::NAN, 1.0]).unwrap();
    assert!(!path.exists(), "nothing stands there before the end");
    writer.finish().unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

    let mut archive = Archive::open(File::open(&path).unwrap(), LIMIT).unwrap();
    let shape = [None, Some(3), Some(4)];
    let array = archive.floats("singles", &shape).unwrap();
    assert_eq!(array.shape, [2, 3, 4]);
    assert_eq!(array.at(&[1, 2, 3]), 11.5);
    assert_eq!(
        archive
            .floats_single("singles", &shape)
            .unwrap()
            .into_c_order(),
        singles
    );
    assert_eq!(archive.scalar("rate").unwrap(), 120.0);
    assert!(archive.has("odd") && !archive.has("even"));

    refusal(archive.floats("odd", &[None]), &["`odd`", "finite", "NaN"]);
    refusal(
        archive.floats("even", &[None]),
        &["`even`", "none in the file"],
    );
    refusal(archive.floats("rate", &[]), &["`rate`", "dtype"]);
    refusal(archive.scalar("singles"), &["one number", "[2, 3, 4]"]);
    refusal(
        archive.floats("singles", &[None, Some(6_890), Some(3)]),
        &["shape [any, 6890, 3]", "[2, 3, 4]"],
    );
}

#[test]
fn fortran_order_is_turned_round() {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[2, 3])
        .order(npyz::Order::Fortran)
        .writer(Cursor::new(&mut bytes))
        .begin_nd()
        .unwrap();
    for value in [1.0, 4.0, 2.0, 5.0, 3.0, 6.0] {
        writer.push(&value).unwrap();
    }
    writer.finish().unwrap();
    let mut archive = Archive::open(Cursor::new(zipped("a.npy", &bytes)), LIMIT).unwrap();
    let array = archive.floats("a", &[Some(2), Some(3)]).unwrap();
    assert_eq!(array.into_c_order(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

fn zipped(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    zip.start_file(name, options).unwrap();
    zip.write_all(bytes).unwrap();
    zip.finish().unwrap().into_inner()
}

#[test]
fn what_is_no_archive_or_claims_too_much_is_refused() {
    refusal(
        Archive::open(Cursor::new(b"no archive".to_vec()), LIMIT),
        &["numpy.savez"],
    );
    let header = b"\x93NUMPY\x01\x00\x36\x00{'descr': '<f8', 'fortran_order': False, 'shape': (9";
    let mut lying = header.to_vec();
    lying.resize(10 + 0x36, b'9');
    let mut archive = Archive::open(Cursor::new(zipped("a.npy", &lying)), LIMIT).unwrap();
    refusal(archive.floats("a", &[None]), &["`a`", "header"]);
    let mut small = Archive::open(Cursor::new(zipped("a.npy", &lying)), 16).unwrap();
    refusal(small.floats("a", &[None]), &["at most 16 bytes"]);
}

#[test]
fn a_wrong_count_and_a_missing_folder_leave_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    fs::write(&path, "what was there").unwrap();
    let mut writer = Writer::create(&path).unwrap();
    refusal(
        writer.array("a", &[2, 2], &[1.0_f32; 3]),
        &["`a`", "4 numbers"],
    );
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"what was there");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let nowhere = folder.path().join("none/a.npz");
    refusal(Writer::create(&nowhere), &["none", "creating failed"]);
}
