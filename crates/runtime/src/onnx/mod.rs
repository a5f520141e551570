//! From the bytes of an ONNX file to something that runs.
//!
//! tract's own ONNX front end registers every operator it has, builds an untyped model first, and
//! panics on some malformed files. The networks of the contract need fewer than twenty operators, so
//! this module checks a graph value by value, with its own shape inference, and wires tract's core
//! operators directly: malformed files become typed errors, and the linker drops the rest of the
//! front end from the wasm file.

mod convolutions;
mod messages;
mod operators;
mod proto;
mod translate;

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

/// Reads and checks `onnx_bytes`. Inputs of one row get `rows` rows, and so does all that is computed
/// from them.
///
/// # Errors
/// [`RuntimeError::NotOnnx`], [`RuntimeError::UnknownOperator`], [`RuntimeError::InvalidGraph`],
/// [`RuntimeError::Inference`] where tract refuses an operator that passed the checks.
pub(crate) fn read(
    network: Network,
    onnx_bytes: &[u8],
    rows: usize,
) -> Result<Graph, RuntimeError> {
    let graph = proto::decode(network, onnx_bytes)?;
    translate::translate(network, &graph, rows)
}

/// Index and length of the port `name`, which must have the shape [1, length].
pub(crate) fn row(
    network: Network,
    ports: &[Port],
    name: &str,
) -> Result<(usize, usize), RuntimeError> {
    let Some(index) = ports.iter().position(|port| port.name == name) else {
        let expected = format!("a value `{name}`");
        return Err(broken(network, "ports", expected, names(ports)));
    };
    match ports[index].shape[..] {
        [1, length] => Ok((index, length)),
        _ => {
            let got = format!("{:?}", ports[index].shape);
            Err(broken(network, format!("`{name}`"), "shape [1, N]", got))
        }
    }
}

pub(crate) fn names(ports: &[Port]) -> String {
    let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
    format!("{names:?}")
}

/// The error for a graph that is not what the contract asks for.
pub(crate) fn broken(
    network: Network,
    place: impl Into<String>,
    expected: impl Into<String>,
    got: impl Into<String>,
) -> RuntimeError {
    RuntimeError::BrokenContract {
        network,
        place: place.into(),
        expected: expected.into(),
        got: got.into(),
    }
}

/// The error for a graph that contradicts itself at `place`.
fn invalid(network: Network, place: impl Into<String>, problem: impl Into<String>) -> RuntimeError {
    RuntimeError::InvalidGraph {
        network,
        place: place.into(),
        problem: problem.into(),
    }
}
