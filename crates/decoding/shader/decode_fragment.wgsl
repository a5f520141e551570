// Decodes into textures that the vertex stage reads: for WebGL2, which has no compute pass. One texel a
// vertex; a quad covers the rows of one body.

// What the first pass wrote.
@group(1) @binding(0) var decoded_positions: texture_2d<f32>;

fn decoded_position_m(slot: u32, vertex: u32) -> vec3<f32> {
    return textureLoad(decoded_positions, body_texel(slot, vertex), 0).xyz;
}

@vertex
fn vs_slot(
    @builtin(vertex_index) corner: u32,
    @builtin(instance_index) index: u32,
) -> @builtin(position) vec4<f32> {
    let slot = batch.slots[index / 4u][index % 4u];
    let right = select(-1.0, 1.0, corner == 1u || corner == 2u || corner == 4u);
    let below = select(0u, 1u, corner == 2u || corner == 4u || corner == 5u);
    let row = (slot + below) * batch.body_rows;
    return vec4<f32>(right, 1.0 - 2.0 * f32(row) / f32(batch.height), 0.0, 1.0);
}

// Body and vertex of a texel; those behind the last vertex are given it.
fn slot_and_vertex(pixel: vec2<f32>) -> vec2<u32> {
    let at = vec2<u32>(pixel);
    let slot = at.y / batch.body_rows;
    let vertex = at.x + WIDTH * (at.y % batch.body_rows);
    return vec2<u32>(slot, min(vertex, batch.vertex_count - 1u));
}

// The position, and the length of its offset.
@fragment
fn fs_positions(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let at = slot_and_vertex(pixel.xy);
    let offset_m = decoded_offset_m(at.x, at.y);
    return vec4<f32>(still_position_m(at.x, at.y) + offset_m, length(offset_m));
}

@fragment
fn fs_normals(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let at = slot_and_vertex(pixel.xy);
    return vec4<f32>(decoded_normal(at.x, at.y), 0.0);
}
