//! From the bytes of an ONNX file to something that runs.

mod checked;
#[cfg(feature = "convolutions")]
mod convolutions;
mod entries;
mod error;
mod operators;
mod proto;
mod translate;

pub use checked::{CheckedGraph, Port};
pub use error::ReadError;

/// Reads and checks `onnx_bytes`. Inputs of one row get `rows` rows, and so does all that is computed
/// from them.
///
/// # Errors
/// [`ReadError::NotOnnx`], [`ReadError::UnknownOperator`], [`ReadError::LeftOut`],
/// [`ReadError::InvalidGraph`], [`ReadError::Refused`] where tract refuses an operator that passed the
/// checks.
pub fn read(onnx_bytes: &[u8], rows: usize) -> Result<CheckedGraph, ReadError> {
    let graph = proto::decode(onnx_bytes)?;
    translate::translate(&graph, rows)
}
