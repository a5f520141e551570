// Skins all vertices of one body into buffers that are then drawn as vertex buffers.
// Vectors are tightly packed, three floats each, as the host uploads them.

@group(1) @binding(1) var<storage, read> positions_rest_m: array<f32>;
@group(1) @binding(2) var<storage, read> normals_rest: array<f32>;
@group(1) @binding(3) var<storage, read> skin_joints: array<u32>;
@group(1) @binding(4) var<storage, read> skin_weights: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read_write> positions_world_m: array<f32>;
@group(1) @binding(6) var<storage, read_write> normals_world: array<f32>;

@compute @workgroup_size(64)
fn skin_vertices(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.x;
    if vertex >= arrayLength(&skin_joints) {
        return;
    }
    let packed = skin_joints[vertex];
    let joints = vec4<u32>(packed, packed >> 8u, packed >> 16u, packed >> 24u) & vec4<u32>(255u);
    let world_from_rest = blended_world_from_rest(joints, skin_weights[vertex]);

    let at = 3u * vertex;
    let rest_m = vec3<f32>(positions_rest_m[at], positions_rest_m[at + 1u], positions_rest_m[at + 2u]);
    let world_m = skinned_position(world_from_rest, rest_m);
    positions_world_m[at] = world_m.x;
    positions_world_m[at + 1u] = world_m.y;
    positions_world_m[at + 2u] = world_m.z;

    let normal_rest = vec3<f32>(normals_rest[at], normals_rest[at + 1u], normals_rest[at + 2u]);
    let normal = skinned_normal(world_from_rest, normal_rest);
    normals_world[at] = normal.x;
    normals_world[at + 1u] = normal.y;
    normals_world[at + 2u] = normal.z;
}
