//! ONNX files as graphs of tract.

use dynaskin_onnx::ReadError;
use tract_core::prelude::TypedModel;

use crate::ports::Port;
use crate::{Network, RuntimeError};

/// A checked graph of one network, with its inputs and outputs in file order.
#[derive(Debug)]
pub(crate) struct Graph {
    /// The graph in tract's core operators.
    pub model: TypedModel,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
}

/// Reads and checks `onnx_bytes`. Inputs of one row get `rows` rows, and so does all that is computed
/// from them.
///
/// # Errors
/// [`RuntimeError::NotOnnx`], [`RuntimeError::UnknownOperator`], [`RuntimeError::LeftOut`],
/// [`RuntimeError::InvalidGraph`], [`RuntimeError::Inference`] where tract refuses an operator that passed the checks.
pub(crate) fn read(
    network: Network,
    onnx_bytes: &[u8],
    rows: usize,
) -> Result<Graph, RuntimeError> {
    let graph =
        dynaskin_onnx::read(onnx_bytes, rows).map_err(|error| unreadable(network, error))?;
    let ports = |ports: Vec<dynaskin_onnx::Port>| {
        let ports = ports.into_iter();
        ports.map(|port| Port {
            name: port.name,
            shape: port.shape,
        })
    };
    Ok(Graph {
        model: graph.model,
        inputs: ports(graph.inputs).collect(),
        outputs: ports(graph.outputs).collect(),
    })
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
        ReadError::LeftOut { operator, .. } => RuntimeError::LeftOut {
            place: format!("the {network}"),
            needs: format!("the operator {operator}"),
        },
        ReadError::InvalidGraph { place, problem } => RuntimeError::InvalidGraph {
            network,
            place,
            problem,
        },
        ReadError::Refused { reason } => RuntimeError::Inference { network, reason },
        other => RuntimeError::Inference {
            network,
            reason: other.to_string(),
        },
    }
}
