//! A folder with one mesh file a frame.

use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use glam::Vec3;

use super::mesh::{check_frame_count, vertex_count};
use super::{obj_file, ply_file};
use crate::FitError;

/// Larger than any mesh of a body: a million vertices as text.
const MAX_FILE_BYTES: u64 = 256 << 20;

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshKind {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY, ASCII or binary.
    Ply,
}

impl MeshKind {
    /// Positions of the vertices of a file that is in memory, in the file's unit and order. They are not
    /// checked to be finite, which [`Scans::new`](super::Scans::new) does. `path` only names the file in
    /// messages.
    ///
    /// # Errors
    /// [`FitError`] naming the file: unreadable, or of another topology than `body`'s.
    pub fn positions(
        self,
        path: &Path,
        bytes: &[u8],
        body: &BodyModel,
    ) -> Result<Vec<Vec3>, FitError> {
        let mesh = match self {
            Self::Obj => obj_file::parse(path, bytes)?,
            Self::Ply => ply_file::parse(path, bytes)?,
        };
        if mesh.positions.len() != body.vertex_count() {
            return Err(vertex_count(path, body, mesh.positions.len()));
        }
        check_faces(path, body, &mesh.faces)?;
        Ok(mesh.positions)
    }
}

/// The mesh files of a folder, one a frame.
pub(super) fn list(folder: &Path) -> Result<(Vec<PathBuf>, MeshKind), FitError> {
    let (mut objs, mut plys) = (Vec::new(), Vec::new());
    let io = |source| FitError::Io {
        path: folder.to_owned(),
        action: "listing",
        source,
    };
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        // Files that macOS puts beside those of other file systems, and files half copied.
        if is_hidden(&path) {
            continue;
        }
        let ends_with = |ending| {
            path.extension()
                .is_some_and(|end| end.eq_ignore_ascii_case(ending))
        };
        if ends_with("obj") {
            objs.push(path);
        } else if ends_with("ply") {
            plys.push(path);
        }
    }
    let path = folder.to_owned();
    let (paths, kind) = match (objs.is_empty(), plys.is_empty()) {
        (true, true) => return Err(FitError::NoMeshes { path }),
        (false, false) => return Err(FitError::MixedKinds { path }),
        (false, true) => (sorted(objs), MeshKind::Obj),
        (true, false) => (sorted(plys), MeshKind::Ply),
    };
    check_frame_count(folder, paths.len())?;
    Ok((paths, kind))
}

/// Whether a name begins with a dot.
pub(crate) fn is_hidden(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b".")
}

/// A doubt about frames whose numbers do not rise evenly, as where some were left out.
pub(super) fn missing_frames(paths: &[PathBuf]) -> Option<String> {
    let numbers: Option<Vec<u64>> = paths.iter().map(|path| last_number(path)).collect();
    let numbers = numbers?;
    let step = |pair: &[u64]| pair[1].checked_sub(pair[0]);
    let usual = numbers.windows(2).filter_map(step).min()?;
    if usual == 0 {
        return None;
    }
    let uneven = numbers
        .windows(2)
        .position(|pair| step(pair) != Some(usual))?;
    let name = |index: usize| {
        let name = paths[index].file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    Some(format!(
        "frames seem to be missing between {} and {}; the fit takes them to follow one another, so that movement \
         across the gap is too fast: make each stretch a sequence of its own",
        name(uneven),
        name(uneven + 1)
    ))
}

/// The last run of digits in a name.
fn last_number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.trim_end_matches(|c: char| !c.is_ascii_digit());
    let start = digits.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    digits[start..].parse().ok()
}

/// By name, with numbers inside names in the order of their values: `scan2` before `scan10`.
fn sorted(mut paths: Vec<PathBuf>) -> Vec<PathBuf> {
    paths.sort_by_cached_key(|path| {
        // Without the ending, whose dot would come between `a` and `a9`.
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        (natural_key(&stem), path.clone())
    });
    paths
}

/// Runs of digits become their length (without leading zeros) and themselves, so that they compare
/// as numbers.
fn natural_key(name: &str) -> Vec<(usize, String)> {
    name.as_bytes()
        .chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit())
        .map(|run| {
            let run = String::from_utf8_lossy(run);
            if run.starts_with(|c: char| c.is_ascii_digit()) {
                let digits = run.trim_start_matches('0');
                (1 + digits.len(), digits.to_owned())
            } else {
                (0, run.into_owned())
            }
        })
        .collect()
}

/// The bytes of a mesh file.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, FitError> {
    let io = |action| {
        move |source| FitError::Io {
            path: path.to_owned(),
            action,
            source,
        }
    };
    let length = fs::metadata(path).map_err(io("opening"))?.len();
    if length > MAX_FILE_BYTES {
        return Err(FitError::TooLarge {
            path: path.to_owned(),
            got: format!("{length} bytes"),
            limit: format!("{MAX_FILE_BYTES} bytes"),
        });
    }
    fs::read(path).map_err(io("reading"))
}

/// Faces, where a file has them, must be the body's: a mesh of equally many vertices in another
/// order would be fitted to nonsense. The order of faces and corners does not matter, and quads may
/// be split along either diagonal: every edge must be one of the body's.
pub(super) fn check_faces(
    path: &Path,
    body: &BodyModel,
    faces: &[Vec<u32>],
) -> Result<(), FitError> {
    if faces.is_empty() {
        return Ok(());
    }
    let other = |problem| FitError::Faces {
        path: path.to_owned(),
        problem,
    };
    let known: std::collections::HashSet<(u32, u32)> =
        body.faces.iter().flat_map(edges_of).collect();
    for (index, face) in faces.iter().enumerate() {
        if face.len() < 3 {
            let count = face.len();
            let problem = format!("face {index} has {count} corners, expected 3 or more");
            return Err(other(problem));
        }
        let unknown = edges_of(face).filter(|edge| !known.contains(edge)).count();
        if unknown > 0 {
            let problem = format!("face {index} is {face:?}, whose edges the body has not");
            return Err(other(problem));
        }
    }
    Ok(())
}

/// The edges around a face, each with the lower index first.
fn edges_of<T: AsRef<[u32]>>(face: &T) -> impl Iterator<Item = (u32, u32)> {
    let corners = face.as_ref();
    (0..corners.len()).map(move |corner| {
        let (a, b) = (corners[corner], corners[(corner + 1) % corners.len()]);
        (a.min(b), a.max(b))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_sort_as_numbers() {
        let names = ["a10.obj", "a9.obj", "a009b.obj", "a.obj", "b1.obj"];
        let paths = sorted(names.iter().map(PathBuf::from).collect());
        let got: Vec<_> = paths
            .iter()
            .map(|path| path.to_str().unwrap_or(""))
            .collect();
        assert_eq!(got, ["a.obj", "a9.obj", "a009b.obj", "a10.obj", "b1.obj"]);
    }

    #[test]
    fn gaps_in_the_numbers_of_frames_are_told() {
        let doubt = |names: &[&str]| {
            let paths: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
            missing_frames(&paths)
        };
        for even in [
            &["f0.obj", "f1.obj", "f2.obj"][..],
            &["00010_x.ply", "00015_x.ply", "00020_x.ply"],
            &["f7.obj"],
            &["a.obj", "b.obj", "d.obj"],
            &["f1.obj", "f.obj", "f9.obj"],
        ] {
            assert_eq!(doubt(even), None, "{even:?}");
        }
        let told = doubt(&["f0.obj", "f1.obj", "f3.obj"]).unwrap_or_default();
        assert!(told.contains("between f1.obj and f3.obj"), "{told}");
        let told = doubt(&["m2_f3.obj", "m2_f1.obj"]).unwrap_or_default();
        assert_eq!(told, "");
    }
}
