//! Saved inputs, many in one packed file.

use std::io::{self, Read, Write};
use std::path::PathBuf;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

use crate::Target;

/// Files in one: each behind its length as a little-endian `u32`, all deflated together.
///
/// # Errors
/// None that memory does not give.
pub fn pack(files: &[Vec<u8>]) -> io::Result<Vec<u8>> {
    let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
    for file in files {
        packed.write_all(&(file.len() as u32).to_le_bytes())?;
        packed.write_all(file)?;
    }
    packed.finish()
}

/// What [`pack`] packed.
///
/// # Errors
/// Where the bytes are no such file.
pub fn unpack(packed: &[u8]) -> io::Result<Vec<Vec<u8>>> {
    let mut bytes = Vec::new();
    DeflateDecoder::new(packed).read_to_end(&mut bytes)?;
    let cut = || io::Error::new(io::ErrorKind::UnexpectedEof, "a saved input is cut");
    let (mut files, mut rest) = (Vec::new(), &bytes[..]);
    while let Some((length, after)) = rest.split_first_chunk() {
        let length = u32::from_le_bytes(*length) as usize;
        let (file, after) = after.split_at_checked(length).ok_or_else(cut)?;
        files.push(file.to_vec());
        rest = after;
    }
    if rest.is_empty() { Ok(files) } else { Err(cut()) }
}

/// The inputs that are kept for a target.
///
/// # Errors
/// Where the file cannot be read.
pub fn saved(target: Target) -> io::Result<Vec<Vec<u8>>> {
    unpack(&std::fs::read(path(target))?)
}

/// Where the inputs of a target are kept.
pub fn path(target: Target) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(format!("{}.packed", target.name()))
}
