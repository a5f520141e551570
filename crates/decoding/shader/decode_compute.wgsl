// Decodes into buffers that the skinning pass reads: three floats a vertex, tightly packed.

@group(0) @binding(7) var<storage, read_write> positions_rest_m: array<f32>;
@group(0) @binding(8) var<storage, read_write> normals_rest: array<f32>;
@group(0) @binding(9) var<storage, read_write> offset_sizes_m: array<f32>;

fn decoded_position_m(slot: u32, vertex: u32) -> vec3<f32> {
    let at = 3u * (slot * batch.stride + vertex);
    return vec3<f32>(positions_rest_m[at], positions_rest_m[at + 1u], positions_rest_m[at + 2u]);
}

fn batch_slot(index: u32) -> u32 {
    return batch.slots[index / 4u][index % 4u];
}

@compute @workgroup_size(64)
fn decode_positions(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.x;
    if vertex >= batch.vertex_count {
        return;
    }
    let slot = batch_slot(id.y);
    let offset_m = decoded_offset_m(slot, vertex);
    let position_m = still_position_m(slot, vertex) + offset_m;
    let index = slot * batch.stride + vertex;
    positions_rest_m[3u * index] = position_m.x;
    positions_rest_m[3u * index + 1u] = position_m.y;
    positions_rest_m[3u * index + 2u] = position_m.z;
    offset_sizes_m[index] = length(offset_m);
}

@compute @workgroup_size(64)
fn decode_normals(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.x;
    if vertex >= batch.vertex_count {
        return;
    }
    let slot = batch_slot(id.y);
    let normal = decoded_normal(slot, vertex);
    let at = 3u * (slot * batch.stride + vertex);
    normals_rest[at] = normal.x;
    normals_rest[at + 1u] = normal.y;
    normals_rest[at + 2u] = normal.z;
}
