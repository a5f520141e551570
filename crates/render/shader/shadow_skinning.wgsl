// The key light's view, skinning in the vertex stage: for WebGL2.

@vertex
fn vs_shadow(
    @location(0) position_rest_m: vec3<f32>,
    @location(2) joints: vec4<u32>,
    @location(3) weights: vec4<f32>,
) -> @builtin(position) vec4<f32> {
    let world_from_rest = blended_world_from_rest(joints, weights);
    let position_world_m = skinned_position(world_from_rest, position_rest_m);
    return frame.shadow_from_world * vec4<f32>(position_world_m, 1.0);
}
