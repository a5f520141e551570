//! The data set's clip format: one safetensors file per clip (ARCHITECTURE, "Data set").

mod read;
mod write;

use std::path::PathBuf;

use dynaskin_body::{Pose, SHAPE_COUNT};
use glam::Vec3;
use half::f16;

use dynaskin_body::Materials;

/// Value of the metadata entry `format`.
const FORMAT: &str = "dynaskin-clip";
/// Value of the metadata entry `version`.
const VERSION: &str = "2";

/// One simulated (or fitted) clip: poses of one body shape at 60 Hz and the soft tissue's offsets.
///
/// Offsets are kept in half precision, as in the file: at most 0.06 mm of rounding below 25 cm.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipData {
    /// Name of the clip, such as `16_04__s2`.
    pub name: String,
    /// SHA-256 of the body GLB that the clip was made with, lower-case hex.
    pub body_sha256: String,
    /// Frames per second.
    pub rate_hz: f64,
    /// Seed of the run.
    pub seed: u64,
    /// Simulator settings as JSON; `{}` for clips that were not simulated.
    pub sim_json: String,
    /// Shape coefficients β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// Material multipliers of the regions; [`Materials::NOMINAL`] where none are known.
    pub materials: Materials,
    /// Body vertices that have offsets, ascending.
    pub vertices: Vec<u32>,
    /// Poses, one a frame.
    pub poses: Vec<Pose>,
    /// Rest-pose offsets in metres, `[frame][vertex][xyz]`, of `vertices` only.
    pub offsets_rest_m: Vec<f16>,
}

impl ClipData {
    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.poses.len()
    }

    /// The offsets of one frame, `[vertex][xyz]` in metres.
    ///
    /// # Panics
    /// If `frame` is not below [`Self::frame_count`].
    pub fn frame_offsets_rest_m(&self, frame: usize) -> &[f16] {
        let stride = self.vertices.len() * 3;
        &self.offsets_rest_m[frame * stride..(frame + 1) * stride]
    }

    /// The offset in metres of `vertices[slot]` at `frame`.
    ///
    /// # Panics
    /// If `frame` or `slot` is out of range.
    pub fn offset_rest_m(&self, frame: usize, slot: usize) -> Vec3 {
        let at = (frame * self.vertices.len() + slot) * 3;
        Vec3::from_array(std::array::from_fn(|axis| {
            self.offsets_rest_m[at + axis].to_f32()
        }))
    }
}

/// What a clip file says about itself, without its frames: enough to list and split a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipHeader {
    /// Name of the clip.
    pub name: String,
    /// SHA-256 of the body GLB, lower-case hex.
    pub body_sha256: String,
    /// Frames per second.
    pub rate_hz: f64,
    /// Seed of the run.
    pub seed: u64,
    /// Simulator settings as JSON.
    pub sim_json: String,
    /// Material multipliers of the regions.
    pub materials: Materials,
    /// Number of frames.
    pub frame_count: usize,
    /// Body vertices that have offsets.
    pub vertices: Vec<u32>,
}

/// Why a clip file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
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
    /// Not a safetensors file, or a damaged one.
    #[error(
        "{path} is no whole clip, but cut off or damaged ({reason}); remove it, and simulate or fit it again"
    )]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A safetensors file whose metadata are not those of a clip of this version.
    #[error(
        "{path}: metadata `{key}` should be {expected}, found {got}; clips of older versions have \
         to be simulated again"
    )]
    Metadata {
        /// The file.
        path: PathBuf,
        /// The metadata entry.
        key: &'static str,
        /// What was expected.
        expected: String,
        /// What stands there.
        got: String,
    },
    /// A tensor is missing or has the wrong type or shape.
    #[error("{path}: tensor `{tensor}` should be {expected}, found {got}")]
    Tensor {
        /// The file.
        path: PathBuf,
        /// The tensor.
        tensor: &'static str,
        /// Expected type and shape.
        expected: String,
        /// Found type and shape, or `nothing`.
        got: String,
    },
    /// A tensor holds a value that no clip can have.
    #[error("{path}: tensor `{tensor}`, frame {frame}: {reason}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The tensor.
        tensor: &'static str,
        /// The first frame with such a value (0 for tensors without frames).
        frame: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The clip given to be written contradicts itself.
    #[error("clip {name}: {reason}")]
    Inconsistent {
        /// The clip.
        name: String,
        /// What is wrong.
        reason: String,
    },
}

impl From<dynaskin_files::FileError> for DatasetError {
    fn from(error: dynaskin_files::FileError) -> Self {
        Self::Io {
            path: error.path,
            action: error.action,
            source: error.source,
        }
    }
}
