//! WebAssembly bindings of [`dynaskin_render`]: draws to a canvas with WebGPU where there is one,
//! with WebGL2 elsewhere. A wasm file of its own, so that pages with an engine of their own never
//! download wgpu.
//!
//! Errors are JavaScript `Error`s with a `code`: `argument` (lengths, ranges, numbers that are not
//! finite), `no-adapter`, `no-read-back`, `lost` (make a new renderer), `gpu`.

#[cfg(target_arch = "wasm32")]
mod backend;
#[cfg(target_arch = "wasm32")]
mod error;
#[cfg(target_arch = "wasm32")]
mod renderer;

#[cfg(target_arch = "wasm32")]
pub use renderer::{Renderer, heat_ramp};
