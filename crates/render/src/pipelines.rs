//! Bind group layouts and pipelines.

use crate::{
    Gpu, Shader, SkinningPath,
    decoding::{FLOATS, texture_entry},
    gpu_data::{DecodedPlace, FrameUniform, MaterialUniform, SkinUniform},
    targets::DEPTH_FORMAT,
};

/// Everything that is made once per renderer.
#[derive(Debug)]
pub(crate) struct Pipelines {
    /// Frame uniform alone: for the shadow and skinning passes.
    pub frame_layout: wgpu::BindGroupLayout,
    /// Frame uniform, shadow map and its sampler: for the picture.
    pub scene_layout: wgpu::BindGroupLayout,
    /// A body's material and, where the vertex stage skins, its matrices.
    pub draw_layout: wgpu::BindGroupLayout,
    /// None where the vertex stage skins.
    pub skin: Option<SkinPass>,
    pub shadow: wgpu::RenderPipeline,
    pub backdrop: wgpu::RenderPipeline,
    pub floor: wgpu::RenderPipeline,
    pub body: wgpu::RenderPipeline,
}

/// The skinning pass.
#[derive(Debug)]
pub(crate) struct SkinPass {
    /// Matrices, and the buffers that the pass reads and writes.
    pub layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
}

impl SkinPass {
    fn new(device: &wgpu::Device, frame_layout: &wgpu::BindGroupLayout) -> Self {
        let layout = bind_group_layout(device, "skinning pass", &compute_entries());
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("skin"),
            layout: Some(&pipeline_layout(device, frame_layout, Some(&layout))),
            module: &Shader::SKIN.module(device),
            entry_point: Some("skin_vertices"),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { layout, pipeline }
    }
}

/// Format and shader location of a vertex buffer with one attribute.
type Attribute = (wgpu::VertexFormat, u32);

const SKINNED_POSITION: Attribute = (wgpu::VertexFormat::Float32x3, 0);

/// Vertex buffers of `shader/body_skinned.wgsl`, in the order of `Body::draw`.
const SKINNED_BODY: [Attribute; 5] = [
    SKINNED_POSITION,
    (wgpu::VertexFormat::Float32x3, 1),
    (wgpu::VertexFormat::Float32x3, 2),
    (wgpu::VertexFormat::Float32, 3),
    (wgpu::VertexFormat::Unorm8x4, 4),
];

const REST_POSITION: Attribute = (wgpu::VertexFormat::Float32x3, 0);
const JOINTS: Attribute = (wgpu::VertexFormat::Uint8x4, 2);
const WEIGHTS: Attribute = (wgpu::VertexFormat::Float32x4, 3);

/// Vertex buffers of `shader/body_skinning.wgsl`, in the order of `Body::draw`.
const SKINNING_BODY: [Attribute; 6] = [
    REST_POSITION,
    (wgpu::VertexFormat::Float32x3, 1),
    JOINTS,
    WEIGHTS,
    (wgpu::VertexFormat::Float32, 4),
    (wgpu::VertexFormat::Unorm8x4, 5),
];

/// Vertex buffers of `shader/body_from_textures.wgsl` and `shader/shadow_from_textures.wgsl`, in the order of
/// `Body::draw` and `Body::draw_shadow`.
const DECODED_BODY: [Attribute; 3] = [JOINTS, WEIGHTS, (wgpu::VertexFormat::Unorm8x4, 5)];
const DECODED_SHADOW: [Attribute; 2] = [JOINTS, WEIGHTS];

/// Vertex buffers of the shadow pass, in the order of `Body::draw_shadow`.
const SKINNED_SHADOW: [Attribute; 1] = [SKINNED_POSITION];
const SKINNING_SHADOW: [Attribute; 3] = [REST_POSITION, JOINTS, WEIGHTS];

impl Pipelines {
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat, sample_count: u32) -> Self {
        let device = &gpu.device;
        let compute = gpu.skinning() == SkinningPath::Compute;
        let frame_layout = bind_group_layout(device, "frame", &[frame_entry()]);
        let scene_layout = bind_group_layout(device, "scene", &scene_entries());
        let material = uniform::<MaterialUniform>(7, wgpu::ShaderStages::FRAGMENT);
        let draw_layout = if compute {
            bind_group_layout(device, "body", &[material])
        } else {
            let matrices = uniform::<SkinUniform>(0, wgpu::ShaderStages::VERTEX);
            bind_group_layout(device, "body", &[matrices, material])
        };
        // Over skinned buffers the shadow needs nothing of the body.
        let shadow_body = (!compute).then_some(&draw_layout);
        let shadow = Stage {
            shader: if compute {
                Shader::SHADOW_SKINNED
            } else {
                Shader::SHADOW_SKINNING
            },
            layout: &pipeline_layout(device, &frame_layout, shadow_body),
            vertex: "vs_shadow",
            fragment: None,
            attributes: if compute {
                &SKINNED_SHADOW
            } else {
                &SKINNING_SHADOW
            },
            depth_compare: wgpu::CompareFunction::Less,
            cull: None,
            sample_count: 1,
        };
        let studio = pipeline_layout(device, &scene_layout, None);
        let backdrop = Stage {
            shader: Shader::BACKDROP,
            layout: &studio,
            vertex: "vs_backdrop",
            fragment: Some(("fs_backdrop", format)),
            attributes: &[],
            depth_compare: wgpu::CompareFunction::LessEqual,
            cull: None,
            sample_count,
        };
        let floor = Stage {
            shader: Shader::FLOOR,
            vertex: "vs_floor",
            fragment: Some(("fs_floor", format)),
            depth_compare: wgpu::CompareFunction::Less,
            // From below the floor is glass.
            cull: Some(wgpu::Face::Back),
            ..backdrop
        };
        let body = Stage {
            shader: if compute {
                Shader::BODY_SKINNED
            } else {
                Shader::BODY_SKINNING
            },
            layout: &pipeline_layout(device, &scene_layout, Some(&draw_layout)),
            vertex: "vs_body",
            fragment: Some(("fs_body", format)),
            attributes: if compute {
                &SKINNED_BODY
            } else {
                &SKINNING_BODY
            },
            depth_compare: wgpu::CompareFunction::Less,
            cull: None,
            sample_count,
        };
        Self {
            shadow: shadow.pipeline(device),
            backdrop: backdrop.pipeline(device),
            floor: floor.pipeline(device),
            body: body.pipeline(device),
            scene_layout,
            draw_layout,
            skin: compute.then(|| SkinPass::new(device, &frame_layout)),
            frame_layout,
        }
    }
}

/// What draws bodies that fragment passes have decoded.
#[derive(Debug)]
pub(crate) struct DecodedPipelines {
    /// A body's material, matrices and decoded surface.
    pub draw_layout: wgpu::BindGroupLayout,
    pub shadow: wgpu::RenderPipeline,
    pub body: wgpu::RenderPipeline,
}

impl DecodedPipelines {
    pub fn new(
        device: &wgpu::Device,
        pipelines: &Pipelines,
        format: wgpu::TextureFormat,
        sample_count: u32,
    ) -> Self {
        let vertex = wgpu::ShaderStages::VERTEX;
        let entries = [
            uniform::<SkinUniform>(0, vertex),
            uniform::<MaterialUniform>(7, wgpu::ShaderStages::FRAGMENT),
            texture_entry(8, vertex, FLOATS),
            texture_entry(9, vertex, FLOATS),
            uniform::<DecodedPlace>(10, vertex),
        ];
        let draw_layout = bind_group_layout(device, "decoded body", &entries);
        let shadow = Stage {
            shader: Shader::SHADOW_DECODED,
            layout: &pipeline_layout(device, &pipelines.frame_layout, Some(&draw_layout)),
            vertex: "vs_shadow",
            fragment: None,
            attributes: &DECODED_SHADOW,
            depth_compare: wgpu::CompareFunction::Less,
            cull: None,
            sample_count: 1,
        };
        let body = Stage {
            shader: Shader::BODY_DECODED,
            layout: &pipeline_layout(device, &pipelines.scene_layout, Some(&draw_layout)),
            vertex: "vs_body",
            fragment: Some(("fs_body", format)),
            attributes: &DECODED_BODY,
            sample_count,
            ..shadow
        };
        Self {
            shadow: shadow.pipeline(device),
            body: body.pipeline(device),
            draw_layout,
        }
    }
}

/// What differs between the render pipelines.
#[derive(Clone, Copy)]
struct Stage<'a> {
    shader: Shader,
    layout: &'a wgpu::PipelineLayout,
    vertex: &'a str,
    /// Entry point and the format it writes; none for depth alone.
    fragment: Option<(&'a str, wgpu::TextureFormat)>,
    attributes: &'a [Attribute],
    depth_compare: wgpu::CompareFunction,
    cull: Option<wgpu::Face>,
    sample_count: u32,
}

impl Stage<'_> {
    fn pipeline(&self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let module = self.shader.module(device);
        let attributes: Vec<[wgpu::VertexAttribute; 1]> =
            self.attributes.iter().map(alone).collect();
        let buffers: Vec<_> = attributes
            .iter()
            .map(|one| Some(vertex_buffer(one)))
            .collect();
        let targets = self.fragment.map(|(_, format)| [Some(format.into())]);
        let fragment = self
            .fragment
            .zip(targets.as_ref())
            .map(|((entry_point, _), targets)| wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                targets,
            });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.shader.name),
            layout: Some(self.layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(self.vertex),
                compilation_options: Default::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: self.cull,
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(self.depth_compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: self.sample_count,
                ..Default::default()
            },
            fragment,
            multiview_mask: None,
            cache: None,
        })
    }
}

/// The attribute in a buffer of its own.
fn alone(&(format, shader_location): &Attribute) -> [wgpu::VertexAttribute; 1] {
    [wgpu::VertexAttribute {
        format,
        offset: 0,
        shader_location,
    }]
}

fn vertex_buffer(attributes: &[wgpu::VertexAttribute; 1]) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: attributes[0].format.size(),
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    first: &wgpu::BindGroupLayout,
    second: Option<&wgpu::BindGroupLayout>,
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = std::iter::once(first).chain(second).map(Some).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

pub(crate) fn bind_group_layout(
    device: &wgpu::Device,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries,
    })
}

pub(crate) fn uniform<T>(
    binding: u32,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: wgpu::BufferSize::new(size_of::<T>() as u64),
        },
        count: None,
    }
}

fn frame_entry() -> wgpu::BindGroupLayoutEntry {
    uniform::<FrameUniform>(0, wgpu::ShaderStages::VERTEX_FRAGMENT)
}

fn scene_entries() -> [wgpu::BindGroupLayoutEntry; 3] {
    let fragment = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let shadow_map = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
    [frame_entry(), fragment(1, shadow_map), fragment(2, sampler)]
}

/// Bindings of `shader/skin_compute.wgsl`: the matrices, four buffers read, two written.
fn compute_entries() -> [wgpu::BindGroupLayoutEntry; 7] {
    std::array::from_fn(|idx| {
        if idx == 0 {
            return uniform::<SkinUniform>(0, wgpu::ShaderStages::COMPUTE);
        }
        wgpu::BindGroupLayoutEntry {
            binding: idx as u32,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: idx < 5 },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }
    })
}
