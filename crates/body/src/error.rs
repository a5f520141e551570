//! What can be wrong with a body file.

/// Why a body could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A GLB file lacks something or holds something else.
    #[error("body GLB, {place}: expected {expected}")]
    Glb {
        /// Where in the file.
        place: String,
        /// What should stand there.
        expected: String,
    },
    /// A model cannot be written as GLB.
    #[error("cannot write the body as GLB: {what}, got {got}")]
    Unwritable {
        /// What the format takes.
        what: &'static str,
        /// What the model has.
        got: String,
    },
    /// A SMPL-family file is not a readable `.npz` archive.
    #[error("body .npz: {reason}")]
    Npz {
        /// What the reader met.
        reason: String,
    },
    /// An array of a SMPL-family `.npz` file is missing or has another type, shape or content.
    #[error("body .npz, array `{key}`: expected {expected}, got {got}")]
    NpzArray {
        /// Key of the array.
        key: &'static str,
        /// Type, shape or range it should have.
        expected: String,
        /// What the file holds.
        got: String,
    },
}
