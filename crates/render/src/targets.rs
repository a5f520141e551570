//! The textures that one picture size needs.

use crate::RenderError;

/// Depth format of the picture and of the shadow map: filterable with comparison on WebGL2.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24Plus;

/// A picture's size in pixels of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl PixelSize {
    /// The size of a picture of `width` by `height` CSS pixels on a screen with `pixel_ratio`
    /// device pixels per CSS pixel; at least 1 by 1.
    ///
    /// # Errors
    ///
    /// [`RenderError::NonFinite`], and [`RenderError::OutOfRange`] for a pixel ratio outside
    /// 0.1..=8.
    pub fn from_css(width: f32, height: f32, pixel_ratio: f32) -> Result<Self, RenderError> {
        crate::check::finite(
            "the picture's size and pixel ratio",
            &[width, height, pixel_ratio],
        )?;
        if !(0.1..=8.0).contains(&pixel_ratio) {
            return Err(RenderError::OutOfRange {
                what: "the pixel ratio",
                index: 0,
                value: f64::from(pixel_ratio),
                expected: "0.1 to 8".into(),
            });
        }
        // The cast saturates, so huge sizes meet the device's limit later.
        let pixels = |css: f32| ((css * pixel_ratio).round() as u32).max(1);
        Ok(Self {
            width: pixels(width),
            height: pixels(height),
        })
    }

    /// This size, scaled down to fit textures of at most `limit` pixels a side, same shape.
    pub(crate) fn fitted(self, limit: u32) -> Self {
        let longest = self.width.max(self.height);
        if longest <= limit {
            return Self {
                width: self.width.max(1),
                height: self.height.max(1),
            };
        }
        let scale = |side: u32| (u64::from(side) * u64::from(limit) / u64::from(longest)) as u32;
        Self {
            width: scale(self.width).max(1),
            height: scale(self.height).max(1),
        }
    }

    pub(crate) fn aspect(self) -> f32 {
        self.width as f32 / self.height as f32
    }
}

/// Multisampled colour (where the format allows it) and depth of one picture.
#[derive(Debug)]
pub(crate) struct Targets {
    /// None with one sample a pixel: drawing then goes to the picture itself.
    multisampled: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

impl Targets {
    pub fn new(
        device: &wgpu::Device,
        size: PixelSize,
        format: wgpu::TextureFormat,
        sample_count: u32,
    ) -> Self {
        let view = |label, format| {
            let descriptor = wgpu::TextureDescriptor {
                label: Some(label),
                size: extent(size),
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            };
            device
                .create_texture(&descriptor)
                .create_view(&Default::default())
        };
        Self {
            multisampled: (sample_count > 1).then(|| view("multisampled color", format)),
            depth: view("depth", DEPTH_FORMAT),
        }
    }

    /// Begins the pass that draws the picture.
    pub fn begin_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        picture: &wgpu::TextureView,
    ) -> wgpu::RenderPass<'encoder> {
        let (view, resolve_target, store) = match &self.multisampled {
            Some(multisampled) => (multisampled, Some(picture), wgpu::StoreOp::Discard),
            None => (picture, None, wgpu::StoreOp::Store),
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                // The backdrop covers every pixel.
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store,
                },
            })],
            depth_stencil_attachment: Some(depth_attachment(&self.depth, wgpu::StoreOp::Discard)),
            ..Default::default()
        })
    }
}

/// A cleared depth attachment.
pub(crate) fn depth_attachment(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(1.0),
            store,
        }),
        stencil_ops: None,
    }
}

pub(crate) fn extent(size: PixelSize) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: size.width,
        height: size.height,
        depth_or_array_layers: 1,
    }
}

/// What the picture is drawn to.
#[derive(Debug)]
pub(crate) enum Output {
    Surface {
        surface: wgpu::Surface<'static>,
        config: wgpu::SurfaceConfiguration,
    },
    Offscreen {
        texture: wgpu::Texture,
    },
}

/// Format of offscreen pictures: the bytes are sRGB-encoded by the shader.
const OFFSCREEN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl Output {
    /// Prepares a surface for drawing.
    pub fn surface(
        surface: wgpu::Surface<'static>,
        adapter: &wgpu::Adapter,
        size: PixelSize,
    ) -> Result<Self, RenderError> {
        let unfit = |reason: &str| RenderError::Surface {
            reason: reason.into(),
        };
        let mut config = surface
            .get_default_config(adapter, size.width, size.height)
            .ok_or_else(|| unfit("the adapter cannot present to it"))?;
        // The shaders encode to sRGB themselves, the same way on every backend.
        config.format = surface
            .get_capabilities(adapter)
            .formats
            .into_iter()
            .find(|format| {
                matches!(
                    format,
                    wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm
                )
            })
            .ok_or_else(|| unfit("it offers no format of eight bits a channel"))?;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        Ok(Self::Surface { surface, config })
    }

    /// A texture that can be read back.
    pub fn offscreen(device: &wgpu::Device, size: PixelSize) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("offscreen picture"),
            size: extent(size),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: OFFSCREEN_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Self::Offscreen { texture }
    }

    pub fn format(&self) -> wgpu::TextureFormat {
        match self {
            Self::Surface { config, .. } => config.format,
            Self::Offscreen { .. } => OFFSCREEN_FORMAT,
        }
    }

    /// Takes over a new size.
    pub fn resize(&mut self, device: &wgpu::Device, size: PixelSize) {
        match self {
            Self::Surface { surface, config } => {
                config.width = size.width;
                config.height = size.height;
                surface.configure(device, config);
            }
            Self::Offscreen { .. } => *self = Self::offscreen(device, size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn css_sizes_become_pixels() {
        let size = |w, h, ratio| PixelSize::from_css(w, h, ratio);
        assert_eq!(
            size(640.0, 480.0, 2.0),
            Ok(PixelSize {
                width: 1280,
                height: 960
            })
        );
        assert_eq!(
            size(0.0, -3.0, 1.0),
            Ok(PixelSize {
                width: 1,
                height: 1
            })
        );
        assert!(size(f32::NAN, 1.0, 1.0).is_err());
        assert!(size(10.0, 10.0, 0.0).is_err());
    }

    #[test]
    fn huge_pictures_shrink_and_keep_their_shape() {
        let huge = PixelSize::from_css(1e12, 5e8, 1.0).unwrap().fitted(2048);
        assert_eq!(huge.width, 2048);
        let wide = PixelSize {
            width: 8000,
            height: 4000,
        }
        .fitted(2048);
        assert_eq!(
            wide,
            PixelSize {
                width: 2048,
                height: 1024
            }
        );
        assert_eq!(
            PixelSize {
                width: 0,
                height: 7
            }
            .fitted(9),
            PixelSize {
                width: 1,
                height: 7
            }
        );
    }
}
