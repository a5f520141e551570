// The key light's view of vertices that the compute pass has skinned.

@vertex
fn vs_shadow(@location(0) position_world_m: vec3<f32>) -> @builtin(position) vec4<f32> {
    return frame.shadow_from_world * vec4<f32>(position_world_m, 1.0);
}
