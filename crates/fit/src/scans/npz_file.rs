//! NumPy archives.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use dynaskin_body::BodyModel;
use dynaskin_npz::Archive;
use glam::Vec3;

use super::mesh::{MAX_NUMBERS, check_frames, vertex_count};
use crate::FitError;

/// An unpacked array of double precision numbers of that count.
const MAX_ARRAY_BYTES: u64 = (MAX_NUMBERS as u64 * 8) + 4096;

/// The positions of an archive, `[frame][vertex]`, in the file's unit.
pub(super) fn read(path: &Path, body: &BodyModel, key: &str) -> Result<Vec<Vec3>, FitError> {
    let failed = |source| FitError::Npz {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(|source| FitError::Io {
        path: path.to_owned(),
        action: "opening",
        source,
    })?;
    let mut archive = Archive::open(BufReader::new(file), MAX_ARRAY_BYTES).map_err(failed)?;
    if !archive.has(key) {
        let expected = "the vertices, [frames, vertices, 3] (name their key with --key)";
        return Err(failed(archive.missing(key, expected)));
    }
    // Before anything is unpacked.
    if let [frames, vertices, 3] = archive.shape(key).map_err(failed)?[..] {
        if vertices != body.vertex_count() {
            return Err(vertex_count(path, body, vertices));
        }
        check_frames(path, frames, vertices)?;
    }
    let shape = [None, Some(body.vertex_count()), Some(3)];
    let array = archive.floats_single(key, &shape).map_err(failed)?;
    Ok(array
        .into_c_order()
        .chunks_exact(3)
        .map(Vec3::from_slice)
        .collect())
}
