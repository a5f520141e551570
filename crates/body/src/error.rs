//! What can be wrong with a body file.

/// Why a body could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A GLB file lacks something or holds something else.
    #[error("body GLB, {0}")]
    Glb(#[from] dynaskin_glb::GlbError),
    /// A model cannot be written as GLB.
    #[error("cannot write the body as GLB: {what}, got {got}")]
    Unwritable {
        /// What the format takes.
        what: &'static str,
        /// What the model has.
        got: String,
    },
    /// A SMPL-family file is no readable `.npz` archive, or an array in it is missing or has another
    /// type, shape or content.
    #[cfg(feature = "smpl")]
    #[error("body as .npz: {0}")]
    Npz(#[from] dynaskin_npz::NpzError),
    /// A SMPL-family file is a Python pickle, as they are published.
    #[cfg(feature = "smpl")]
    #[error(
        "this is a Python pickle, which may run programs when it is opened and is not read here; \
         convert it to .npz once, in Python: numpy.savez(\"smpl.npz\", **{{key: array}}) with \
         v_template, shapedirs, posedirs, J_regressor (`.toarray()`), weights, kintree_table and f"
    )]
    Pickle,
}
