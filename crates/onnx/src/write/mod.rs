//! Graphs of the contract, built value by value.

mod cells;
mod convolutions;
mod error;
mod graph;
mod proto;

pub use cells::{GruWeights, LstmWeights};
pub use convolutions::Steps;
pub use error::WriteError;
pub use graph::{Graph, Precision, Value};
