//! Why a mesh sequence could not be read or fitted.

use std::path::PathBuf;

use dynaskin_motion::MotionError;
use dynaskin_npz::NpzError;
use dynaskin_sim::{DatasetError, RunError, ShellError, SimError};

/// What can go wrong with scans and their fit, with the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
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
    /// A folder holds no mesh.
    #[error("{path} holds no .obj or .ply file; expected one mesh a frame, sorted by name")]
    NoMeshes {
        /// The folder.
        path: PathBuf,
    },
    /// A folder holds OBJ and PLY files: which of them are the frames is not clear.
    #[error("{path} holds both .obj and .ply files; keep one kind, one file a frame")]
    MixedKinds {
        /// The folder.
        path: PathBuf,
    },
    /// A mesh file cannot be read.
    #[error("{path}: {reason}")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it and where.
        reason: String,
    },
    /// An archive cannot be read or written.
    #[error("{path}: {source}")]
    Npz {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: NpzError,
    },
    /// The mesh is another than the body's.
    #[error(
        "{path}: {what} is {got}, the body has {expected}; scans must be registered to the body's mesh \
         (same vertices in the same order)"
    )]
    Topology {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: &'static str,
        /// The body's.
        expected: String,
        /// The file's.
        got: String,
    },
    /// More data than is read into memory.
    #[error("{path}: {got}, at most {limit} are read at a time; split the sequence")]
    TooLarge {
        /// The file or folder.
        path: PathBuf,
        /// What there is.
        got: String,
        /// The limit.
        limit: String,
    },
    /// A vertex is not finite.
    #[error(
        "{path}, frame {frame}, vertex {vertex}: {value} is no position; repair or leave out the frame"
    )]
    NotFinite {
        /// The file or folder.
        path: PathBuf,
        /// Frame, counted from 0.
        frame: usize,
        /// Vertex, counted from 0.
        vertex: usize,
        /// The value.
        value: f32,
    },
    /// A frame is no body in size.
    #[error(
        "{path}, frame {frame}: the mesh is {size_m:.3} m large, expected 0.5 to 4 m; say with --unit \
         whether its numbers are metres, centimetres or millimetres"
    )]
    Size {
        /// The file or folder.
        path: PathBuf,
        /// Frame, counted from 0.
        frame: usize,
        /// Diagonal of its bounding box in metres.
        size_m: f32,
    },
    /// The model does not come near the scan.
    #[error(
        "frame {frame}: after fitting the rigid skin is still {distance_m:.3} m from the scan (RMS), at most \
         {limit_m} m is a fit; check that the vertices are in the body's order, and --up and --unit"
    )]
    NoFit {
        /// Frame, counted from 0.
        frame: usize,
        /// Root mean square distance of the rigid vertices in metres.
        distance_m: f64,
        /// Largest accepted distance.
        limit_m: f64,
    },
    /// There are no frames.
    #[error("the sequence has no frames, expected at least one")]
    NoFrames,
    /// The body model is not one that can be fitted.
    #[error("the body cannot be fitted: {reason}")]
    Body {
        /// What is missing.
        reason: String,
    },
    /// A parameter is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        got: String,
        /// Its range.
        expected: &'static str,
    },
    /// A motion cannot be used.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A clip of the data set cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A motion of the check cannot be read.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The body of the check has no soft tissue.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// A clip of the check cannot be simulated.
    #[error(transparent)]
    Sim(#[from] SimError),
}
