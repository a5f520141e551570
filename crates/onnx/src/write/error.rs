//! What can go wrong while a graph is built.

use thiserror::Error;

/// A graph that would not have been a valid ONNX file of the contract.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A name was given to two values.
    #[error("the graph already has a value named `{name}`; give each value its own name")]
    DuplicateName {
        /// The name given twice.
        name: String,
    },
    /// The number of weights is not the product of the shape.
    #[error("`{name}` has {got} numbers, but its shape {shape:?} asks for {expected}")]
    WeightCount {
        /// The weights' name.
        name: String,
        /// The shape given.
        shape: Vec<usize>,
        /// Product of the shape.
        expected: usize,
        /// Numbers given.
        got: usize,
    },
    /// A weight is NaN or infinite, or does not fit half precision.
    #[error(
        "`{name}` holds {value} at index {index}, which cannot be stored; train with a smaller \
         learning rate, or store the weights in single precision if the number is finite"
    )]
    WeightValue {
        /// The weights' name.
        name: String,
        /// Index of the number.
        index: usize,
        /// The number.
        value: f32,
    },
    /// An operation was given shapes that do not fit together.
    #[error("{op}: {expected}, got {got:?}")]
    Shape {
        /// ONNX operator, such as `Gemm`.
        op: &'static str,
        /// What was expected, in words.
        expected: String,
        /// The shapes of the operands.
        got: Vec<Vec<usize>>,
    },
}
