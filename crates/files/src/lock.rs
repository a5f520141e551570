//! Folders that one process at a time writes into, or several that do parts of one piece of work.

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
        Self::lock(folder, File::try_lock)
    }

    /// Locks a folder against those who [`Self::take`] it, beside others who share it.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn share(folder: &Path) -> Result<Self, LockError> {
        Self::lock(folder, File::try_lock_shared)
    }

    fn lock(
        folder: &Path,
        try_lock: impl FnOnce(&File) -> Result<(), TryLockError>,
    ) -> Result<Self, LockError> {
        create_dir_all(folder).map_err(FileError::io(folder, "making the folder"))?;
        let path = folder.join(LOCK_FILE);
        let opened = File::options()
            .create(true)
            .truncate(false)
            // Some network file systems share locks of readable files only.
            .read(true)
            .write(true)
            .open(&path);
        let file = opened.map_err(FileError::io(&path, "opening"))?;
        match try_lock(&file) {
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

    #[test]
    fn those_who_share_a_folder_keep_out_one_who_takes_it() {
        let folder = tempfile::tempdir().unwrap();
        let parts = [(); 2].map(|()| FolderLock::share(folder.path()).unwrap());
        FolderLock::take(folder.path()).unwrap_err();
        drop(parts);
        let _whole = FolderLock::take(folder.path()).unwrap();
        FolderLock::share(folder.path()).unwrap_err();
    }
}
