//! Why a file or a data set could not be read.

use std::path::PathBuf;

/// What can go wrong with an HDF5 file, with the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Hdf5Error {
    /// The file system refused.
    #[error("{path}: opening failed: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file is of another kind.
    #[error("{path} is no HDF5 file: its first bytes are not HDF5's")]
    NotHdf5 {
        /// The file.
        path: PathBuf,
    },
    /// The end of the file is missing.
    #[error(
        "{path} is cut off: it has {got} bytes of {expected}; copy or download it again, and compare its \
         checksum with its source's"
    )]
    CutOff {
        /// The file.
        path: PathBuf,
        /// Bytes that the file says it has.
        expected: u64,
        /// Bytes that it has.
        got: u64,
    },
    /// The file's structure cannot be read.
    #[error("{path} cannot be read as HDF5: {reason}; copy or download it again")]
    Structure {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// There is no data set of that name.
    #[error("{path} has no data set `{name}`")]
    Missing {
        /// The file.
        path: PathBuf,
        /// The data set.
        name: String,
    },
    /// A data set cannot be read.
    #[error("{path}, data set `{name}`: {reason}")]
    Data {
        /// The file.
        path: PathBuf,
        /// The data set.
        name: String,
        /// What is wrong with it, and what to do.
        reason: String,
    },
}
