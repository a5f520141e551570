// The key light's view of a body that the vertex stage skins: for WebGL2.

fn skinned_shadow(position_rest_m: vec3<f32>, joints: vec4<u32>, weights: vec4<f32>) -> vec4<f32> {
    let world_from_rest = blended_world_from_rest(joints, weights);
    let position_world_m = skinned_position(world_from_rest, position_rest_m);
    return frame.shadow_from_world * vec4<f32>(position_world_m, 1.0);
}
