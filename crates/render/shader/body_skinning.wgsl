// A body that the vertex stage skins: for WebGL2, which has no compute pass.

struct RestVertex {
    @location(0) position_rest_m: vec3<f32>,
    @location(1) normal_rest: vec3<f32>,
    @location(2) joints: vec4<u32>,
    @location(3) weights: vec4<f32>,
    @location(4) offset_size_m: f32,
    @location(5) color: vec4<f32>,
}

fn skinned_body(in: RestVertex) -> BodyVarying {
    let world_from_rest = blended_world_from_rest(in.joints, in.weights);
    var out: BodyVarying;
    out.position_world_m = skinned_position(world_from_rest, in.position_rest_m);
    out.normal_world = skinned_normal(world_from_rest, in.normal_rest);
    out.clip = frame.clip_from_world * vec4<f32>(out.position_world_m, 1.0);
    out.position_rest_m = in.position_rest_m;
    out.color = in.color;
    out.offset_size_m = in.offset_size_m;
    return out;
}
