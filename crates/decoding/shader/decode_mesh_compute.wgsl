// Behind the compute passes: decodes into buffers in the order of an engine's mesh. The engine's vertex buffers are
// copied from them, because some engines make these without the usage that a shader needs to write them.

struct Mesh {
    // The body's place among those of its batch.
    slot: u32,
    vertex_count: u32,
}

@group(1) @binding(0) var<uniform> mesh: Mesh;
// The vertex of the body that each of the mesh is.
@group(1) @binding(1) var<storage, read> mesh_vertices: array<u32>;
@group(1) @binding(2) var<storage, read_write> mesh_positions_rest_m: array<f32>;
@group(1) @binding(3) var<storage, read_write> mesh_normals_rest: array<f32>;

@compute @workgroup_size(64)
fn decode_mesh(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if index >= mesh.vertex_count {
        return;
    }
    let vertex = mesh_vertices[index];
    let position_m = decoded_position_m(mesh.slot, vertex);
    let normal = decoded_normal(mesh.slot, vertex);
    let at = 3u * index;
    mesh_positions_rest_m[at] = position_m.x;
    mesh_positions_rest_m[at + 1u] = position_m.y;
    mesh_positions_rest_m[at + 2u] = position_m.z;
    mesh_normals_rest[at] = normal.x;
    mesh_normals_rest[at + 1u] = normal.y;
    mesh_normals_rest[at + 2u] = normal.z;
}
