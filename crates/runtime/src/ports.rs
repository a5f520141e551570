//! A network's inputs and outputs, and the errors of what breaks their contract.

use serde::{Deserialize, Serialize};

use crate::{Network, RuntimeError};

/// A named input or output with its shape.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Port {
    /// Its name in the file.
    pub name: String,
    /// Lengths of its axes.
    pub shape: Vec<usize>,
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
