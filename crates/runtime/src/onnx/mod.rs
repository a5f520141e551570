//! From the bytes of an ONNX file to something that runs.
//!
//! tract's own ONNX front end registers every operator it has, builds an untyped model first, and
//! panics on some malformed files. The networks of the contract need thirteen operators, so this
//! module checks a graph value by value, with its own shape inference, and wires tract's core
//! operators directly: malformed files become typed errors, and the linker drops the rest of the
//! front end from the wasm file.

mod messages;
mod operators;
mod proto;
mod session;
mod translate;

pub use session::{Decoder, DecoderSession, Predictor, PredictorSession, PredictorState};

use crate::{Network, RuntimeError};
use tract_core::prelude::TypedModel;

/// A named input or output with its shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Port {
    pub name: String,
    pub shape: Vec<usize>,
}

/// A checked graph, ready to be optimised, with its inputs and outputs in file order.
#[derive(Debug)]
pub(crate) struct Graph {
    pub model: TypedModel,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
}

/// Reads and checks `onnx_bytes`.
///
/// # Errors
/// [`RuntimeError::NotOnnx`], [`RuntimeError::UnknownOperator`], [`RuntimeError::InvalidGraph`],
/// [`RuntimeError::Inference`] where tract refuses an operator that passed the checks.
pub(crate) fn read(network: Network, onnx_bytes: &[u8]) -> Result<Graph, RuntimeError> {
    let graph = proto::decode(network, onnx_bytes)?;
    translate::translate(network, &graph)
}

/// The error for a graph that contradicts itself at `place`.
fn invalid(network: Network, place: impl Into<String>, problem: impl Into<String>) -> RuntimeError {
    RuntimeError::InvalidGraph {
        network,
        place: place.into(),
        problem: problem.into(),
    }
}
