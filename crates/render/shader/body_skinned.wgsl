// Vertex stages over buffers that the compute pass has skinned.

struct SkinnedVertex {
    @location(0) position_world_m: vec3<f32>,
    @location(1) normal_world: vec3<f32>,
    @location(2) position_rest_m: vec3<f32>,
    @location(3) offset_size_m: f32,
    @location(4) color: vec4<f32>,
}

@vertex
fn vs_body(in: SkinnedVertex) -> BodyVarying {
    var out: BodyVarying;
    out.clip = frame.clip_from_world * vec4<f32>(in.position_world_m, 1.0);
    out.position_world_m = in.position_world_m;
    out.normal_world = in.normal_world;
    out.position_rest_m = in.position_rest_m;
    out.color = in.color;
    out.offset_size_m = in.offset_size_m;
    return out;
}
