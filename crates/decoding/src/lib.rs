//! What a graphics card decodes soft tissue from: a decoder's matrix as tables, how they and the numbers of
//! bodies lie in textures, and the shaders that read them.
//!
//! The renderer and the adapters of engines share it, so that each of these is said once. It knows no graphics
//! API and no network.

mod error;
mod matrix;
mod shaders;
mod texels;

pub use error::DecodingError;
pub use matrix::DecoderMatrix;
pub use shaders::{COMPUTE, FRAGMENT, MESH, MESH_COMPUTE, SHARED};
pub use texels::{BodyTexels, Tables};

/// Texels of a row, in every texture but that of the latents (`shader/decode.wgsl`, `WIDTH`).
pub const WIDTH: u32 = 512;

/// Bodies that one pass decodes at most (`shader/decode.wgsl`, `MAX_SLOTS`).
pub const MAX_SLOTS: usize = 64;
