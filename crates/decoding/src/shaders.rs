//! The shaders, in WGSL. It has no includes: a module is [`SHARED`] and what follows it, in order.

/// The decoder and what follows it. Every module begins with it.
pub const SHARED: &str = include_str!("../shader/decode.wgsl");

/// Compute passes that decode into buffers.
pub const COMPUTE: &str = include_str!("../shader/decode_compute.wgsl");

/// Fragment passes that decode into textures: for WebGL2, which has no compute pass.
pub const FRAGMENT: &str = include_str!("../shader/decode_fragment.wgsl");

/// Behind [`FRAGMENT`]: a vertex stage whose output is captured into the vertex buffers of an engine's mesh.
pub const MESH: &str = include_str!("../shader/decode_mesh.wgsl");

/// Behind [`COMPUTE`]: a pass that decodes in the order of an engine's mesh.
pub const MESH_COMPUTE: &str = include_str!("../shader/decode_mesh_compute.wgsl");
