//! Linear blend skinning of the rest surface.

use dynaskin_body::{JOINT_COUNT, Pose, SkinWeights};
use glam::{Mat4, Quat, Vec3};

/// `world_from_rest` of each joint.
pub(crate) fn matrices(pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT]) -> [Mat4; JOINT_COUNT] {
    let world = pose.world_joints(joints_rest_m);
    std::array::from_fn(|joint| {
        let rotation = world.rotation[joint];
        let rest_m = joints_rest_m[joint].as_dvec3();
        let translation_m = world.position_m[joint] - rotation * rest_m;
        Mat4::from_rotation_translation(
            Quat::from_array(rotation.to_array().map(|x| x as f32)).normalize(),
            translation_m.as_vec3(),
        )
    })
}

/// Skins `rest` positions (metres) and normals into `skinned`.
pub(crate) fn blend(
    skin: &[SkinWeights],
    world_from_rest: &[Mat4; JOINT_COUNT],
    rest: (&[Vec3], &[Vec3]),
    skinned: (&mut [Vec3], &mut [Vec3]),
) {
    let sources = skin.iter().zip(rest.0.iter().zip(rest.1));
    let targets = skinned.0.iter_mut().zip(skinned.1);
    for ((vertex, (position, normal)), (skinned_position, skinned_normal)) in sources.zip(targets) {
        let mut matrix = world_from_rest[usize::from(vertex.joints[0])] * vertex.weights[0];
        for slot in 1..4 {
            if vertex.weights[slot] > 0.0 {
                matrix += world_from_rest[usize::from(vertex.joints[slot])] * vertex.weights[slot];
            }
        }
        *skinned_position = matrix.transform_point3(*position);
        *skinned_normal = matrix.transform_vector3(*normal).normalize_or(*normal);
    }
}
