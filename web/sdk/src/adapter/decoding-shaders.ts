// Written by the tests of the Rust crate dynaskin-decoding from its WGSL, by naga; do not edit. After a change there:
// DYNASKIN_WRITE_GOLDEN=1 cargo test -p dynaskin-decoding --test engine_shaders

/** Texels of a row. */
export const WIDTH = 512;

/** Bodies of a batch at most. */
export const MAX_SLOTS = 64;

/** GLSL of a quad over the rows of one body. */
export const POSITIONS_VERTEX = `#version 300 es

precision highp float;
precision highp int;

uniform uint naga_vs_first_instance;

struct Batch {
    uint vertex_count;
    uint body_rows;
    uint stride;
    uint height;
    uvec4 slots[16];
};
const uint WIDTH = 512u;
const uint MAX_SLOTS = 64u;

layout(std140) uniform Batch_block_0Vertex { Batch _group_0_binding_0_vs; };


uvec2 texel(uint index_1) {
    return uvec2((index_1 % WIDTH), (index_1 / WIDTH));
}

uvec2 body_texel(uint slot, uint vertex) {
    uvec2 _e2 = texel(vertex);
    uint _e6 = _group_0_binding_0_vs.body_rows;
    return (_e2 + uvec2(0u, (slot * _e6)));
}

vec3 soft_limited(vec3 v, float knee, float limit) {
    float squared = dot(v, v);
    if ((squared <= (knee * knee))) {
        return v;
    }
    if ((limit <= 0.0)) {
        return vec3(0.0);
    }
    float size = sqrt(squared);
    float room = (limit - knee);
    float limited = (knee + (room * tanh(min(((size - knee) / room), 10.0))));
    return (v * (limited / size));
}

uvec2 slot_and_vertex(vec2 pixel_2) {
    uvec2 at_2 = uvec2(pixel_2);
    uint _e5 = _group_0_binding_0_vs.body_rows;
    uint slot_5 = (at_2.y / _e5);
    uint _e12 = _group_0_binding_0_vs.body_rows;
    uint vertex_5 = (at_2.x + (WIDTH * (at_2.y % _e12)));
    uint _e18 = _group_0_binding_0_vs.vertex_count;
    return uvec2(slot_5, min(vertex_5, (_e18 - 1u)));
}

void main() {
    uint corner = uint(gl_VertexID);
    uint index = (uint(gl_InstanceID) + naga_vs_first_instance);
    bool local = false;
    bool local_1 = false;
    bool local_2 = false;
    bool local_3 = false;
    uint slot_6 = _group_0_binding_0_vs.slots[(index / 4u)][(index % 4u)];
    if (!((corner == 1u))) {
        local = (corner == 2u);
    } else {
        local = true;
    }
    bool _e19 = local;
    if (!(_e19)) {
        local_1 = (corner == 4u);
    } else {
        local_1 = true;
    }
    bool _e26 = local_1;
    float right = (_e26 ? 1.0 : -1.0);
    if (!((corner == 2u))) {
        local_2 = (corner == 4u);
    } else {
        local_2 = true;
    }
    bool _e40 = local_2;
    if (!(_e40)) {
        local_3 = (corner == 5u);
    } else {
        local_3 = true;
    }
    bool _e47 = local_3;
    uint below = (_e47 ? 1u : 0u);
    uint _e52 = _group_0_binding_0_vs.body_rows;
    uint row = ((slot_6 + below) * _e52);
    uint _e59 = _group_0_binding_0_vs.height;
    gl_Position = vec4(right, (1.0 - ((2.0 * float(row)) / float(_e59))), 0.0, 1.0);
    gl_Position.yz = vec2(-gl_Position.y, gl_Position.z * 2.0 - gl_Position.w);
    return;
}
`;

/** GLSL that decodes positions into a texture. */
export const POSITIONS_FRAGMENT = `#version 300 es

precision highp float;
precision highp int;

struct Batch {
    uint vertex_count;
    uint body_rows;
    uint stride;
    uint height;
    uvec4 slots[16];
};
const uint WIDTH = 512u;
const uint MAX_SLOTS = 64u;

layout(std140) uniform Batch_block_0Fragment { Batch _group_0_binding_0_fs; };

uniform highp usampler2D _group_0_binding_1_fs;

uniform highp sampler2D _group_0_binding_2_fs;

uniform highp sampler2D _group_0_binding_4_fs;

uniform highp sampler2D _group_0_binding_5_fs;

uniform highp sampler2D _group_0_binding_6_fs;

layout(location = 0) out vec4 _fs2p_location0;

uvec2 texel(uint index_1) {
    return uvec2((index_1 % WIDTH), (index_1 / WIDTH));
}

uvec2 body_texel(uint slot, uint vertex) {
    uvec2 _e2 = texel(vertex);
    uint _e6 = _group_0_binding_0_fs.body_rows;
    return (_e2 + uvec2(0u, (slot * _e6)));
}

vec3 soft_limited(vec3 v, float knee, float limit) {
    float squared = dot(v, v);
    if ((squared <= (knee * knee))) {
        return v;
    }
    if ((limit <= 0.0)) {
        return vec3(0.0);
    }
    float size = sqrt(squared);
    float room = (limit - knee);
    float limited = (knee + (room * tanh(min(((size - knee) / room), 10.0))));
    return (v * (limited / size));
}

vec3 decoded_offset_m(uint slot_1, uint vertex_1) {
    vec3 offset_m = vec3(0.0);
    uint at = 0u;
    uvec2 _e3 = texel(vertex_1);
    uvec4 lists = texelFetch(_group_0_binding_1_fs, ivec2(_e3), 0);
    at = lists.x;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e35 = at;
            at = (_e35 + 1u);
        }
        loop_init = false;
        uint _e11 = at;
        if ((_e11 < lists.y)) {
        } else {
            break;
        }
        {
            uint _e15 = at;
            uvec2 _e16 = texel(_e15);
            vec4 weight = texelFetch(_group_0_binding_2_fs, ivec2(_e16), 0);
            uint latent = uint(weight.w);
            vec4 four = texelFetch(_group_0_binding_6_fs, ivec2(uvec2((latent / 4u), slot_1)), 0);
            vec3 _e27 = offset_m;
            offset_m = (_e27 + (four[(latent % 4u)] * weight.xyz));
        }
    }
    uvec2 _e38 = body_texel(slot_1, vertex_1);
    vec4 own = texelFetch(_group_0_binding_5_fs, ivec2(_e38), 0);
    vec3 _e42 = offset_m;
    vec3 _e48 = soft_limited((own.x * _e42), (0.5 * own.y), own.y);
    return _e48;
}

vec3 still_position_m(uint slot_2, uint vertex_2) {
    uvec2 _e3 = body_texel(slot_2, vertex_2);
    vec4 _e5 = texelFetch(_group_0_binding_4_fs, ivec2(_e3), 0);
    return _e5.xyz;
}

uvec2 slot_and_vertex(vec2 pixel_2) {
    uvec2 at_2 = uvec2(pixel_2);
    uint _e5 = _group_0_binding_0_fs.body_rows;
    uint slot_5 = (at_2.y / _e5);
    uint _e12 = _group_0_binding_0_fs.body_rows;
    uint vertex_5 = (at_2.x + (WIDTH * (at_2.y % _e12)));
    uint _e18 = _group_0_binding_0_fs.vertex_count;
    return uvec2(slot_5, min(vertex_5, (_e18 - 1u)));
}

void main() {
    vec4 pixel = gl_FragCoord;
    uvec2 _e2 = slot_and_vertex(pixel.xy);
    vec3 _e5 = decoded_offset_m(_e2.x, _e2.y);
    vec3 _e8 = still_position_m(_e2.x, _e2.y);
    _fs2p_location0 = vec4((_e8 + _e5), length(_e5));
    return;
}
`;

/** GLSL whose output is captured: positions and normals of a mesh's vertices. */
export const MESH_VERTEX = `#version 300 es

precision highp float;
precision highp int;

uniform uint naga_vs_first_instance;

struct Batch {
    uint vertex_count;
    uint body_rows;
    uint stride;
    uint height;
    uvec4 slots[16];
};
struct MeshVertex {
    vec4 unused;
    vec3 position_rest_m;
    vec3 normal_rest;
};
const uint WIDTH = 512u;
const uint MAX_SLOTS = 64u;

layout(std140) uniform Batch_block_0Vertex { Batch _group_0_binding_0_vs; };

uniform highp usampler2D _group_0_binding_1_vs;

uniform highp usampler2D _group_0_binding_3_vs;

uniform highp sampler2D _group_1_binding_0_vs;

layout(location = 0) in uint _p2vs_location0;
smooth out vec3 _vs2fs_location0;
smooth out vec3 _vs2fs_location1;

uvec2 texel(uint index_2) {
    return uvec2((index_2 % WIDTH), (index_2 / WIDTH));
}

uvec2 body_texel(uint slot, uint vertex_1) {
    uvec2 _e2 = texel(vertex_1);
    uint _e6 = _group_0_binding_0_vs.body_rows;
    return (_e2 + uvec2(0u, (slot * _e6)));
}

vec3 soft_limited(vec3 v, float knee, float limit) {
    float squared = dot(v, v);
    if ((squared <= (knee * knee))) {
        return v;
    }
    if ((limit <= 0.0)) {
        return vec3(0.0);
    }
    float size = sqrt(squared);
    float room = (limit - knee);
    float limited = (knee + (room * tanh(min(((size - knee) / room), 10.0))));
    return (v * (limited / size));
}

vec3 decoded_position_m(uint slot_3, uint vertex_4) {
    uvec2 _e3 = body_texel(slot_3, vertex_4);
    vec4 _e5 = texelFetch(_group_1_binding_0_vs, ivec2(_e3), 0);
    return _e5.xyz;
}

vec3 decoded_normal(uint slot_4, uint vertex_5) {
    vec3 sum = vec3(0.0);
    uint at_1 = 0u;
    uvec2 _e3 = texel(vertex_5);
    uvec4 lists = texelFetch(_group_0_binding_1_vs, ivec2(_e3), 0);
    vec3 _e6 = decoded_position_m(slot_4, vertex_5);
    at_1 = lists.z;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e30 = at_1;
            at_1 = (_e30 + 1u);
        }
        loop_init = false;
        uint _e12 = at_1;
        if ((_e12 < lists.w)) {
        } else {
            break;
        }
        {
            uint _e16 = at_1;
            uvec2 _e17 = texel(_e16);
            uvec4 others = texelFetch(_group_0_binding_3_vs, ivec2(_e17), 0);
            vec3 _e21 = decoded_position_m(slot_4, others.x);
            vec3 first_m = (_e21 - _e6);
            vec3 _e24 = decoded_position_m(slot_4, others.y);
            vec3 second_m = (_e24 - _e6);
            vec3 _e26 = sum;
            sum = (_e26 + cross(first_m, second_m));
        }
    }
    vec3 _e32 = sum;
    vec3 _e33 = sum;
    float squared_1 = dot(_e32, _e33);
    vec3 _e39 = sum;
    return ((squared_1 > 0.0) ? (_e39 * inversesqrt(max(squared_1, 1e-37))) : vec3(0.0, 1.0, 0.0));
}

uvec2 slot_and_vertex(vec2 pixel_2) {
    uvec2 at_2 = uvec2(pixel_2);
    uint _e5 = _group_0_binding_0_vs.body_rows;
    uint slot_5 = (at_2.y / _e5);
    uint _e12 = _group_0_binding_0_vs.body_rows;
    uint vertex_6 = (at_2.x + (WIDTH * (at_2.y % _e12)));
    uint _e18 = _group_0_binding_0_vs.vertex_count;
    return uvec2(slot_5, min(vertex_6, (_e18 - 1u)));
}

void main() {
    uint vertex = _p2vs_location0;
    uint index_1 = (uint(gl_InstanceID) + naga_vs_first_instance);
    uint slot_6 = _group_0_binding_0_vs.slots[(index_1 / 4u)][(index_1 % 4u)];
    vec3 _e16 = decoded_position_m(slot_6, vertex);
    vec3 _e17 = decoded_normal(slot_6, vertex);
    MeshVertex _tmp_return = MeshVertex(vec4(0.0, 0.0, 0.0, 1.0), _e16, _e17);
    gl_Position = _tmp_return.unused;
    _vs2fs_location0 = _tmp_return.position_rest_m;
    _vs2fs_location1 = _tmp_return.normal_rest;
    gl_Position.yz = vec2(-gl_Position.y, gl_Position.z * 2.0 - gl_Position.w);
    return;
}
`;

/** WGSL of the passes `decode_positions`, of a batch, and `decode_mesh`, of the vertices of a mesh. */
export const COMPUTE = `
const WIDTH: u32 = 512u;

const MAX_SLOTS: u32 = 64u;

struct Batch {
    vertex_count: u32,
    body_rows: u32,
    stride: u32,
    height: u32,
    slots: array<vec4<u32>, 16>,
}

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var vertices: texture_2d<u32>;
@group(0) @binding(2) var weights: texture_2d<f32>;
@group(0) @binding(3) var corners: texture_2d<u32>;
@group(0) @binding(4) var still_positions: texture_2d<f32>;
@group(0) @binding(5) var controls: texture_2d<f32>;
@group(0) @binding(6) var latents: texture_2d<f32>;

fn texel(index: u32) -> vec2<u32> {
    return vec2<u32>(index % WIDTH, index / WIDTH);
}

fn body_texel(slot: u32, vertex: u32) -> vec2<u32> {
    return texel(vertex) + vec2<u32>(0u, slot * batch.body_rows);
}

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


struct Mesh {
    slot: u32,
    vertex_count: u32,
}

@group(1) @binding(0) var<uniform> mesh: Mesh;
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
`;
