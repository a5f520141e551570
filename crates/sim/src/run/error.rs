//! Why clips of a data set could not be simulated.

use std::path::PathBuf;

use dynaskin_motion::MotionError;

use crate::dataset::DatasetError;
use crate::shell::ShellError;
use crate::simulate::SimError;
use crate::solver::Unstable;

/// Why a data set or a clip of it could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A folder or file cannot be read or made.
    #[error("{path}: {reason}")]
    Io {
        /// The path.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The folder of captures holds none.
    #[error(
        "{path} holds no motion files (.bvh, .npz, .glb, .vrma); give the folder of motion captures"
    )]
    NoCaptures {
        /// The folder.
        path: PathBuf,
    },
    /// An option was given that no file has a use for.
    #[error("{option} is for {kinds} files, and {path} holds none; leave it out")]
    UnusedOption {
        /// The option of the command.
        option: &'static str,
        /// The folder.
        path: PathBuf,
        /// Endings of the files that the option is for.
        kinds: String,
    },
    /// A motion cannot be read or made.
    #[error("motion {motion}: {source}")]
    Motion {
        /// The motion.
        motion: String,
        /// Why.
        source: MotionError,
    },
    /// A clip of another body has this name.
    #[error("{path} was made with another body; give each body a folder of its own (--out)")]
    OtherBody {
        /// The clip's file, which stays as it is.
        path: PathBuf,
    },
    /// The disk filled up while this clip or an earlier one was written.
    #[error(
        "{path}: the disk is full; free some space or take another folder (--out) and run the same \
         command again: finished clips are kept"
    )]
    DiskFull {
        /// The clip's file, which was not written.
        path: PathBuf,
    },
    /// The body has no tissue to simulate.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// Ringing a region failed.
    #[error("ringing a region of the body: {0}")]
    Vibration(Unstable),
    /// The simulation failed.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The clip's file cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}
