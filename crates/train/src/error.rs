//! What can go wrong between a folder of clips and a bundle.

use std::path::PathBuf;

use dynaskin_motion::MotionError;
use dynaskin_onnx::WriteError;
use dynaskin_runtime::RuntimeError;
use dynaskin_sim::{DatasetError, ShellError, SimError, TableError};
use thiserror::Error;

/// Why a data set could not be used, or a model not trained, written or measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrainError {
    /// The file system refused.
    #[error("{path}: {action} failed: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The cause.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] dynaskin_files::FileError),
    /// The data folder holds no clip.
    #[error(
        "{path} holds no `.safetensors` clip; make some with `dynaskin simulate` or `dynaskin fit-all`, \
             which writes them into the folder `clips` of its --out"
    )]
    EmptyData {
        /// The folder.
        path: PathBuf,
    },
    /// A clip file is damaged or no clip.
    #[error(transparent)]
    Clip(#[from] DatasetError),
    /// A clip was simulated on another body.
    #[error(
        "{path} was made with the body of SHA-256 {got}, but the body given has {expected}; \
         simulate or fit the clips again, or give the body they were made with"
    )]
    OtherBody {
        /// The clip.
        path: PathBuf,
        /// Hash of the body given.
        expected: String,
        /// Hash in the clip.
        got: String,
    },
    /// A clip has offsets over other vertices than the first clip.
    #[error(
        "{path} has offsets over another vertex list ({got} vertices) than {first} ({expected}); \
         make all clips of a data set with the same settings"
    )]
    MixedVertices {
        /// The clip.
        path: PathBuf,
        /// The clip that set the list.
        first: PathBuf,
        /// Number of vertices of the first clip.
        expected: usize,
        /// Number of vertices of this one.
        got: usize,
    },
    /// A clip is not at the model rate.
    #[error(
        "{path} has {got_hz} frames a second; models tick at 60, so resample before simulating"
    )]
    ClipRate {
        /// The clip.
        path: PathBuf,
        /// Frames a second.
        got_hz: f64,
    },
    /// A clip's name gives no source.
    #[error(
        "clip name `{name}` in {path} should be `source__shape`, such as `16_04__s2` or \
         `hop-190-090__s0`"
    )]
    ClipName {
        /// The clip.
        path: PathBuf,
        /// Its name.
        name: String,
    },
    /// The split leaves a set that cannot be empty without clips.
    #[error(
        "the split leaves no clip for {set}; the data set has {clips} clips in all. For clips of your own say \
         what is held out: --hold-out MOTION_OR_PERSON --validate-on MOTION"
    )]
    EmptySplit {
        /// `training` or `validation`.
        set: &'static str,
        /// Clips in the data set.
        clips: usize,
    },
    /// Something is to be held out that no clip is named after.
    #[error("there is no {wanted} `{name}` among the clips; there are {there}")]
    NoSuchName {
        /// `motion` or `motion or person`.
        wanted: &'static str,
        /// What was named.
        name: String,
        /// What could be named.
        there: String,
    },
    /// A motion is both held out and asked when to stop.
    #[error(
        "`{name}` is held out, so it cannot decide when to stop; give --validate-on another motion"
    )]
    HeldOutValidation {
        /// The motion.
        name: String,
    },
    /// The split file is not valid.
    #[error("{place}: {reason}")]
    Split {
        /// The file.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// A setting is out of range.
    #[error("setting `{setting}` is {got}, but should be {expected}")]
    Config {
        /// Name of the setting.
        setting: &'static str,
        /// What it is.
        got: String,
        /// What it should be.
        expected: String,
    },
    /// Nothing to train on.
    #[error("cannot train on `{device}`: {reason}")]
    Device {
        /// What was asked for.
        device: &'static str,
        /// Why not.
        reason: String,
    },
    /// Training left the finite numbers.
    #[error(
        "the loss became {loss} in epoch {epoch}; train with a smaller --learning-rate (the best \
         weights so far are kept in the checkpoint)"
    )]
    Diverged {
        /// The epoch, from 1.
        epoch: usize,
        /// The loss.
        loss: f32,
    },
    /// A checkpoint cannot be continued.
    #[error("{path}: {reason}; start again without --resume")]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Numbers that should have been finite are not.
    #[error("{place} holds a number that is not finite")]
    NotFinite {
        /// Where.
        place: String,
    },
    /// A graph could not be written.
    #[error(transparent)]
    Onnx(#[from] WriteError),
    /// A motion could not be made.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The body has no tissue to simulate.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// The table of compliances beside the clips cannot be used.
    #[error(transparent)]
    Compliance(#[from] TableError),
    /// A simulation for comparison failed.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The runtime refused a pose, a bundle or a graph.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}

impl TrainError {
    /// For `map_err` on file operations.
    pub fn io(path: &std::path::Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            path,
            action,
            source,
        }
    }
}
