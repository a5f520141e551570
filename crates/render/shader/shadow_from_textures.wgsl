// Vertex stage over the surface that was decoded on the card.

@vertex
fn vs_shadow(
    @builtin(vertex_index) vertex: u32,
    @location(2) joints: vec4<u32>,
    @location(3) weights: vec4<f32>,
) -> @builtin(position) vec4<f32> {
    let position = textureLoad(decoded_positions, decoded_texel(vertex), 0);
    return skinned_shadow(position.xyz, joints, weights);
}
