//! Composition of the WGSL files into modules. WGSL has no includes: parts are concatenated, and
//! each part is written so that declarations never collide.

use dynaskin_decoding as decoding;

const SKIN: &str = include_str!("../shader/skin.wgsl");
const SKIN_COMPUTE: &str = include_str!("../shader/skin_compute.wgsl");
const FRAME: &str = include_str!("../shader/frame.wgsl");
const STUDIO: &str = include_str!("../shader/studio.wgsl");
const BACKDROP: &str = include_str!("../shader/backdrop.wgsl");
const FLOOR: &str = include_str!("../shader/floor.wgsl");
const BODY: &str = include_str!("../shader/body.wgsl");
const BODY_SKINNED: &str = include_str!("../shader/body_skinned.wgsl");
const BODY_SKINNING: &str = include_str!("../shader/body_skinning.wgsl");
const BODY_FROM_BUFFERS: &str = include_str!("../shader/body_from_buffers.wgsl");
const BODY_FROM_TEXTURES: &str = include_str!("../shader/body_from_textures.wgsl");
const SHADOW_SKINNED: &str = include_str!("../shader/shadow_skinned.wgsl");
const SHADOW_SKINNING: &str = include_str!("../shader/shadow_skinning.wgsl");
const SHADOW_FROM_BUFFERS: &str = include_str!("../shader/shadow_from_buffers.wgsl");
const SHADOW_FROM_TEXTURES: &str = include_str!("../shader/shadow_from_textures.wgsl");
const DECODED: &str = include_str!("../shader/decoded.wgsl");

/// One shader module: its parts in order.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Name for messages and labels.
    pub name: &'static str,
    parts: &'static [&'static str],
    /// Whether the module also has to work on WebGL2 (GLSL ES 3.00).
    pub on_webgl2: bool,
}

impl Shader {
    /// Compute pass that skins.
    pub const SKIN: Self = Self::new("skin", &[SKIN, SKIN_COMPUTE], false);
    /// Backdrop.
    pub const BACKDROP: Self = Self::new("backdrop", &[FRAME, STUDIO, BACKDROP], true);
    /// Floor.
    pub const FLOOR: Self = Self::new("floor", &[FRAME, STUDIO, FLOOR], true);
    /// Body over skinned buffers.
    pub const BODY_SKINNED: Self =
        Self::new("body_skinned", &[FRAME, STUDIO, BODY, BODY_SKINNED], false);
    /// Body skinned by its vertex stage.
    pub const BODY_SKINNING: Self = Self::new(
        "body_skinning",
        &[FRAME, STUDIO, SKIN, BODY, BODY_SKINNING, BODY_FROM_BUFFERS],
        true,
    );
    /// Body decoded by fragment passes and skinned by its vertex stage.
    pub const BODY_DECODED: Self = Self::new(
        "body_decoded",
        &[
            FRAME,
            STUDIO,
            SKIN,
            BODY,
            BODY_SKINNING,
            DECODED,
            BODY_FROM_TEXTURES,
        ],
        true,
    );
    /// Shadow over skinned buffers.
    pub const SHADOW_SKINNED: Self = Self::new("shadow_skinned", &[FRAME, SHADOW_SKINNED], false);
    /// Shadow skinned by its vertex stage.
    pub const SHADOW_SKINNING: Self = Self::new(
        "shadow_skinning",
        &[FRAME, SKIN, SHADOW_SKINNING, SHADOW_FROM_BUFFERS],
        true,
    );
    /// Shadow of a body decoded by fragment passes.
    pub const SHADOW_DECODED: Self = Self::new(
        "shadow_decoded",
        &[FRAME, SKIN, SHADOW_SKINNING, DECODED, SHADOW_FROM_TEXTURES],
        true,
    );
    /// Compute pass that decodes.
    pub const DECODE_COMPUTE: Self =
        Self::new("decode", &[decoding::SHARED, decoding::COMPUTE], false);
    /// Fragment passes that decode.
    pub const DECODE_FRAGMENT: Self = Self::new(
        "decode_fragment",
        &[decoding::SHARED, decoding::FRAGMENT],
        true,
    );

    /// Every module.
    pub const ALL: [Self; 11] = [
        Self::SKIN,
        Self::BACKDROP,
        Self::FLOOR,
        Self::BODY_SKINNED,
        Self::BODY_SKINNING,
        Self::SHADOW_SKINNED,
        Self::SHADOW_SKINNING,
        Self::BODY_DECODED,
        Self::SHADOW_DECODED,
        Self::DECODE_COMPUTE,
        Self::DECODE_FRAGMENT,
    ];

    const fn new(name: &'static str, parts: &'static [&'static str], on_webgl2: bool) -> Self {
        Self {
            name,
            parts,
            on_webgl2,
        }
    }

    /// The module's WGSL.
    pub fn wgsl(&self) -> String {
        self.parts.join("\n")
    }

    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.wgsl().into()),
        })
    }
}
