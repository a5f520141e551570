//! Why a file or a data set could not be read.

use std::path::PathBuf;

use hdf5_reader::error::Error;

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
    #[error("{path} cannot be read as HDF5: {reason}")]
    Structure {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// The file has links to other files.
    #[error(
        "{path} has links to other files ({files}), which are not followed; give those files themselves, or the \
         folder that they are in"
    )]
    Elsewhere {
        /// The file.
        path: PathBuf,
        /// Names of the others.
        files: String,
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

/// Filters that are not read, by their registered numbers.
const FILTERS: [(&str, &str); 8] = [
    ("32000", "LZF"),
    ("32001", "Blosc"),
    ("32004", "LZ4"),
    ("32008", "Bitshuffle"),
    ("32013", "ZFP"),
    ("32015", "Zstandard"),
    ("32026", "Blosc 2"),
    ("307", "bzip2"),
];
const AGAIN: &str = "copy or download the file again";
const REPACK: &str = "write it again with `h5repack -f GZIP=4 OLD NEW`";

/// Why the reader refused something, and what to do.
pub(crate) fn told(error: &Error) -> String {
    match error {
        Error::Context { source, .. } => told(source),
        Error::Io(error) => format!("reading failed: {error}"),
        Error::UnsupportedFilter(filter) => {
            let number = filter.rsplit(' ').next().unwrap_or(filter);
            let known = FILTERS.iter().find(|(known, _)| *known == number);
            let name = known.map_or_else(
                || format!("filter {number}"),
                |(_, name)| (*name).to_owned(),
            );
            format!("its numbers are packed with {name}, which is not read; {REPACK}")
        }
        Error::ResourceLimit(_) => {
            format!("its pieces are too large to be held; {REPACK} and smaller chunks (`-l`)")
        }
        Error::DecompressionError(_) | Error::FilterError(_) | Error::ChecksumMismatch { .. } => {
            format!("its packed numbers are damaged; {AGAIN}")
        }
        // Of the kinds that are met by this crate, only numbers in other files.
        Error::Other(_) => format!("its numbers lie in another file, which is not read; {REPACK}"),
        Error::UnsupportedEncoding(_)
        | Error::UnsupportedSuperblockVersion(_)
        | Error::UnsupportedObjectHeaderVersion(_)
        | Error::UnsupportedDatatypeClass(_)
        | Error::UnsupportedLayoutClass(_)
        | Error::UnsupportedLayoutVersion(_)
        | Error::UnsupportedChunkIndexType(_)
        | Error::UnsupportedFilterPipelineVersion(_) => {
            format!("it is stored in a way that is not read; {REPACK}")
        }
        _ => format!("it is damaged; {AGAIN}"),
    }
}
