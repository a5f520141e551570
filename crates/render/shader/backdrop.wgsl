// Fills the picture with the backdrop.

@vertex
fn vs_backdrop(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the picture, at the far end of the depth range.
    let corner = vec2<f32>(f32((idx << 1u) & 2u), f32(idx & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 1.0, 1.0);
}

@fragment
fn fs_backdrop(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    return displayed(backdrop(pixel.xy), pixel.xy);
}
