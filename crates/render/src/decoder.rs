//! A decoder's tables on the card, and textures of numbers.

use dynaskin_decoding::{DecoderMatrix, Tables, WIDTH};

use crate::{Gpu, RenderError};

/// [`Tables`] as textures.
#[derive(Debug)]
pub(crate) struct CardTables {
    pub vertices: wgpu::TextureView,
    pub weights: wgpu::TextureView,
    pub corners: wgpu::TextureView,
}

impl CardTables {
    /// # Errors
    ///
    /// Wrong lengths or indices, numbers that are not finite, [`RenderError::TooLarge`].
    pub fn new(gpu: &Gpu, matrix: &DecoderMatrix<'_>) -> Result<Self, RenderError> {
        let Tables {
            vertices,
            weights,
            corners,
        } = Tables::new(matrix).map_err(RenderError::refused)?;
        use wgpu::TextureFormat as Format;
        Ok(Self {
            vertices: table(gpu, "decoder's vertices", Format::Rgba32Uint, &vertices)?,
            weights: table(gpu, "decoder's weights", Format::Rgba32Float, &weights)?,
            corners: table(gpu, "decoder's corners", Format::Rg32Uint, &corners)?,
        })
    }
}

/// A texture of `texels`, in whole rows.
fn table<T: bytemuck::Pod>(
    gpu: &Gpu,
    what: &'static str,
    format: wgpu::TextureFormat,
    texels: &[T],
) -> Result<wgpu::TextureView, RenderError> {
    let rows = texels.len() as u32 / WIDTH;
    let none = wgpu::TextureUsages::empty();
    let texture = texture(gpu, what, format, [WIDTH, rows], none)?;
    write_rows(&gpu.queue, &texture, 0, bytemuck::cast_slice(texels));
    Ok(texture.create_view(&Default::default()))
}

/// A texture that shaders read, of `width` by `height` texels.
///
/// # Errors
///
/// [`RenderError::TooLarge`].
pub(crate) fn texture(
    gpu: &Gpu,
    what: &'static str,
    format: wgpu::TextureFormat,
    [width, height]: [u32; 2],
    usage: wgpu::TextureUsages,
) -> Result<wgpu::Texture, RenderError> {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if width > limit || height > limit {
        let bytes = u64::from(format.block_copy_size(None).unwrap_or(16));
        return Err(RenderError::TooLarge {
            what,
            needed_bytes: u64::from(width) * u64::from(height) * bytes,
            limit_bytes: u64::from(limit) * u64::from(width.min(limit)) * bytes,
        });
    }
    use wgpu::TextureUsages as Usage;
    Ok(gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(what),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | Usage::TEXTURE_BINDING | Usage::COPY_DST,
        view_formats: &[],
    }))
}

/// Writes whole rows from row `first` on.
pub(crate) fn write_rows(queue: &wgpu::Queue, texture: &wgpu::Texture, first: u32, bytes: &[u8]) {
    let row_bytes = texture.width() * texture.format().block_copy_size(None).unwrap_or(16);
    let mut target = texture.as_image_copy();
    target.origin.y = first;
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row_bytes),
        rows_per_image: None,
    };
    let size = wgpu::Extent3d {
        width: texture.width(),
        height: bytes.len() as u32 / row_bytes,
        depth_or_array_layers: 1,
    };
    queue.write_texture(target, bytes, layout, size);
}
