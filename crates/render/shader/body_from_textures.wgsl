// Vertex stage over the surface that was decoded on the card.

struct DecodedVertex {
    @builtin(vertex_index) vertex: u32,
    @location(2) joints: vec4<u32>,
    @location(3) weights: vec4<f32>,
    @location(5) color: vec4<f32>,
}

@vertex
fn vs_body(in: DecodedVertex) -> BodyVarying {
    let texel = decoded_texel(in.vertex);
    let position = textureLoad(decoded_positions, texel, 0);
    let normal_rest = textureLoad(decoded_normals, texel, 0).xyz;
    return skinned_body(RestVertex(position.xyz, normal_rest, in.joints, in.weights, position.w, in.color));
}
