//! Arrays of numbers in HDF5 files.
//!
//! [`Hdf5`] opens a file and lists its data sets; [`Array`] is one of them, read in pieces, so memory holds only
//! one piece. Files are read with positioned reads, not mapped into memory: a file that becomes
//! shorter while it is read is an error. The work that a damaged file can demand is bounded.

mod ahead;
mod array;
mod elsewhere;
mod error;
mod file;

pub use array::{Array, Kind};
pub use error::Hdf5Error;
pub use file::{Hdf5, Listed};
