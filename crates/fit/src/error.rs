//! Why a mesh sequence could not be read or fitted.

use std::path::PathBuf;

use dynaskin_hdf5::Hdf5Error;
use dynaskin_motion::MotionError;
use dynaskin_npz::NpzError;
use dynaskin_sim::{DatasetError, RunError, ShellError, SimError};
use glam::Vec3;

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
    /// An HDF5 file cannot be read.
    #[error(transparent)]
    Hdf5(#[from] Hdf5Error),
    /// An HDF5 file holds other things.
    #[error(
        "{path} holds no sequence: expected data sets of 32 or 64-bit floats, [vertices, 3, frames], and found \
         {found}; where it is something else, take it out of the folder"
    )]
    NoSequences {
        /// The file.
        path: PathBuf,
        /// Names, shapes and elements of its data sets.
        found: String,
    },
    /// An HDF5 file holds several sequences.
    #[error("{path} holds {count} sequences; choose one with --sequence NAME: {names}")]
    ChooseSequence {
        /// The file.
        path: PathBuf,
        /// How many.
        count: usize,
        /// Their names.
        names: String,
    },
    /// An HDF5 file has no sequence of that name.
    #[error("{path} has no sequence `{name}`; it has: {names}")]
    MissingSequence {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
        /// The names that it has.
        names: String,
    },
    /// A data set's numbers are of a kind that is not read.
    #[error(
        "{path} holds {elements}; write it as floats of 32 or 64 bits, as `.astype(\"float32\")` makes them"
    )]
    Elements {
        /// The file and the data set.
        path: PathBuf,
        /// What it holds, such as `16-bit floats`.
        elements: String,
    },
    /// A data set is no sequence of the body's mesh.
    #[error(
        "{path} is {shape:?}; expected floats with three axes, of which one is {vertices} long (the body's \
         vertices) and another 3: scans must be registered to the body's mesh"
    )]
    NoLayout {
        /// The file and the data set.
        path: PathBuf,
        /// Lengths of its axes.
        shape: Vec<usize>,
        /// Vertices of the body.
        vertices: usize,
    },
    /// A data set can be read in several ways.
    #[error(
        "{path} is {shape:?}, which can be read in more than one way; cut it or pad it to another number of \
         frames"
    )]
    AmbiguousLayout {
        /// The file and the data set.
        path: PathBuf,
        /// Lengths of its axes.
        shape: Vec<usize>,
    },
    /// There are no captures of people.
    #[error(
        "{path} holds no captures; expected HDF5 or .npz files, or folders of .obj or .ply files, named \
         PERSON_MOTION"
    )]
    NoCaptures {
        /// The file or folder.
        path: PathBuf,
    },
    /// A folder holds the frames of one sequence, or a file is one.
    #[error(
        "{path} is one sequence; give the folder that it is in, or fit it alone with `dynaskin fit`"
    )]
    OneSequence {
        /// The folder or file.
        path: PathBuf,
    },
    /// The name of a capture does not say whose it is.
    #[error("{path}: `{name}` does not say whose it is; name it PERSON_MOTION, such as 50002_hips")]
    NoPerson {
        /// The file or folder.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// The name of a capture cannot be that of a file.
    #[error(
        "{path}: {name:?} cannot name the files of its fit: it {problem}; rename the sequence PERSON_MOTION, \
         such as 50002_hips"
    )]
    BadName {
        /// The file or folder.
        path: PathBuf,
        /// The name.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Two captures would have the same files.
    #[error(
        "{first} and {second} would have the same files, because names count as the same where only capitals or \
         underscores differ; rename one"
    )]
    SameName {
        /// A file or folder, and its data set.
        first: String,
        /// The other.
        second: String,
    },
    /// All sequences of a person begin far from rest.
    #[error(
        "no sequence of {person} begins at rest: in the nearest, {nearest}, the joints are turned by \
         {degrees:.0} degrees on average in the first frame; add a sequence that begins with the person \
         standing, or give the person's shape with --shape {person}=b0,b1,...,b9"
    )]
    NeverAtRest {
        /// The person.
        person: String,
        /// The sequence that begins nearest to rest.
        nearest: String,
        /// The mean turn of its joints.
        degrees: f64,
    },
    /// The unit of scans cannot be found.
    #[error(
        "{path}: the edges of the first frame are {ratio:.3} times as long as the body's in metres, which is \
         neither metres, centimetres nor millimetres; say with --unit what the numbers are, and check that \
         the vertices are in the body's order"
    )]
    UnitUnknown {
        /// The file or folder.
        path: PathBuf,
        /// Median length of its edges over that of the body's in metres.
        ratio: f32,
    },
    /// The up axis of scans cannot be found.
    #[error(
        "{path}: the trunk stands along {trunk:.2} in the first frame, which is none of +y, +z and -y; say \
         with --up which axis points up, or turn the scans until one of these does"
    )]
    UpUnknown {
        /// The file or folder.
        path: PathBuf,
        /// Direction from the pelvis to the neck, of length 1.
        trunk: Vec3,
    },
    /// All vertices of a frame lie in one place.
    #[error(
        "{path}, frame {frame}: all vertices lie in one place, as where nothing was written; repair or leave out \
         the frame"
    )]
    Collapsed {
        /// The file or folder.
        path: PathBuf,
        /// Frame, counted from 0.
        frame: usize,
    },
    /// Left and right are changed.
    #[error(
        "{path}: the first frame is the body's mirror image, as where a left-handed world was taken for a \
         right-handed one; turn the sign of one coordinate"
    )]
    Mirrored {
        /// The file or folder.
        path: PathBuf,
    },
    /// The faces are others than the body's.
    #[error(
        "{path}: {problem}; scans must be registered to the body's mesh (same vertices in the same order)"
    )]
    Faces {
        /// The file.
        path: PathBuf,
        /// What is wrong with which face.
        problem: String,
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
    /// A vertex is far from all others.
    #[error(
        "{path}, frame {frame}, vertex {vertex}: it lies {distance_m:.3e} m from the body, which is no position; \
         repair or leave out the frame"
    )]
    FarAway {
        /// The file or folder.
        path: PathBuf,
        /// Frame, counted from 0.
        frame: usize,
        /// Vertex, counted from 0.
        vertex: usize,
        /// Distance from the median vertex in metres.
        distance_m: f32,
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
    #[error("{path} has no frames, expected at least one")]
    NoFrames {
        /// The file or folder.
        path: PathBuf,
    },
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
