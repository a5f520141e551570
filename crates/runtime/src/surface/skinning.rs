//! Linear blend skinning of positions and normals in one pass.

use dynaskin_body::{JOINT_COUNT, Pose, SkinMatrices, SkinWeights};
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

/// Skins `rest` positions (metres) and normals into `skinned`. Normals take the blended matrix
/// itself, not its inverse transpose: it is a scaled rotation but for a shear where joints disagree.
pub(crate) fn blend(
    weights: &[SkinWeights],
    skin: &SkinMatrices,
    rest: (&[Vec3], &[Vec3]),
    skinned: (&mut [Vec3], &mut [Vec3]),
) {
    let sources = weights.iter().zip(rest.0.iter().zip(rest.1));
    let targets = skinned.0.iter_mut().zip(skinned.1);
    for ((weights, (position, normal)), (skinned_position, skinned_normal)) in sources.zip(targets)
    {
        let world_from_rest = skin.blended(weights);
        *skinned_position = world_from_rest.transform_point3(*position);
        *skinned_normal = world_from_rest
            .transform_vector3(*normal)
            .normalize_or(*normal);
    }
}
