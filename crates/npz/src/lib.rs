//! NumPy archives (`.npz`), the format of bodies, motions, scans and fits.
//!
//! [`Archive`] reads arrays of numbers from untrusted files: types, shapes and sizes are
//! checked before anything is unpacked, and only the requested parts are kept. [`Writer`] writes under a
//! temporary name and renames, so a kill or a full disk leaves no partial file.

mod archive;
mod array;
mod error;
mod part;
mod writer;

pub use archive::Archive;
pub use array::Array;
pub use error::NpzError;
pub use writer::Writer;
