//! What can be wrong with a file.

use thiserror::Error;

/// A file that cannot be used. All kinds are known to callers, who say which network it was.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
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
