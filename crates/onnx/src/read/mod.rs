//! From the bytes of an ONNX file to something that runs.

#[cfg(feature = "convolutions")]
mod convolutions;
mod entries;
mod error;
mod operators;
mod proto;
mod translate;

pub use error::ReadError;

use tract_core::prelude::TypedModel;

/// Most nodes of a graph, and most initialisers; the largest network of the project has about sixty.
const MAX_NODES: usize = 4096;

/// A named input or output with its shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Its name in the file.
    pub name: String,
    /// Lengths of its axes.
    pub shape: Vec<usize>,
}

/// A checked graph, ready to be optimised, with its inputs and outputs in file order.
#[derive(Debug)]
pub struct CheckedGraph {
    /// The graph in tract's core operators.
    pub model: TypedModel,
    /// What it reads.
    pub inputs: Vec<Port>,
    /// What it puts out.
    pub outputs: Vec<Port>,
}

/// Reads and checks `onnx_bytes`. Inputs of one row get `rows` rows, and so does all that is computed
/// from them.
///
/// # Errors
/// [`ReadError::NotOnnx`], [`ReadError::UnknownOperator`], [`ReadError::InvalidGraph`],
/// [`ReadError::Refused`] where tract refuses an operator that passed the checks.
pub fn read(onnx_bytes: &[u8], rows: usize) -> Result<CheckedGraph, ReadError> {
    let graph = proto::decode(onnx_bytes)?;
    translate::translate(&graph, rows)
}

/// The error for a graph that contradicts itself at `place`.
fn invalid(place: impl Into<String>, problem: impl Into<String>) -> ReadError {
    ReadError::InvalidGraph {
        place: place.into(),
        problem: problem.into(),
    }
}

/// The error for more than [`MAX_NODES`].
fn too_many_nodes() -> ReadError {
    let problem = format!("more than {MAX_NODES} nodes or initialisers");
    invalid("graph", problem)
}
