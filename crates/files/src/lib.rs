//! Files that are whole or as they were, and folders with one writer.
//!
//! Hours of work end in a few files. A kill, a full disk or a second run in the same folder must not
//! leave half a file, or files of two runs side by side.

mod lock;
mod reason;
mod replace;

pub use lock::FolderLock;
pub use reason::reason;
pub use replace::{Replacement, check_place, remove_leftovers, replace, replace_all, write_first};

use std::path::{Path, PathBuf};

/// A file or a folder that the operating system refused.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {action} failed: {}", reason(source))]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was being done, such as `writing`.
    pub action: &'static str,
    /// Why it failed.
    pub source: std::io::Error,
}

/// Why a folder could not be locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// The folder cannot be made, or the file system has no locks.
    #[error(transparent)]
    File(#[from] FileError),
    /// Another process writes into the folder.
    #[error("{folder} is in use by another run: wait for its end, or choose another folder")]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
}

impl FileError {
    fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self {
            path,
            action,
            source,
        }
    }
}
