// Vertex stage over the surface that the host uploaded.

@vertex
fn vs_shadow(
    @location(0) position_rest_m: vec3<f32>,
    @location(2) joints: vec4<u32>,
    @location(3) weights: vec4<f32>,
) -> @builtin(position) vec4<f32> {
    return skinned_shadow(position_rest_m, joints, weights);
}
