//! Skin matrices as the avatar needs them; the blend itself is [`dynaskin_body::skin_surface`].

use dynaskin_body::{JOINT_COUNT, Pose, SkinMatrices};
use glam::{Affine3A, Mat4, Vec3};

/// Skin matrices of a body whose metre is `scale` metres of the world.
pub(crate) fn scaled(pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT], scale: f64) -> SkinMatrices {
    let mut skin = SkinMatrices::new(pose, joints_rest_m);
    if scale != 1.0 {
        let scale = Affine3A::from_scale(Vec3::splat(scale as f32));
        for world_from_rest in &mut skin.world_from_rest {
            *world_from_rest = scale * *world_from_rest;
        }
    }
    skin
}

/// `world_from_rest` of each joint as hosts upload it: 4 by 4, column-major.
pub(crate) fn matrices(skin: &SkinMatrices) -> [Mat4; JOINT_COUNT] {
    skin.world_from_rest.map(Mat4::from)
}
