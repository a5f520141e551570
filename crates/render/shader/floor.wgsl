// The floor: a disc that fades into the backdrop, with the key light's shadow, soft darkening
// under the body, and faint lines half a metre apart that show how far somebody walked.

const DISC_SEGMENTS: u32 = 64u;
const LINE_SPACING_M = 0.5;

struct FloorVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) position_m: vec2<f32>,
}

// Triangle `idx / 3` of a fan around the disc's centre.
@vertex
fn vs_floor(@builtin(vertex_index) idx: u32) -> FloorVarying {
    let corner = idx % 3u;
    let segment = idx / 3u + select(0u, 1u, corner == 1u);
    let angle = f32(segment) * (6.2831853 / f32(DISC_SEGMENTS));
    let radius_m = select(frame.floor_radius_m, 0.0, corner == 0u);
    var out: FloorVarying;
    out.position_m = frame.floor_center_m + radius_m * vec2<f32>(cos(angle), sin(angle));
    out.clip = frame.clip_from_world * vec4<f32>(out.position_m.x, 0.0, out.position_m.y, 1.0);
    return out;
}

// Share of the sky that body parts leave visible from the floor. A sphere of radius r seen under
// the zenith angle a at distance d hides cos(a) r²/d² of the cosine-weighted hemisphere.
fn sky_visibility(position_m: vec3<f32>) -> f32 {
    var visible = 1.0;
    for (var idx = 0u; idx < frame.occluder_count; idx++) {
        let occluder = frame.occluders[idx];
        let towards_m = occluder.xyz - position_m;
        let distance_m = max(length(towards_m), occluder.w);
        let ratio = occluder.w / distance_m;
        let hidden = max(towards_m.y, 0.0) / distance_m * ratio * ratio;
        visible *= 1.0 - min(hidden, 0.9);
    }
    return visible;
}

// How much of a grid line covers the pixel, 0..1, antialiased by the pixel's footprint.
fn line_cover(position_m: vec2<f32>) -> f32 {
    let footprint_m = max(fwidth(position_m), vec2<f32>(1e-5));
    let to_line_m = abs(fract(position_m / LINE_SPACING_M + 0.5) - 0.5) * LINE_SPACING_M;
    let cover = clamp(1.0 - to_line_m / max(footprint_m, vec2<f32>(0.004)), vec2<f32>(0.0), vec2<f32>(1.0));
    // Far lines would flicker: they fade before they are narrower than a pixel.
    let fine = clamp(1.0 - footprint_m * 40.0, vec2<f32>(0.0), vec2<f32>(1.0));
    return max(cover.x * fine.x, cover.y * fine.y);
}

@fragment
fn fs_floor(in: FloorVarying) -> @location(0) vec4<f32> {
    let position_m = vec3<f32>(in.position_m.x, 0.0, in.position_m.y);
    let behind = backdrop(in.clip.xy);
    let from_center_m = distance(in.position_m, frame.floor_center_m);
    let fade = 1.0 - smoothstep(0.10, 1.0, from_center_m / frame.floor_radius_m);
    // The floor is the backdrop's material: where all light reaches it, it has its colour.
    let up = vec3<f32>(0.0, 1.0, 0.0);
    let key = 0.42 * KEY_RADIANCE * frame.key_world.y;
    let sky = SKY_IRRADIANCE + 0.4 * FILL_RADIANCE;
    let arriving = key * key_visibility(position_m, up, 0.006) + sky * sky_visibility(position_m);
    let base = frame.background_center.rgb * (0.96 - 0.13 * line_cover(in.position_m));
    return displayed(mix(behind, base * arriving / (key + sky), fade), in.clip.xy);
}
