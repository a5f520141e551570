//! Saved inputs, many in one packed file.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

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
    if rest.is_empty() {
        Ok(files)
    } else {
        Err(cut())
    }
}

/// The inputs that are kept for a target.
///
/// # Errors
/// Where the file cannot be read.
pub fn saved(target: Target) -> io::Result<Vec<Vec<u8>>> {
    unpack(&fs::read(path(target))?)
}

/// Where the inputs of a target are kept.
pub fn path(target: Target) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(format!("{}.packed", target.name()))
}

/// Writes the seeds and the saved inputs of a target as files into a folder.
///
/// # Errors
/// Where the folder cannot be written to, or the saved inputs are not whole.
pub fn write(target: Target, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let kept = match path(target).exists() {
        true => saved(target)?,
        false => Vec::new(),
    };
    for (prefix, files) in [("seed", target.seeds()), ("saved", kept)] {
        for (idx, file) in files.iter().enumerate() {
            fs::write(folder.join(format!("{prefix}-{idx:04}")), file)?;
        }
    }
    Ok(())
}

/// Saves the smallest files of a folder for a target, as many as fit into `limit` packed bytes. Gives how
/// many these are, and how many there are.
///
/// # Errors
/// Where the folder cannot be read or the repository not written to.
pub fn save_smallest(target: Target, folder: &Path, limit: usize) -> io::Result<(usize, usize)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        files.push(fs::read(entry?.path())?);
    }
    files.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
    let (mut fits, mut too_many) = (0, files.len() + 1);
    while too_many - fits > 1 {
        let count = fits.midpoint(too_many);
        match pack(&files[..count])?.len() <= limit {
            true => fits = count,
            false => too_many = count,
        }
    }
    let path = path(target);
    fs::create_dir_all(path.parent().unwrap_or(folder))?;
    fs::write(&path, pack(&files[..fits])?)?;
    Ok((fits, files.len()))
}
