// What one frame's shaders share. Mirrored by `gpu_data::FrameUniform`.

const HEAT_STOPS: u32 = 16u;
const MAX_OCCLUDERS: u32 = 48u;

struct Frame {
    clip_from_world: mat4x4<f32>,
    shadow_from_world: mat4x4<f32>,
    eye_world_m: vec3<f32>,
    occluder_count: u32,
    // Unit vectors towards the lights.
    key_world: vec3<f32>,
    // Shadow map: uv size of one texel.
    shadow_texel: f32,
    fill_world: vec3<f32>,
    // Width of one shadow texel in metres.
    shadow_texel_m: f32,
    rim_world: vec3<f32>,
    heat_on: u32,
    // Floor disc on y = 0.
    floor_center_m: vec2<f32>,
    floor_radius_m: f32,
    // Offset sizes from 0 to 1 / this fill the heat ramp.
    inverse_heat_range_per_m: f32,
    // One over the picture's size in pixels.
    inverse_size_px: vec2<f32>,
    aspect: f32,
    // Share of the shadow map's side that is in use, from its corner.
    shadow_share: f32,
    // Linear display colours.
    background_center: vec4<f32>,
    background_edge: vec4<f32>,
    // Linear sRGB, evenly spaced from 0 to the end of the range.
    heat_ramp: array<vec4<f32>, HEAT_STOPS>,
    // World centre and radius in metres of body parts that darken the floor.
    occluders: array<vec4<f32>, MAX_OCCLUDERS>,
}

@group(0) @binding(0) var<uniform> frame: Frame;
