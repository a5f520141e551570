//! NumPy archives (`.npz`): bodies, motions and scans come in them, fits go out in them.
//!
//! [`Archive`] reads arrays of numbers from files that are not trusted: types, shapes and sizes are
//! checked before anything is unpacked, and only what is asked for is kept. [`Writer`] writes under a
//! temporary name and renames, so that a kill or a full disk leaves no half file.

mod archive;
mod array;
mod error;
mod part;
mod writer;

pub use archive::Archive;
pub use array::Array;
pub use error::NpzError;
pub use writer::Writer;
