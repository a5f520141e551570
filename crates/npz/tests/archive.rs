//! Archives written and read again, and ones that are refused.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs::{self, File};
use std::io::{Cursor, Write as _};

use dynaskin_npz::{Archive, NpzError, Writer};
use npyz::{Order, WriterBuilder as _};

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
        &["`even`", "none in the file, which has singles, rate, odd"],
    );
    refusal(
        archive.floats("rate", &[]),
        &["`rate`", "float32", "dtype '<i8'"],
    );
    refusal(
        archive.integers("odd", &[None]),
        &["`odd`", "int32", "dtype '<f8'"],
    );
    refusal(archive.scalar("singles"), &["one number", "[2, 3, 4]"]);
    refusal(
        archive.floats("singles", &[None, Some(6_890), Some(3)]),
        &["shape [any, 6890, 3]", "[2, 3, 4]"],
    );
}

fn npy(order: Order, shape: &[u64], values: &[f64]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .order(order)
        .writer(Cursor::new(&mut bytes))
        .begin_nd()
        .unwrap();
    for value in values {
        writer.push(value).unwrap();
    }
    writer.finish().unwrap();
    bytes
}

/// What stands before the numbers of an array of that shape.
fn header(shape: &str) -> Vec<u8> {
    let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

#[test]
fn only_the_columns_asked_for_are_kept_in_either_order() {
    // The element at [i, j, k] is 100 i + 10 j + k.
    let number = |i: usize, j: usize, k: usize| (100 * i + 10 * j + k) as f64;
    let c_order: Vec<f64> = (0..2)
        .flat_map(|i| (0..3).flat_map(move |j| (0..4).map(move |k| number(i, j, k))))
        .collect();
    let fortran: Vec<f64> = (0..4)
        .flat_map(|k| (0..3).flat_map(move |j| (0..2).map(move |i| number(i, j, k))))
        .collect();
    let expected: Vec<f64> = (0..2)
        .flat_map(|i| (0..2).flat_map(move |j| (0..4).map(move |k| number(i, j, k))))
        .collect();
    for (order, values) in [(Order::C, c_order), (Order::Fortran, fortran)] {
        let file = zipped("a.npy", &npy(order, &[2, 3, 4], &values));
        let mut archive = Archive::open(Cursor::new(file), LIMIT).unwrap();
        assert_eq!(archive.shape("a").unwrap(), [2, 3, 4]);
        let array = archive
            .floats_within("a", &[Some(2), None, Some(4)], &[usize::MAX, 2])
            .unwrap();
        assert_eq!(array.shape, [2, 2, 4]);
        assert_eq!(array.at(&[1, 1, 3]), 113.0);
        assert_eq!(array.into_c_order(), expected, "{order:?}");
    }
}

#[test]
fn a_megabyte_that_unpacks_to_a_hundred_is_refused_before_it_is_unpacked() {
    let mut bytes = header("(10000000,)");
    bytes.resize(bytes.len() + 80_000_000, 0);
    let file = zipped("a.npy", &bytes);
    assert!(file.len() < 100_000);
    let mut archive = Archive::open(Cursor::new(file), 1 << 30).unwrap();
    refusal(archive.floats("a", &[None]), &["`a`", "at most 100 times"]);
}

#[test]
fn an_array_that_is_cut_changed_or_too_long_is_refused() {
    let whole = npy(Order::C, &[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let read = |bytes: &[u8]| {
        let mut archive = Archive::open(Cursor::new(bytes.to_vec()), LIMIT).unwrap();
        archive.floats_within("a", &[Some(2), Some(3)], &[1, 1])
    };
    assert_eq!(
        read(&zipped("a.npy", &whole)).unwrap().into_c_order(),
        [1.0]
    );
    let cut = zipped("a.npy", &whole[..whole.len() - 8]);
    refusal(read(&cut), &["`a`", "intact data"]);
    let long = zipped("a.npy", &[&whole[..], &[0; 8]].concat());
    refusal(read(&long), &["`a`", "more than the shape asks for"]);
    // A changed number that is not kept: the archive's checksum tells.
    let mut stored = stored("a.npy", &whole);
    let last = stored
        .windows(8)
        .position(|bytes| bytes == 6.0_f64.to_le_bytes())
        .unwrap();
    stored[last] ^= 1;
    refusal(read(&stored), &["`a`", "intact data"]);
}

#[test]
fn small_integers_are_read() {
    for (descr, bytes) in [
        ("|u1", &[1, 2][..]),
        ("|i1", &[1, 2]),
        ("<u2", &[1, 0, 2, 0]),
        (">i2", &[0, 1, 0, 2]),
    ] {
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2,), }}\n");
        let mut array = b"\x93NUMPY\x01\x00".to_vec();
        array.extend((text.len() as u16).to_le_bytes());
        array.extend(text.as_bytes());
        array.extend(bytes);
        let mut archive = Archive::open(Cursor::new(zipped("a.npy", &array)), LIMIT).unwrap();
        let got = archive.integers("a", &[None]).unwrap();
        assert_eq!(got.into_c_order(), [1.0, 2.0], "{descr}");
    }
}

#[test]
fn files_of_other_kinds_are_told_with_what_to_do() {
    for (bytes, what, what_to_do) in [
        (&b""[..], "an empty file", "download"),
        (b"PK\x03\x04 and no end", "cut off", "download"),
        (b"\x80\x04 a pickle", "pickle", "numpy.savez"),
        (b"(dp0\nS'J'", "pickle", "numpy.savez"),
        (b"\x93NUMPY\x01\x00", "a single array", "numpy.savez"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file", "numpy.savez"),
        (b"MATLAB 5.0 MAT-file", "a MATLAB file", "loadmat"),
        (b"\x1f\x8b\x08", "a gzip file", "unpack"),
        (b"hello", "another kind of file", "numpy.savez"),
    ] {
        let opened = Archive::open(Cursor::new(bytes.to_vec()), LIMIT);
        refusal(opened, &[what, what_to_do]);
    }
}

#[test]
fn fortran_order_is_turned_round() {
    let bytes = npy(Order::Fortran, &[2, 3], &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    let mut archive = Archive::open(Cursor::new(zipped("a.npy", &bytes)), LIMIT).unwrap();
    let array = archive.floats("a", &[Some(2), Some(3)]).unwrap();
    assert_eq!(array.into_c_order(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

fn zipped(name: &str, bytes: &[u8]) -> Vec<u8> {
    packed(name, bytes, zip::CompressionMethod::Deflated)
}

fn stored(name: &str, bytes: &[u8]) -> Vec<u8> {
    packed(name, bytes, zip::CompressionMethod::Stored)
}

fn packed(name: &str, bytes: &[u8], method: zip::CompressionMethod) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
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
    for shape in ["(9999999999,)", "(0, 4294967296, 4294967296, 2)"] {
        let lying = zipped("a.npy", &header(shape));
        let mut archive = Archive::open(Cursor::new(lying), LIMIT).unwrap();
        refusal(
            archive.floats("a", &[None]),
            &["`a`", "header", "more elements"],
        );
    }
    let array = zipped("a.npy", &npy(Order::C, &[2, 3], &[0.0; 6]));
    let mut small = Archive::open(Cursor::new(array), 16).unwrap();
    refusal(
        small.floats("a", &[None, None]),
        &["at most 16 bytes", "48"],
    );
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
