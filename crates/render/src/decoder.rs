//! A decoder's constant data: how callers hand it in, its checks, and its tables on the card.

use crate::{Gpu, RenderError, check};

/// Texels of a row (`shader/decode.wgsl`, `WIDTH`).
pub(crate) const WIDTH: u32 = 512;

/// A decoder that is a product with a matrix, most of which is zero, and the mesh that it moves.
///
/// # Shapes
///
/// For V vertices of which S are soft, W weights and L latents.
#[derive(Clone, Copy, Debug)]
pub struct DecoderMatrix<'a> {
    /// V.
    pub vertex_count: usize,
    /// Vertex indices, `[F][3]` flattened, as those of the bodies.
    pub faces: &'a [u32],
    /// The vertices that move, ascending, `[S]`.
    pub soft_vertices: &'a [u32],
    /// `[S + 1]`: soft vertex `i` has the weights from number `starts[i]` up to `starts[i + 1]`.
    pub starts: &'a [u32],
    /// Of each weight, the latent that it is multiplied with, `[W]`.
    pub latents: &'a [u32],
    /// Along x, y and z, metres per unit of the latent, `[W][3]` flattened.
    pub weights_m: &'a [f32],
    /// L.
    pub latent_count: usize,
}

impl DecoderMatrix<'_> {
    fn validate(&self) -> Result<(), RenderError> {
        let weight_count = self.latents.len();
        check::length("starts", self.starts.len(), self.soft_vertices.len() + 1)?;
        check::floats("weights", self.weights_m, 3 * weight_count)?;
        check::length("faces", self.faces.len(), self.faces.len() / 3 * 3)?;
        below("faces", self.faces, self.vertex_count)?;
        below("soft vertices", self.soft_vertices, self.vertex_count)?;
        below("latents of the weights", self.latents, self.latent_count)?;
        ascending("soft vertices", self.soft_vertices, 1)?;
        ascending("starts", self.starts, 0)?;
        let ends = [self.starts.first(), self.starts.last()].map(|end| end.copied());
        if ends != [Some(0), u32::try_from(weight_count).ok()] {
            return Err(RenderError::OutOfRange {
                what: "the last of the starts",
                index: self.starts.len().saturating_sub(1),
                value: f64::from(ends[1].unwrap_or_default()),
                expected: format!("0 to begin with, and the {weight_count} weights at the end"),
            });
        }
        Ok(())
    }
}

/// The tables that all bodies of a decoder share (`shader/decode.wgsl`).
#[derive(Debug)]
pub(crate) struct Tables {
    pub vertices: wgpu::TextureView,
    pub weights: wgpu::TextureView,
    pub corners: wgpu::TextureView,
}

impl Tables {
    /// # Errors
    ///
    /// Wrong lengths or indices, numbers that are not finite, [`RenderError::TooLarge`].
    pub fn new(gpu: &Gpu, matrix: &DecoderMatrix<'_>) -> Result<Self, RenderError> {
        matrix.validate()?;
        let mut lists = vec![[0_u32; 4]; matrix.vertex_count];
        let ranges = matrix.starts.windows(2);
        for (&vertex, range) in matrix.soft_vertices.iter().zip(ranges) {
            lists[vertex as usize][..2].copy_from_slice(range);
        }
        let mut others = vec![Vec::new(); matrix.vertex_count];
        for &[a, b, c] in matrix.faces.as_chunks::<3>().0 {
            for [own, first, second] in [[a, b, c], [b, c, a], [c, a, b]] {
                others[own as usize].push([first, second]);
            }
        }
        let mut end = 0;
        for (list, others) in lists.iter_mut().zip(&others) {
            list[2] = end;
            end += others.len() as u32;
            list[3] = end;
        }
        let corners: Vec<[u32; 2]> = others.concat();
        let weights: Vec<[f32; 4]> = matrix
            .weights_m
            .as_chunks::<3>()
            .0
            .iter()
            .zip(matrix.latents)
            .map(|([x, y, z], latent)| [*x, *y, *z, *latent as f32])
            .collect();
        use wgpu::TextureFormat as Format;
        Ok(Self {
            vertices: table(gpu, "decoder's vertices", Format::Rgba32Uint, &lists)?,
            weights: table(gpu, "decoder's weights", Format::Rgba32Float, &weights)?,
            corners: table(gpu, "decoder's corners", Format::Rg32Uint, &corners)?,
        })
    }
}

/// A texture of `values`, one a texel, with the rest of the last row empty.
fn table<T: bytemuck::Pod>(
    gpu: &Gpu,
    what: &'static str,
    format: wgpu::TextureFormat,
    values: &[T],
) -> Result<wgpu::TextureView, RenderError> {
    let rows = values.len().div_ceil(WIDTH as usize).max(1);
    let mut padded = values.to_vec();
    padded.resize(rows * WIDTH as usize, T::zeroed());
    let texture = texture(
        gpu,
        what,
        format,
        [WIDTH, rows as u32],
        wgpu::TextureUsages::empty(),
    )?;
    write_rows(&gpu.queue, &texture, 0, bytemuck::cast_slice(&padded));
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

fn below(what: &'static str, indices: &[u32], limit: usize) -> Result<(), RenderError> {
    match indices.iter().position(|&index| index as usize >= limit) {
        None => Ok(()),
        Some(index) => Err(RenderError::OutOfRange {
            what,
            index,
            value: f64::from(indices[index]),
            expected: format!("below {limit}"),
        }),
    }
}

/// Each of `numbers` is at least `step` more than the one before.
fn ascending(what: &'static str, numbers: &[u32], step: u32) -> Result<(), RenderError> {
    let falls = |pair: &[u32]| pair[1] < pair[0].saturating_add(step);
    match numbers.windows(2).position(falls) {
        None => Ok(()),
        Some(before) => Err(RenderError::OutOfRange {
            what,
            index: before + 1,
            value: f64::from(numbers[before + 1]),
            expected: format!("at least {}", u64::from(numbers[before]) + u64::from(step)),
        }),
    }
}
