// The studio: lights, the key light's soft shadow, backdrop, and the way to display colours.

@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

const KEY_RADIANCE = vec3<f32>(3.75, 3.50, 3.20);
const FILL_RADIANCE = vec3<f32>(0.36, 0.42, 0.52);
const RIM_RADIANCE = vec3<f32>(2.4, 2.6, 3.0);
const SKY_IRRADIANCE = vec3<f32>(0.40, 0.43, 0.48);
const GROUND_IRRADIANCE = vec3<f32>(0.20, 0.18, 0.165);

// Share of the key light that reaches a point, 0..1. Sixteen bilinear comparisons on a grid give
// a penumbra without noise, so a moving body does not flicker.
// The grid's step is given in metres, so that maps of different sizes give the same penumbra; it is
// at least a texel, and about one: between comparisons that are farther apart the edge would have steps.
fn key_visibility(position_world_m: vec3<f32>, normal_world: vec3<f32>, step_m: f32) -> f32 {
    let spread_m = max(step_m, frame.shadow_texel_m);
    // Pushing the point out along its normal keeps slanted faces from shading themselves: the grid
    // reaches 1.5 steps and a texel to each side, and along the light a face falls by that times its
    // slope. The rest is for triangles, which lie below the surface that the normals tell of.
    let along_key = clamp(dot(normal_world, frame.key_world), 0.0, 1.0);
    let lifted_m = position_world_m
        + normal_world * spread_m * (0.6 + 1.7 * sqrt(1.0 - along_key * along_key));
    let clip = frame.shadow_from_world * vec4<f32>(lifted_m, 1.0);
    let center = (clip.xy * vec2<f32>(0.5, -0.5) + 0.5) * frame.shadow_share;
    // The floor may lie beyond the fitted depth range: whatever the map holds is in front of it.
    let depth = clamp(clip.z, 0.0, 1.0) - 0.0008;
    if any(abs(clip.xy) > vec2<f32>(0.995)) {
        return 1.0;
    }
    let step = frame.shadow_texel * spread_m / frame.shadow_texel_m;
    var lit = 0.0;
    for (var row = 0; row < 4; row++) {
        for (var column = 0; column < 4; column++) {
            let uv = center + (vec2<f32>(f32(column), f32(row)) - 1.5) * step;
            lit += textureSampleCompareLevel(shadow_map, shadow_sampler, uv, depth);
        }
    }
    return lit / 16.0;
}

fn ambient(normal_world: vec3<f32>) -> vec3<f32> {
    return mix(GROUND_IRRADIANCE, SKY_IRRADIANCE, 0.5 + 0.5 * normal_world.y);
}

// Backdrop: a pool of light behind the subject that falls off towards the edges.
fn backdrop(pixel: vec2<f32>) -> vec3<f32> {
    let uv = pixel * frame.inverse_size_px;
    let from_center = (uv - vec2<f32>(0.5, 0.46)) * vec2<f32>(min(frame.aspect, 1.6), 1.0);
    let fall = smoothstep(0.0, 1.0, length(from_center) * 1.25);
    return mix(frame.background_center.rgb, frame.background_edge.rgb, fall);
}

// Leaves colours alone up to `SHOULDER`, so that painted colours look as painted, and bends
// brighter ones towards white along a hyperbola that continues the line without a kink (the idea
// of Khronos' PBR Neutral tone mapper).
fn tone_mapped(radiance: vec3<f32>) -> vec3<f32> {
    const SHOULDER = 0.72;
    let peak = max(radiance.r, max(radiance.g, radiance.b));
    if peak <= SHOULDER {
        return radiance;
    }
    let room = 1.0 - SHOULDER;
    let bent_peak = 1.0 - room * room / (peak + room - SHOULDER);
    let whiteness = 1.0 - 1.0 / (0.18 * (peak - bent_peak) + 1.0);
    return mix(radiance * (bent_peak / peak), vec3<f32>(bent_peak), whiteness);
}

// A number that looks random, from a pixel's place. Whole numbers: `sin` of large arguments differs
// between graphics cards. The mixing steps are those of MurmurHash3's finaliser.
fn scrambled(pixel: vec2<u32>) -> u32 {
    var bits = pixel.x + (pixel.y << 16u);
    bits = (bits ^ (bits >> 16u)) * 0x85ebca6bu;
    bits = (bits ^ (bits >> 13u)) * 0xc2b2ae35u;
    return bits ^ (bits >> 16u);
}

// Linear display colour to the bytes that the target stores as they are: IEC 61966-2-1 encoding,
// and a dither of half a step against bands in the soft gradients.
fn displayed(linear: vec3<f32>, pixel: vec2<f32>) -> vec4<f32> {
    let clamped = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    let low = clamped * 12.92;
    let high = 1.055 * pow(clamped, vec3<f32>(1.0 / 2.4)) - 0.055;
    let encoded = select(high, low, clamped <= vec3<f32>(0.0031308));
    let noise = f32(scrambled(vec2<u32>(pixel)) >> 8u) / 16777216.0 - 0.5;
    return vec4<f32>(encoded + noise / 255.0, 1.0);
}
