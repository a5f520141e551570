//! Files and what they list.

use std::collections::HashSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::storage::{BytesStorage, DynStorage, FileStorage};
use hdf5_reader::{Hdf5File, OpenOptions};

use crate::ahead::Ahead;
use crate::elsewhere::Elsewhere;
use crate::error::told;
use crate::{Array, Hdf5Error, Kind};

/// Most bytes of chunks that are kept unpacked, for the next piece.
const CACHE_BYTES: usize = 32 << 20;
/// Most bytes that a chunk may unpack to, and that a read may give.
const MAX_CHUNK_BYTES: usize = 256 << 20;
const MAX_READ_BYTES: usize = 1 << 30;
/// Most bytes of the header of a group or data set.
const MAX_HEADER_BYTES: usize = 8 << 20;
/// Groups within groups, and data sets in all, that are listed.
const MAX_DEPTH: usize = 8;
const MAX_LISTED: usize = 100_000;

/// An open file.
#[derive(Clone)]
pub struct Hdf5 {
    path: PathBuf,
    file: Arc<Hdf5File>,
    elsewhere: Elsewhere,
}

/// A data set as a file lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Its path in the file, such as `50002_hips` or `group/data`.
    pub name: String,
    /// Length of each axis, the slowest first.
    pub shape: Vec<usize>,
    /// What its elements are.
    pub kind: Kind,
    /// The same for people, such as `16-bit floats`.
    pub elements: String,
}

impl Hdf5 {
    /// Opens a file. Its data sets are read when they are asked for.
    ///
    /// # Errors
    /// [`Hdf5Error`] where it cannot be opened, is of another kind, or is cut off.
    pub fn open(path: &Path) -> Result<Self, Hdf5Error> {
        let io = |source| Hdf5Error::Io {
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(io)?;
        let storage = FileStorage::from_file(file).map_err(|error| structure(path, &error))?;
        Self::from_storage(path, Arc::new(Ahead::new(Arc::new(storage))))
    }

    /// A file that is in memory. `path` only names it in messages.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, Hdf5Error> {
        Self::from_storage(path, Arc::new(BytesStorage::new(bytes)))
    }

    fn from_storage(path: &Path, storage: DynStorage) -> Result<Self, Hdf5Error> {
        let elsewhere = Elsewhere::default();
        let options = OpenOptions::default()
            .with_chunk_cache_bytes(CACHE_BYTES)
            .with_max_chunk_bytes(MAX_CHUNK_BYTES)
            .with_max_read_bytes(MAX_READ_BYTES)
            .with_max_object_header_bytes(MAX_HEADER_BYTES)
            .with_external_link_resolver(Arc::new(elsewhere.clone()));
        let got = storage.len();
        let file =
            Hdf5File::from_storage_with_options(storage, options).map_err(|error| match error {
                Error::InvalidMagic => Hdf5Error::NotHdf5 {
                    path: path.to_owned(),
                },
                error => structure(path, &error),
            })?;
        // Counted from the beginning of the file, whatever block of the user's stands there.
        let expected = file.superblock().eof_address;
        if expected > got {
            return Err(Hdf5Error::CutOff {
                path: path.to_owned(),
                expected,
                got,
            });
        }
        Ok(Self {
            path: path.to_owned(),
            file: Arc::new(file),
            elsewhere,
        })
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All data sets, those of groups too, in the file's order.
    ///
    /// # Errors
    /// [`Hdf5Error`] for a group or data set that cannot be read, and for links to other files, which are not
    /// followed.
    pub fn list(&self) -> Result<Vec<Listed>, Hdf5Error> {
        let root = self
            .file
            .root_group()
            .map_err(|error| structure(&self.path, &error))?;
        let mut found = Vec::new();
        let mut seen = HashSet::from([root.address()]);
        self.list_group(&root, "", 0, &mut seen, &mut found)?;
        let files = self.elsewhere.files();
        if files.is_empty() {
            return Ok(found);
        }
        Err(Hdf5Error::Elsewhere {
            path: self.path.clone(),
            files: files.join(", "),
        })
    }

    fn list_group(
        &self,
        group: &Group,
        prefix: &str,
        depth: usize,
        seen: &mut HashSet<u64>,
        found: &mut Vec<Listed>,
    ) -> Result<(), Hdf5Error> {
        let (groups, arrays) = group
            .member_names()
            .map_err(|error| structure(&self.path, &error))?;
        if found.len() + groups.len() + arrays.len() > MAX_LISTED {
            return Err(Hdf5Error::Structure {
                path: self.path.clone(),
                reason: format!("it has more than {MAX_LISTED} data sets"),
            });
        }
        for name in arrays {
            let path = format!("{prefix}{name}");
            let dataset = group
                .dataset(&name)
                .map_err(|error| self.broken(&path, &error))?;
            found.push(Array::new(&self.path, &path, dataset)?.listed());
        }
        for name in groups {
            let child = group
                .group(&name)
                .map_err(|error| self.broken(&name, &error))?;
            // A group may hold one that is above it.
            if depth < MAX_DEPTH && seen.insert(child.address()) {
                let prefix = format!("{prefix}{name}/");
                self.list_group(&child, &prefix, depth + 1, seen, found)?;
            }
        }
        Ok(())
    }

    /// The data set of that path in the file.
    ///
    /// # Errors
    /// [`Hdf5Error::Missing`], or [`Hdf5Error::Data`] where it cannot be read.
    pub fn array(&self, name: &str) -> Result<Array, Hdf5Error> {
        let dataset = self.file.dataset(name).map_err(|error| {
            if is_missing(&error) {
                Hdf5Error::Missing {
                    path: self.path.clone(),
                    name: name.to_owned(),
                }
            } else {
                self.broken(name, &error)
            }
        })?;
        Array::new(&self.path, name, dataset)
    }

    fn broken(&self, name: &str, error: &Error) -> Hdf5Error {
        Hdf5Error::Data {
            path: self.path.clone(),
            name: name.to_owned(),
            reason: told(error),
        }
    }
}

fn is_missing(error: &Error) -> bool {
    match error {
        Error::DatasetNotFound(_) | Error::GroupNotFound(_) => true,
        Error::Context { source, .. } => is_missing(source),
        _ => false,
    }
}

fn structure(path: &Path, error: &Error) -> Hdf5Error {
    Hdf5Error::Structure {
        path: path.to_owned(),
        reason: told(error),
    }
}

impl std::fmt::Debug for Hdf5 {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Hdf5").field(&self.path).finish()
    }
}
