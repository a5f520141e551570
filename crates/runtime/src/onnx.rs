//! ONNX files as graphs of one network, and the errors of what breaks their contract.

use crate::{Network, RuntimeError};
use dynaskin_onnx::ReadError;
pub(crate) use dynaskin_onnx::{CheckedGraph as Graph, Port};

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
    dynaskin_onnx::read(onnx_bytes, rows).map_err(|error| unreadable(network, error))
}

/// The error for a file that cannot be read.
fn unreadable(network: Network, error: ReadError) -> RuntimeError {
    match error {
        ReadError::NotOnnx { reason } => RuntimeError::NotOnnx { network, reason },
        ReadError::UnknownOperator {
            node,
            operator,
            supported,
        } => RuntimeError::UnknownOperator {
            network,
            node,
            operator,
            supported,
        },
        ReadError::InvalidGraph { place, problem } => RuntimeError::InvalidGraph {
            network,
            place,
            problem,
        },
        ReadError::Refused { reason } => RuntimeError::Inference { network, reason },
    }
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
