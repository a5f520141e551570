//! The soft-tissue simulator of dynaskin and the data set it writes.

mod dataset;

pub use dataset::{ClipData, ClipHeader, DatasetError};
