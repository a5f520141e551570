// Linear-blend skinning: the one copy of its maths. The compute pass and the vertex shader both
// include this file.

const JOINT_COUNT: u32 = 24u;

struct SkinMatrices {
    // Takes a rest-pose point to the world, per joint of SMPL's skeleton.
    world_from_rest: array<mat4x4<f32>, JOINT_COUNT>,
}

@group(1) @binding(0) var<uniform> skin: SkinMatrices;

fn blended_world_from_rest(joints: vec4<u32>, weights: vec4<f32>) -> mat4x4<f32> {
    return weights.x * skin.world_from_rest[joints.x]
        + weights.y * skin.world_from_rest[joints.y]
        + weights.z * skin.world_from_rest[joints.z]
        + weights.w * skin.world_from_rest[joints.w];
}

fn skinned_position(world_from_rest: mat4x4<f32>, position_rest_m: vec3<f32>) -> vec3<f32> {
    return (world_from_rest * vec4<f32>(position_rest_m, 1.0)).xyz;
}

// The linear part turns normals: joints move rigidly, so it differs from a rotation only where
// weights blend, by less than the eye sees.
fn skinned_normal(world_from_rest: mat4x4<f32>, normal_rest: vec3<f32>) -> vec3<f32> {
    let turned = (world_from_rest * vec4<f32>(normal_rest, 0.0)).xyz;
    return turned * inverseSqrt(max(dot(turned, turned), 1e-12));
}
