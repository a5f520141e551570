//! The key light's shadow map.

use crate::{
    Gpu, PixelSize, SkinningPath,
    targets::{DEPTH_FORMAT, depth_attachment, extent},
};

/// A depth texture as the key light sees it, and how it is sampled.
#[derive(Debug)]
pub(crate) struct ShadowMap {
    view: wgpu::TextureView,
    sampler: wgpu::Sampler,
    size_px: u32,
}

impl ShadowMap {
    pub fn new(gpu: &Gpu) -> Self {
        // WebGL2 and software adapters are short of fill rate.
        let modest = gpu.skinning() == SkinningPath::VertexStage || gpu.is_software();
        let size_px = if modest { 1024 } else { 2048 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: extent(PixelSize {
                width: size_px,
                height: size_px,
            }),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow map"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        Self {
            view: texture.create_view(&Default::default()),
            sampler,
            size_px,
        }
    }

    /// Width and height in texels.
    pub fn size_px(&self) -> u32 {
        self.size_px
    }

    /// Bindings 1 and 2 of `shader/studio.wgsl`.
    pub fn entries(&self) -> [wgpu::BindGroupEntry<'_>; 2] {
        [
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::TextureView(&self.view),
            },
            wgpu::BindGroupEntry {
                binding: 2,
                resource: wgpu::BindingResource::Sampler(&self.sampler),
            },
        ]
    }

    /// Begins to draw into a square of `side_px` texels in the map's corner.
    pub fn begin_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        side_px: u32,
    ) -> wgpu::RenderPass<'encoder> {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth_attachment(&self.view, wgpu::StoreOp::Store)),
            ..Default::default()
        });
        let side = side_px as f32;
        pass.set_viewport(0.0, 0.0, side, side, 0.0, 1.0);
        pass
    }
}
