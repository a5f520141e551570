//! What reading gives.

use tract_core::prelude::TypedModel;

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
