//! ONNX graphs of dynaskin's contract (ARCHITECTURE.md, "ONNX"): read and written.
//!
//! [`read`] goes from the bytes of a file to a graph of tract's core operators. tract's own ONNX
//! front end registers every operator it has, builds an untyped model first, and panics on some
//! malformed files. The networks of the contract need fewer than twenty operators, so this crate
//! checks a graph value by value, with its own shape inference, and wires the operators directly:
//! malformed files become typed errors, and the linker drops the rest of the front end from the
//! wasm file.
//!
//! A [`Graph`] goes the other way. It is filled value by value; every operation checks shapes as it
//! is added, so that a graph that was built is a graph that loads. [`Graph::into_bytes`] gives the
//! file.
//!
//! ```
//! use dynaskin_onnx::{Graph, Precision};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut graph = Graph::new("decoder");
//! let latent = graph.input("latent", &[1, 2])?;
//! let weight = graph.weights("weight", &[2, 6], &[0.5; 12], Precision::Half)?;
//! let bias = graph.weights("bias", &[6], &[0.0; 6], Precision::Single)?;
//! let flat = graph.dense(&latent, &weight, &bias)?;
//! let offsets = graph.reshape(&flat, &[1, 2, 3])?;
//! graph.output("offsets", &offsets)?;
//! let onnx_bytes = graph.into_bytes();
//!
//! let graph = dynaskin_onnx::read(&onnx_bytes, 1)?;
//! assert_eq!(graph.outputs[0].shape, [1, 2, 3]);
//! # Ok(())
//! # }
//! ```
//!
//! Both work on the same [`messages`].

pub mod messages;
mod read;
mod write;

pub use read::{CheckedGraph, Port, ReadError, read};
pub use write::{Graph, GruWeights, LstmWeights, Precision, Steps, Value, WriteError};
