// Decodes into the vertex buffers of an engine's mesh, whatever order its vertices have: no pixel is drawn, what
// the vertex stage puts out is captured (transform feedback of WebGL2).

struct MeshVertex {
    @builtin(position) unused: vec4<f32>,
    @location(0) position_rest_m: vec3<f32>,
    @location(1) normal_rest: vec3<f32>,
}

@vertex
fn vs_mesh(
    // The vertex of the body that this one of the mesh is.
    @location(0) vertex: u32,
    // The body's number in the batch.
    @builtin(instance_index) index: u32,
) -> MeshVertex {
    let slot = batch.slots[index / 4u][index % 4u];
    return MeshVertex(
        vec4<f32>(0.0, 0.0, 0.0, 1.0),
        decoded_position_m(slot, vertex),
        decoded_normal(slot, vertex),
    );
}
