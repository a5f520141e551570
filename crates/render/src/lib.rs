//! Draws skinned bodies in a studio with wgpu: on WebGPU and native adapters a compute pass skins
//! positions and normals, which are then drawn and can be read back; on WebGL2 the vertex stage
//! skins. Both run one WGSL function over the same inputs.
//!
//! The caller passes constant data once per body ([`BodyMesh`]), and per frame the rest-pose
//! surface with its soft-tissue offsets ([`Renderer::set_surface`]) and one matrix per joint
//! ([`Renderer::set_skin_matrices`]). Frames write into existing buffers and allocate none.
//!
//! Light is computed linearly, tone-mapped in the fragment stage and encoded to sRGB there, the
//! same on every backend. A shadow map holds the key light's view; its vertices are the ones drawn.
//!
//! Where offsets are a matrix times latents ([`DecoderMatrix`]), the card can make the surface itself:
//! the caller passes latents alone ([`Renderer::set_latents`]), and all bodies of a decoder are decoded by
//! a few passes.
//!
//! It does not depend on networks, clocks or JavaScript.

mod body;
mod camera;
mod check;
mod decoder;
mod decoding;
mod error;
mod gpu;
mod gpu_data;
mod heat;
mod look;
mod mesh;
mod paint;
mod parts;
mod pipelines;
mod readback;
mod renderer;
mod shaders;
mod shadow;
mod studio;
mod targets;

pub use body::OffsetSizes;
pub use camera::Camera;
pub use decoding::DecoderId;
pub use dynaskin_decoding::DecoderMatrix;
pub use dynaskin_skeleton::Skinning;
pub use error::RenderError;
pub use gpu::{DeviceLost, Gpu, SkinningPath};
pub use heat::heat_ramp_srgb;
pub use look::Look;
pub use mesh::BodyMesh;
pub use renderer::{Background, BodyId, Frame, Renderer};
pub use shaders::Shader;
pub use targets::PixelSize;
// Callers make the instance and the surface.
pub use wgpu;
