//! Why a binding cannot be used.

/// What is wrong with a binding, in a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BindingError {
    /// A binding cannot be read.
    #[error("the binding cannot be used: {problem}; bind the avatar again")]
    Invalid {
        /// What is wrong with it.
        problem: String,
    },
    /// A binding belongs to another avatar or another body.
    #[error("the binding was made for another {what}; bind this avatar again")]
    AnotherFile {
        /// `avatar` or `body`.
        what: &'static str,
    },
    /// A surface has another size than the mesh that was bound.
    #[error("mesh `{mesh}` has {vertices} vertices where it was bound, got {what}")]
    Surface {
        /// The mesh's name.
        mesh: String,
        /// Vertices that it was bound with.
        vertices: u32,
        /// What came instead.
        what: String,
    },
    /// A binding has no such mesh.
    #[error("the binding has {count} meshes, there is none with the number {mesh}")]
    NoMesh {
        /// The number that was asked for.
        mesh: usize,
        /// How many there are.
        count: usize,
    },
}
