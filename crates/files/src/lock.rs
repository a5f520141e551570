//! Folders that one process at a time writes into.

use std::fs::{File, TryLockError, create_dir_all};
use std::path::Path;

use crate::{FileError, LockError};

/// Name of the file whose lock stands for the folder.
const LOCK_FILE: &str = ".dynaskin.lock";

/// The right to write into a folder, until it is dropped or the process ends, however it ends. The
/// empty file of the lock stays: removed, another process could hold the lock of a file that is gone.
#[derive(Debug)]
pub struct FolderLock {
    _file: File,
}

impl FolderLock {
    /// Locks a folder, which is made if need be.
    ///
    /// # Errors
    /// [`LockError::InUse`] where another process has it, [`LockError::File`] where it cannot be made or
    /// locked.
    pub fn take(folder: &Path) -> Result<Self, LockError> {
        create_dir_all(folder).map_err(FileError::io(folder, "making the folder"))?;
        let path = folder.join(LOCK_FILE);
        let opened = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path);
        let file = opened.map_err(FileError::io(&path, "opening"))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(LockError::InUse {
                folder: folder.to_owned(),
            }),
            Err(TryLockError::Error(source)) => Err(FileError::io(&path, "locking")(source).into()),
        }
    }
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    reason = "a failed step of a test is a failed test"
)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_writer_until_the_lock_is_dropped() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("run");
        let first = FolderLock::take(&folder).unwrap();
        let error = FolderLock::take(&folder).unwrap_err();
        assert!(matches!(error, LockError::InUse { .. }), "{error}");
        assert!(error.to_string().contains("run"), "{error}");
        drop(first);
        FolderLock::take(&folder).unwrap();
    }
}
