//! What can be wrong with an archive.

use std::path::PathBuf;

/// Why an archive could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The bytes are no archive that NumPy writes.
    #[error("it is {what}, not an archive that numpy.savez writes; {what_to_do}")]
    Archive {
        /// What it is instead, as far as its first bytes tell.
        what: &'static str,
        /// How to come to an archive.
        what_to_do: &'static str,
    },
    /// An array is missing or has another type, shape or content.
    #[error("array `{key}`: expected {expected}, got {got}")]
    Array {
        /// Key of the array.
        key: String,
        /// Type, shape or range it should have.
        expected: String,
        /// What the file holds.
        got: String,
    },
    /// The file system refused.
    #[error("{path}: {action} failed: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The cause.
        source: std::io::Error,
    },
}

impl NpzError {
    /// An array that is not what it should be.
    pub fn array(key: &str, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self::Array {
            key: key.to_owned(),
            expected: expected.into(),
            got: got.into(),
        }
    }
}
