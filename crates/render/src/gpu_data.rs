//! Mirrors of the shaders' uniform structs, with explicit padding.

use bytemuck::{Pod, Zeroable};
use dynaskin_decoding::MAX_SLOTS;
use dynaskin_skeleton::{DualQuat, Skinning};
use glam::{Affine3A, Mat4};

/// Joints of SMPL's skeleton (`shader/skin.wgsl`, `JOINT_COUNT`).
pub(crate) const JOINT_COUNT: usize = 24;

/// Colours of the heat ramp that the shader interpolates (`shader/frame.wgsl`, `HEAT_STOPS`).
pub(crate) const HEAT_STOPS: usize = 16;

/// Body parts that darken the floor (`shader/frame.wgsl`, `MAX_OCCLUDERS`).
pub(crate) const MAX_OCCLUDERS: usize = 48;

/// Triangles of the floor disc (`shader/floor.wgsl`, `DISC_SEGMENTS`).
pub(crate) const DISC_SEGMENTS: u32 = 64;

/// Threads of one workgroup of the passes that skin and decode (`shader/skin_compute.wgsl`,
/// `decode_compute.wgsl`).
pub(crate) const SKIN_WORKGROUP: u32 = 64;

/// `Frame` of `shader/frame.wgsl`; the fields' meaning stands there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct FrameUniform {
    pub clip_from_world: [[f32; 4]; 4],
    pub shadow_from_world: [[f32; 4]; 4],
    pub eye_world_m: [f32; 3],
    pub occluder_count: u32,
    pub key_world: [f32; 3],
    pub shadow_texel: f32,
    pub fill_world: [f32; 3],
    pub shadow_texel_m: f32,
    pub rim_world: [f32; 3],
    pub heat_on: u32,
    pub floor_center_m: [f32; 2],
    pub floor_radius_m: f32,
    pub inverse_heat_range_per_m: f32,
    pub inverse_size_px: [f32; 2],
    pub aspect: f32,
    pub shadow_share: f32,
    pub background_center: [f32; 4],
    pub background_edge: [f32; 4],
    pub heat_ramp: [[f32; 4]; HEAT_STOPS],
    pub occluders: [[f32; 4]; MAX_OCCLUDERS],
}

const _: () = assert!(
    size_of::<FrameUniform>() == 128 + 6 * 16 + 2 * 16 + 16 * HEAT_STOPS + 16 * MAX_OCCLUDERS
);

/// `Material` of `shader/body.wgsl`; the fields' meaning stands there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct MaterialUniform {
    pub first_linear: [f32; 3],
    pub two_tone: u32,
    pub second_linear: [f32; 3],
    pub hem_reach_m: f32,
}

const _: () = assert!(size_of::<MaterialUniform>() == 32);

impl MaterialUniform {
    /// Colours as they are painted.
    pub const PLAIN: Self = Self {
        first_linear: [0.0; 3],
        two_tone: 0,
        second_linear: [0.0; 3],
        hem_reach_m: 1.0,
    };

    /// Whether the first of the two colours is the warmer one, as the shader tells skin from cloth.
    pub fn first_is_skin(&self) -> bool {
        let warmth = |[r, _, b]: [f32; 3]| (r - b) / r.max(1e-3);
        warmth(self.first_linear) >= warmth(self.second_linear)
    }
}

/// `SkinJoints` of `shader/skin.wgsl`; the fields' meaning stands there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SkinUniform {
    pub world_from_rest: [[f32; 16]; JOINT_COUNT],
    pub dual_quaternions: u32,
    pub padding: [u32; 3],
}

const _: () = assert!(size_of::<SkinUniform>() == 1552);

impl SkinUniform {
    pub fn new(world_from_rest: &[Mat4; JOINT_COUNT], skinning: Skinning) -> Self {
        let linear = skinning == Skinning::Linear;
        Self {
            world_from_rest: world_from_rest.map(|matrix| {
                if linear {
                    return matrix.to_cols_array();
                }
                let motion = DualQuat::from_affine(&Affine3A::from_mat4(matrix));
                let scale = [motion.scale, 0.0, 0.0, 0.0];
                let columns = [
                    motion.real.to_array(),
                    motion.dual.to_array(),
                    scale,
                    [0.0; 4],
                ];
                Mat4::from_cols_array_2d(&columns).to_cols_array()
            }),
            dual_quaternions: u32::from(!linear),
            padding: [0; 3],
        }
    }
}

/// `Batch` of `decode.wgsl`; the fields' meaning stands there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct BatchUniform {
    pub vertex_count: u32,
    pub body_rows: u32,
    pub stride: u32,
    pub height: u32,
    pub slots: [u32; MAX_SLOTS],
}

/// `DecodedPlace` of `shader/decoded.wgsl`; the fields' meaning stands there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct DecodedPlace {
    pub first_row: u32,
    pub width: u32,
    pub padding: [u32; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shader;
    use std::mem::offset_of;

    /// Size of the WGSL struct `name` and the offset of its member `member`.
    fn layout(shader: Shader, name: &str, member: &str) -> (usize, usize) {
        let module = naga::front::wgsl::parse_str(&shader.wgsl()).unwrap();
        let found = module
            .types
            .iter()
            .find(|(_, ty)| ty.name.as_deref() == Some(name));
        let naga::TypeInner::Struct { members, span } = &found.unwrap().1.inner else {
            panic!("{name} is no struct");
        };
        let member = members
            .iter()
            .find(|m| m.name.as_deref() == Some(member))
            .unwrap();
        (*span as usize, member.offset as usize)
    }

    #[test]
    fn uniforms_have_the_layout_that_the_shaders_read() {
        let offsets = [
            ("eye_world_m", offset_of!(FrameUniform, eye_world_m)),
            ("heat_on", offset_of!(FrameUniform, heat_on)),
            (
                "inverse_heat_range_per_m",
                offset_of!(FrameUniform, inverse_heat_range_per_m),
            ),
            ("aspect", offset_of!(FrameUniform, aspect)),
            ("background_edge", offset_of!(FrameUniform, background_edge)),
            ("heat_ramp", offset_of!(FrameUniform, heat_ramp)),
            ("occluders", offset_of!(FrameUniform, occluders)),
        ];
        for (member, offset) in offsets {
            let (size, found) = layout(Shader::FLOOR, "Frame", member);
            assert_eq!(
                (size, found),
                (size_of::<FrameUniform>(), offset),
                "{member}"
            );
        }
        let second = offset_of!(MaterialUniform, second_linear);
        let material = layout(Shader::BODY_SKINNED, "Material", "second_linear");
        assert_eq!(material, (size_of::<MaterialUniform>(), second));
        let slots = offset_of!(BatchUniform, slots);
        let batch = layout(Shader::DECODE_COMPUTE, "Batch", "slots");
        assert_eq!(batch, (size_of::<BatchUniform>(), slots));
        let width = offset_of!(DecodedPlace, width);
        let place = layout(Shader::BODY_DECODED, "DecodedPlace", "width");
        assert_eq!(place, (size_of::<DecodedPlace>(), width));
        let second = offset_of!(SkinUniform, dual_quaternions);
        let skin = layout(Shader::SKIN, "SkinJoints", "dual_quaternions");
        assert_eq!(skin, (size_of::<SkinUniform>(), second));
    }
}
