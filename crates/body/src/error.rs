//! What can be wrong with a body file.

/// Why a body could not be read.
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
}
