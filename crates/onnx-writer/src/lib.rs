//! Writes ONNX graphs of dynaskin's contract (ARCHITECTURE.md, "ONNX") from Rust.
//!
//! A [`Graph`] is filled value by value; every operation checks shapes as it is added, so that a
//! graph that was built is a graph that loads. [`Graph::into_bytes`] gives the file.
//!
//! ```
//! use dynaskin_onnx_writer::{Graph, Precision};
//!
//! # fn main() -> Result<(), dynaskin_onnx_writer::WriteError> {
//! let mut graph = Graph::new("decoder");
//! let latent = graph.input("latent", &[1, 2])?;
//! let weight = graph.weights("weight", &[2, 6], &[0.5; 12], Precision::Half)?;
//! let bias = graph.weights("bias", &[6], &[0.0; 6], Precision::Single)?;
//! let flat = graph.dense(&latent, &weight, &bias)?;
//! let offsets = graph.reshape(&flat, &[1, 2, 3])?;
//! graph.output("offsets", &offsets)?;
//! let onnx_bytes = graph.into_bytes();
//! # assert!(!onnx_bytes.is_empty());
//! # Ok(())
//! # }
//! ```

mod cells;
mod convolutions;
mod error;
mod graph;
mod proto;

pub use cells::{GruWeights, LstmWeights};
pub use convolutions::Steps;
pub use error::WriteError;
pub use graph::{Graph, Precision, Value};
