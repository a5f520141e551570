// The decoder and what follows it, in the order of the runtime: the matrix times the latents, gain, soft
// limit, rest position, normal. The compute pass and the fragment passes both include this file.

// Texels of a row, in every texture but that of the latents.
const WIDTH: u32 = 512u;

const MAX_SLOTS: u32 = 64u;

struct Batch {
    vertex_count: u32,
    // Rows of texels that one body has.
    body_rows: u32,
    // Numbers from one body to the next in a buffer with one number a vertex.
    stride: u32,
    // Rows of all bodies together.
    height: u32,
    // The bodies to be decoded, four by four.
    slots: array<vec4<u32>, 16>,
}

@group(0) @binding(0) var<uniform> batch: Batch;
// Per vertex: its first weight and the end of its weights, its first pair of corners and their end.
@group(0) @binding(1) var vertices: texture_2d<u32>;
// Along x, y and z; the fourth number is the latent that they are multiplied with.
@group(0) @binding(2) var weights: texture_2d<f32>;
// The other two corners of a face of a vertex, in order.
@group(0) @binding(3) var corners: texture_2d<u32>;
// Per body and vertex, without offsets, metres.
@group(0) @binding(4) var still_positions: texture_2d<f32>;
// Per body and vertex: gain, and longest offset in metres.
@group(0) @binding(5) var controls: texture_2d<f32>;
// A row a body, four latents a texel.
@group(0) @binding(6) var latents: texture_2d<f32>;

fn texel(index: u32) -> vec2<u32> {
    return vec2<u32>(index % WIDTH, index / WIDTH);
}

fn body_texel(slot: u32, vertex: u32) -> vec2<u32> {
    return texel(vertex) + vec2<u32>(0u, slot * batch.body_rows);
}

// As the runtime's `soft_limited`: up to `knee` unchanged, then approaching `limit`.
fn soft_limited(v: vec3<f32>, knee: f32, limit: f32) -> vec3<f32> {
    let squared = dot(v, v);
    if squared <= knee * knee {
        return v;
    }
    if limit <= 0.0 {
        return vec3<f32>(0.0);
    }
    let size = sqrt(squared);
    let room = limit - knee;
    // Beyond 10 the hyperbolic tangent is 1, and some cards' overflows.
    let limited = knee + room * tanh(min((size - knee) / room, 10.0));
    return v * (limited / size);
}

fn decoded_offset_m(slot: u32, vertex: u32) -> vec3<f32> {
    let lists = textureLoad(vertices, texel(vertex), 0);
    var offset_m = vec3<f32>(0.0);
    for (var at = lists.x; at < lists.y; at++) {
        let weight = textureLoad(weights, texel(at), 0);
        let latent = u32(weight.w);
        let four = textureLoad(latents, vec2<u32>(latent / 4u, slot), 0);
        offset_m += four[latent % 4u] * weight.xyz;
    }
    let own = textureLoad(controls, body_texel(slot, vertex), 0);
    return soft_limited(own.x * offset_m, 0.5 * own.y, own.y);
}

fn still_position_m(slot: u32, vertex: u32) -> vec3<f32> {
    return textureLoad(still_positions, body_texel(slot, vertex), 0).xyz;
}

// Area-weighted, of unit length.
fn decoded_normal(slot: u32, vertex: u32) -> vec3<f32> {
    let lists = textureLoad(vertices, texel(vertex), 0);
    let at_m = decoded_position_m(slot, vertex);
    var sum = vec3<f32>(0.0);
    for (var at = lists.z; at < lists.w; at++) {
        let others = textureLoad(corners, texel(at), 0);
        let first_m = decoded_position_m(slot, others.x) - at_m;
        let second_m = decoded_position_m(slot, others.y) - at_m;
        sum += cross(first_m, second_m);
    }
    let squared = dot(sum, sum);
    return select(vec3<f32>(0.0, 1.0, 0.0), sum * inverseSqrt(max(squared, 1e-37)), squared > 0.0);
}
