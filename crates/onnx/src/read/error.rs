//! What can be wrong with a file.

use thiserror::Error;

/// Most nodes of a graph, and most initialisers; the largest network of the project has about sixty.
pub(super) const MAX_NODES: usize = 4096;

/// A file that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The bytes are no ONNX file.
    #[error("not an ONNX file: {reason}; check that the file is complete")]
    NotOnnx {
        /// What the decoder found.
        reason: String,
    },
    /// The graph uses an operator outside the set that is implemented.
    #[error("node `{node}` uses the operator {operator}, which is not one of {supported}")]
    UnknownOperator {
        /// The node's name.
        node: String,
        /// The operator, with its domain if it is not ONNX's own.
        operator: String,
        /// The operators there are.
        supported: String,
    },
    /// The graph uses an operator that this build leaves out.
    #[error(
        "node `{node}` uses the operator {operator}, which this build leaves out; build dynaskin-onnx \
         with the feature `convolutions`"
    )]
    LeftOut {
        /// The node's name.
        node: String,
        /// The operator.
        operator: String,
    },
    /// The graph contradicts itself or the ONNX operators' definitions.
    #[error("not a valid graph: {place}: {problem}; export it again")]
    InvalidGraph {
        /// Node, value or field.
        place: String,
        /// What is wrong with it.
        problem: String,
    },
    /// tract refused an operator that passed the checks.
    #[error("the graph could not be set up: {reason}")]
    Refused {
        /// tract's message.
        reason: String,
    },
}

/// The error for a graph that contradicts itself at `place`.
pub(super) fn invalid(place: impl Into<String>, problem: impl Into<String>) -> ReadError {
    ReadError::InvalidGraph {
        place: place.into(),
        problem: problem.into(),
    }
}

/// The error for more than [`MAX_NODES`].
pub(super) fn too_many_nodes() -> ReadError {
    let problem = format!("more than {MAX_NODES} nodes or initialisers");
    invalid("graph", problem)
}
