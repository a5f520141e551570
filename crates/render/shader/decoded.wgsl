// A body's decoded surface, as the fragment passes wrote it.

@group(1) @binding(8) var decoded_positions: texture_2d<f32>;
@group(1) @binding(9) var decoded_normals: texture_2d<f32>;

struct DecodedPlace {
    // The body's first row of texels.
    first_row: u32,
    // Texels of a row.
    width: u32,
    padding: vec2<u32>,
}

@group(1) @binding(10) var<uniform> decoded_place: DecodedPlace;

fn decoded_texel(vertex: u32) -> vec2<u32> {
    let width = decoded_place.width;
    return vec2<u32>(vertex % width, decoded_place.first_row + vertex / width);
}
