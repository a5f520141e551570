//! WebAssembly bindings of [`dynaskin_render`]: draws to a canvas with WebGPU if there is an adapter,
//! otherwise with WebGL2. A separate wasm file, so pages with their own engine never
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
