// Linear-blend and dual-quaternion skinning: the one copy of their maths. The compute pass and the vertex
// shader both include this file.

const JOINT_COUNT: u32 = 24u;

struct SkinJoints {
    // What takes a rest-pose point to the world, per joint of SMPL's skeleton: its matrix or, by columns, its
    // motion as a unit dual quaternion (the rotation, then the dual part) and a scale before both in the
    // third column's first number.
    world_from_rest: array<mat4x4<f32>, JOINT_COUNT>,
    // 1 where these are dual quaternions, else 0.
    dual_quaternions: u32,
}

@group(1) @binding(0) var<uniform> skin: SkinJoints;

fn blended_world_from_rest(joints: vec4<u32>, weights: vec4<f32>) -> mat4x4<f32> {
    if skin.dual_quaternions == 1u {
        return blended_dual_quaternion(joints, weights);
    }
    return weights.x * skin.world_from_rest[joints.x]
        + weights.y * skin.world_from_rest[joints.y]
        + weights.z * skin.world_from_rest[joints.z]
        + weights.w * skin.world_from_rest[joints.w];
}

// The weight of a rotation on the side of `pivot`: q and -q are one rotation.
fn signed_weight(rotation: vec4<f32>, pivot: vec4<f32>, weight: f32) -> f32 {
    return select(weight, -weight, dot(rotation, pivot) < 0.0);
}

fn blended_dual_quaternion(joints: vec4<u32>, weights: vec4<f32>) -> mat4x4<f32> {
    let first = skin.world_from_rest[joints.x];
    let second = skin.world_from_rest[joints.y];
    let third = skin.world_from_rest[joints.z];
    let fourth = skin.world_from_rest[joints.w];
    let sided = vec4<f32>(
        weights.x,
        signed_weight(second[0], first[0], weights.y),
        signed_weight(third[0], first[0], weights.z),
        signed_weight(fourth[0], first[0], weights.w),
    );
    let real_sum = sided.x * first[0] + sided.y * second[0] + sided.z * third[0] + sided.w * fourth[0];
    let dual_sum = sided.x * first[1] + sided.y * second[1] + sided.z * third[1] + sided.w * fourth[1];
    let scale = dot(weights, vec4<f32>(first[2].x, second[2].x, third[2].x, fourth[2].x));
    let inverse_length = inverseSqrt(max(dot(real_sum, real_sum), 1e-12));
    let q = real_sum * inverse_length;
    let d = dual_sum * inverse_length;
    let translation_m = 2.0 * (q.w * d.xyz - d.w * q.xyz + cross(q.xyz, d.xyz));
    let twice = q.xyz + q.xyz;
    let x = twice.x * q;
    let y = twice.y * q;
    let z = twice.z * q;
    return mat4x4<f32>(
        vec4<f32>(scale * vec3<f32>(1.0 - y.y - z.z, x.y + z.w, x.z - y.w), 0.0),
        vec4<f32>(scale * vec3<f32>(x.y - z.w, 1.0 - x.x - z.z, y.z + x.w), 0.0),
        vec4<f32>(scale * vec3<f32>(x.z + y.w, y.z - x.w, 1.0 - x.x - y.y), 0.0),
        vec4<f32>(translation_m, 1.0),
    );
}

fn skinned_position(world_from_rest: mat4x4<f32>, position_rest_m: vec3<f32>) -> vec3<f32> {
    return (world_from_rest * vec4<f32>(position_rest_m, 1.0)).xyz;
}

// The linear part turns normals: joints move rigidly, so it differs from a rotation only where
// weights blend matrices, by less than the eye sees.
fn skinned_normal(world_from_rest: mat4x4<f32>, normal_rest: vec3<f32>) -> vec3<f32> {
    let turned = (world_from_rest * vec4<f32>(normal_rest, 0.0)).xyz;
    return turned * inverseSqrt(max(dot(turned, turned), 1e-12));
}
