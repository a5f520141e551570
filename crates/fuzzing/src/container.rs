//! Files taken apart and put together again, with every length and checksum right.

use std::io::{Cursor, Read, Write};

use serde_json::Value;
use sha2::{Digest, Sha256};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Bytes before the payload of a saved state: magic, version, model.
pub const STATE_HEADER: usize = 8 + 4 + 32;

/// Likewise of a lowered network.
pub const LOWERED_HEADER: usize = 16 + 4 + 32;

/// Bytes of a checksum.
const CHECKSUM: usize = 32;

/// Most bytes of an entry that are unpacked to be changed.
const MAX_ENTRY: u64 = 1 << 20;

/// Document and buffer of a binary glTF file; none where it is no such file.
pub fn glb_parts(file: &[u8]) -> Option<(Vec<u8>, Vec<u8>)> {
    let length = |at: usize| {
        let bytes = file.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    let json_length = length(12)?;
    let json = file.get(20..20usize.checked_add(json_length)?)?;
    let chunk = 20 + json_length;
    let binary = file.get(chunk + 8..).unwrap_or_default();
    Some((json.to_vec(), binary.to_vec()))
}

/// A binary glTF file.
pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], filler: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), filler);
        bytes
    };
    let (json, binary) = (padded(json, b' '), padded(binary, 0));
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend((length as u32).to_le_bytes());
    for (chunk, kind) in [(json, b"JSON"), (binary, b"BIN\0")] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

/// Names and contents of a zip archive's entries; none where it is no archive.
pub fn zip_entries(file: &[u8]) -> Option<Vec<(String, Vec<u8>)>> {
    let mut archive = ZipArchive::new(Cursor::new(file)).ok()?;
    let mut entries = Vec::new();
    for idx in 0..archive.len().min(16) {
        let entry = archive.by_index(idx).ok()?;
        let name = entry.name().ok()?.into_owned();
        let mut contents = Vec::new();
        entry.take(MAX_ENTRY).read_to_end(&mut contents).ok()?;
        entries.push((name, contents));
    }
    Some(entries)
}

/// An archive of entries, deflated where `deflates`; none where the names cannot be written.
pub fn zip(entries: &[(String, Vec<u8>)], deflates: bool) -> Option<Vec<u8>> {
    let method = if deflates {
        CompressionMethod::Deflated
    } else {
        CompressionMethod::Stored
    };
    let options = SimpleFileOptions::default().compression_method(method);
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, contents) in entries {
        writer.start_file(name.as_str(), options).ok()?;
        writer.write_all(contents).ok()?;
    }
    Some(writer.finish().ok()?.into_inner())
}

/// A NumPy array of `descr` (`<f8`), with the header that NumPy writes.
pub fn npy(descr: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let lengths: Vec<String> = shape.iter().map(|length| format!("{length},")).collect();
    let shape = lengths.join(" ");
    npy_with_header(
        &format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}"),
        data,
    )
}

/// A NumPy array with the text of a header, padded as NumPy pads it.
pub fn npy_with_header(text: &str, data: &[u8]) -> Vec<u8> {
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(text.bytes());
    bytes.resize(10 + length - 1, b' ');
    bytes.push(b'\n');
    bytes.extend(data);
    bytes
}

/// Header text and data of a NumPy array of version 1; none where it is none.
pub fn npy_parts(bytes: &[u8]) -> Option<(String, Vec<u8>)> {
    let length = u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?);
    let end = 10 + usize::from(length);
    let text = String::from_utf8_lossy(bytes.get(10..end)?);
    Some((text.trim_end().to_owned(), bytes[end..].to_vec()))
}

/// Header and payload of a state or a lowered network, without the checksum; none where it is too short.
pub fn sealed_parts(file: &[u8], header: usize) -> Option<(&[u8], &[u8])> {
    let body = file.get(..file.len().checked_sub(CHECKSUM)?)?;
    body.split_at_checked(header)
}

/// A state or a lowered network of what [`sealed_parts`] gives.
pub fn seal(mut body: Vec<u8>) -> Vec<u8> {
    let checksum = Sha256::digest(&body);
    body.extend(checksum);
    body
}

/// Header and data of a safetensors file; none where it is none.
pub fn safetensors_parts(file: &[u8]) -> Option<(Value, Vec<u8>)> {
    let length = u64::from_le_bytes(file.get(..8)?.try_into().ok()?);
    let end = usize::try_from(length).ok()?.checked_add(8)?;
    let header = serde_json::from_slice(file.get(8..end)?).ok()?;
    Some((header, file[end..].to_vec()))
}

/// A safetensors file.
pub fn safetensors(header: &[u8], data: &[u8]) -> Vec<u8> {
    let mut header = header.to_vec();
    header.resize(header.len().next_multiple_of(8), b' ');
    let mut file = (header.len() as u64).to_le_bytes().to_vec();
    file.extend(header);
    file.extend(data);
    file
}
