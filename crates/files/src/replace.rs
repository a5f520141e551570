//! Files written aside, synced and renamed.

use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::FileError;

/// End of the names of files that are being written.
const SUFFIX: &str = ".part";

/// A file that is being written beside the one it is to replace. Dropped before [`Self::put`], it is
/// removed, and the other one stays.
#[derive(Debug)]
pub struct Replacement {
    path: PathBuf,
    aside: NamedTempFile,
}

impl Replacement {
    /// Starts a file that will stand at `path`. What runs that were killed left half written for the
    /// same place is removed.
    ///
    /// # Errors
    /// [`FileError`] where its folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, FileError> {
        let io = FileError::io(path, "creating a file beside");
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(path.file_name().unwrap_or_default());
        // A folder that cannot be read may still be written to.
        let _ = remove_half_written(folder, &prefix.to_string_lossy());
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(SUFFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // As files are made otherwise: the process's mask takes away what it takes away.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let aside = builder.tempfile_in(folder).map_err(io)?;
        // Shows `remove_leftovers` that the file has a writer. File systems without locks have no
        // leftovers removed, and lose nothing.
        let _ = aside.as_file().try_lock();
        Ok(Self {
            path: path.to_owned(),
            aside,
        })
    }

    /// The path of the file that is being written.
    pub fn path(&self) -> &Path {
        self.aside.path()
    }

    /// The file that is being written.
    pub fn file(&mut self) -> &mut File {
        self.aside.as_file_mut()
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// [`FileError`]; what stood there before is then still there.
    pub fn put(self) -> Result<(), FileError> {
        self.sync()?;
        self.rename()
    }

    /// Puts the file in its place unless there is one: of several processes that write the same file, the
    /// first has it. Says whether it was put there.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn put_first(self) -> Result<bool, FileError> {
        self.sync()?;
        let io = FileError::io(&self.path, "writing");
        match self.aside.persist_noclobber(&self.path) {
            Ok(_) => Ok(true),
            Err(error) if error.error.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(error) => Err(io(error.error)),
        }
    }

    fn sync(&self) -> Result<(), FileError> {
        let synced = self.aside.as_file().sync_all();
        synced.map_err(FileError::io(&self.path, "writing"))
    }

    fn rename(self) -> Result<(), FileError> {
        let io = FileError::io(&self.path, "replacing");
        match self.aside.persist(&self.path) {
            Ok(_) => Ok(()),
            Err(error) => Err(io(error.error)),
        }
    }
}

/// Makes sure that a file can be written at `path`, before the hours that its contents take: makes its folder,
/// and refuses a folder in its place and one that cannot be written into.
///
/// # Errors
/// [`FileError`].
pub fn check_place(path: &Path) -> Result<(), FileError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(FileError::io(folder, "making the folder"))?;
    }
    if path.is_dir() {
        let source = std::io::Error::from(ErrorKind::IsADirectory);
        return Err(FileError::io(path, "writing")(source));
    }
    Replacement::create(path).map(drop)
}

/// Writes a file whole or not at all.
///
/// # Errors
/// [`FileError`]; what stood there before is then still there.
pub fn replace(path: &Path, contents: &[u8]) -> Result<(), FileError> {
    replace_all(&[(path, contents)])
}

/// Writes a file whole unless it is there, and says whether it did.
///
/// # Errors
/// [`FileError`].
pub fn write_first(path: &Path, contents: &[u8]) -> Result<bool, FileError> {
    let mut replacement = Replacement::create(path)?;
    let done = replacement.file().write_all(contents);
    done.map_err(FileError::io(path, "writing"))?;
    replacement.put_first()
}

/// Writes files that belong together: all of them aside, then each into its place, in order. A full
/// disk and a folder in the place of a file leave all of them as they were. A kill between two renames leaves the first ones new: put
/// last the file that names the others.
///
/// # Errors
/// [`FileError`].
pub fn replace_all(files: &[(&Path, &[u8])]) -> Result<(), FileError> {
    let mut written = Vec::with_capacity(files.len());
    for (path, contents) in files {
        let mut replacement = Replacement::create(path)?;
        let done = replacement.file().write_all(contents);
        done.map_err(FileError::io(path, "writing"))?;
        replacement.sync()?;
        written.push(replacement);
    }
    // Found before the first has its place.
    if let Some((path, _)) = files.iter().find(|(path, _)| path.is_dir()) {
        let source = std::io::Error::from(ErrorKind::IsADirectory);
        return Err(FileError::io(path, "replacing")(source));
    }
    written.into_iter().try_for_each(Replacement::rename)
}

/// Removes files that runs which were killed have left half written in a folder, and says how many.
/// Files that another process is writing stay.
///
/// # Errors
/// [`FileError`] where the folder cannot be read.
pub fn remove_leftovers(folder: &Path) -> Result<usize, FileError> {
    remove_half_written(folder, ".")
}

/// The same of those whose names begin with `prefix`.
fn remove_half_written(folder: &Path, prefix: &str) -> Result<usize, FileError> {
    let entries = fs::read_dir(folder).map_err(FileError::io(folder, "reading"))?;
    let is_half_written = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(prefix) && name.ends_with(SUFFIX)
    };
    let half_written = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(is_half_written);
    let mut removed = 0;
    for path in half_written {
        let Ok(file) = File::open(&path) else {
            continue;
        };
        match file.try_lock() {
            Ok(()) => removed += usize::from(fs::remove_file(&path).is_ok()),
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
        }
    }
    Ok(removed)
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    reason = "a failed step of a test is a failed test"
)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_replace_older_ones_and_leave_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&a, "old").unwrap();
        replace_all(&[(&a, b"new"), (&b, b"second")]).unwrap();
        assert_eq!(fs::read_to_string(&a).unwrap(), "new");
        assert_eq!(fs::read_to_string(&b).unwrap(), "second");
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[test]
    fn of_those_who_write_first_only_one_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert!(write_first(&path, b"first").unwrap());
        assert!(!write_first(&path, b"second").unwrap());
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(names(folder.path()), ["a"]);
        write_first(&folder.path().join("none/a"), b"").unwrap_err();
    }

    #[test]
    fn one_that_cannot_be_written_leaves_all_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("first");
        fs::write(&first, "old").unwrap();
        let nowhere = folder.path().join("nowhere/second");
        let error = replace_all(&[(&first, b"new"), (&nowhere, b"new")]).unwrap_err();
        assert!(error.to_string().contains("nowhere"), "{error}");
        assert_eq!(fs::read_to_string(&first).unwrap(), "old");
        assert_eq!(names(folder.path()), ["first"]);
    }

    #[test]
    fn places_are_checked_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("new/file");
        check_place(&place).unwrap();
        assert_eq!(names(&folder.path().join("new")), [] as [&str; 0]);
        fs::write(&place, "old").unwrap();
        check_place(&place).unwrap();
        assert_eq!(fs::read_to_string(&place).unwrap(), "old");
        let error = check_place(&folder.path().join("new")).unwrap_err();
        assert!(error.to_string().contains("it is a folder"), "{error}");
        let error = check_place(&place.join("below")).unwrap_err();
        assert!(error.to_string().contains("file"), "{error}");
    }

    #[test]
    fn a_folder_in_the_place_of_one_leaves_all_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
        fs::write(&first, "old").unwrap();
        fs::create_dir(&second).unwrap();
        let error = replace_all(&[(&first, b"new"), (&second, b"new")]).unwrap_err();
        assert!(error.to_string().contains("second: replacing"), "{error}");
        assert_eq!(fs::read_to_string(&first).unwrap(), "old");
        assert_eq!(names(folder.path()), ["first", "second"]);
    }

    #[test]
    fn one_given_up_half_written_leaves_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old").unwrap();
        let mut replacement = Replacement::create(&path).unwrap();
        replacement.file().write_all(b"half of the ne").unwrap();
        drop(replacement);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[cfg(unix)]
    #[test]
    fn files_may_be_read_by_those_who_read_others() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let [plain, ours] = ["plain", "ours"].map(|name| folder.path().join(name));
        fs::write(&plain, "x").unwrap();
        replace(&ours, b"x").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&plain), mode(&ours));
    }

    #[test]
    fn a_second_run_removes_what_a_killed_one_left_of_its_file() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(".me.binding1a2b3c.part"), "half").unwrap();
        fs::write(folder.path().join(".other1a2b3c.part"), "half").unwrap();
        replace(&folder.path().join("me.binding"), b"whole").unwrap();
        assert_eq!(names(folder.path()), [".other1a2b3c.part", "me.binding"]);
    }

    #[test]
    fn leftovers_go_and_files_with_a_writer_stay() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(".dead-1a2b.part"), "half").unwrap();
        fs::write(folder.path().join("named-by-a-user.part"), "whole").unwrap();
        let mut alive = Replacement::create(&folder.path().join("alive")).unwrap();
        assert_eq!(remove_leftovers(folder.path()).unwrap(), 1);
        alive.file().write_all(b"done").unwrap();
        alive.put().unwrap();
        assert_eq!(names(folder.path()), ["alive", "named-by-a-user.part"]);
    }
}
