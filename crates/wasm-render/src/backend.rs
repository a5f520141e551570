//! Which graphics interface draws to a canvas.
//!
//! A canvas keeps the type of its first context for life, so WebGPU is tried up to and including
//! its device before the canvas is touched. Browsers exist that have `navigator.gpu` but no
//! adapter, or an adapter that refuses its device.

use dynaskin_render::{
    Gpu, PixelSize, RenderError, Renderer, SkinningPath,
    wgpu::{self, Backends, Instance, InstanceDescriptor, SurfaceTarget},
};
use wasm_bindgen::JsValue;
use web_sys::HtmlCanvasElement;

use crate::error::{from_render, js_error};

/// A graphics interface of the browser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backend {
    WebGpu,
    WebGl2,
}

impl Backend {
    pub fn name(self) -> &'static str {
        match self {
            Self::WebGpu => "webgpu",
            Self::WebGl2 => "webgl2",
        }
    }
}

/// A renderer for `canvas` with the asked backend: `auto`, `webgpu` or `webgl2`.
pub(crate) async fn create(
    canvas: HtmlCanvasElement,
    backend: &str,
) -> Result<(Renderer, Backend), JsValue> {
    match backend {
        "webgpu" => {
            let ready = webgpu().await.map_err(from_render)?;
            Ok((draw_with_webgpu(canvas, ready).await?, Backend::WebGpu))
        }
        "webgl2" => Ok((draw_with_webgl2(canvas).await?, Backend::WebGl2)),
        "auto" => match webgpu().await {
            Ok(ready) => Ok((draw_with_webgpu(canvas, ready).await?, Backend::WebGpu)),
            Err(_) => Ok((draw_with_webgl2(canvas).await?, Backend::WebGl2)),
        },
        other => Err(js_error(
            "argument",
            &format!("the backend {other:?} is none of \"auto\", \"webgpu\", \"webgl2\""),
        )),
    }
}

fn descriptor(backends: Backends) -> InstanceDescriptor {
    InstanceDescriptor {
        backends,
        ..InstanceDescriptor::new_without_display_handle()
    }
}

async fn webgpu() -> Result<(Instance, Gpu), RenderError> {
    // wgpu falls back to WebGL2 by itself where `navigator.gpu` is missing, and its WebGPU instance
    // cannot be asked for adapters safely everywhere.
    if !wgpu::util::is_browser_webgpu_supported().await {
        return Err(RenderError::NoAdapter {
            reason: "this browser offers no WebGPU adapter".into(),
        });
    }
    let instance = Instance::new(descriptor(Backends::BROWSER_WEBGPU));
    let gpu = Gpu::new(&instance, None, Some(SkinningPath::Compute)).await?;
    Ok((instance, gpu))
}

async fn draw_with_webgpu(
    canvas: HtmlCanvasElement,
    (instance, gpu): (Instance, Gpu),
) -> Result<Renderer, JsValue> {
    let (surface, size) = surface(&instance, canvas)?;
    Renderer::for_surface(gpu, surface, size)
        .await
        .map_err(from_render)
}

async fn draw_with_webgl2(canvas: HtmlCanvasElement) -> Result<Renderer, JsValue> {
    let instance = Instance::new(descriptor(Backends::GL));
    let (surface, size) = surface(&instance, canvas)?;
    let gpu = Gpu::new(&instance, Some(&surface), Some(SkinningPath::VertexStage))
        .await
        .map_err(from_render)?;
    Renderer::for_surface(gpu, surface, size)
        .await
        .map_err(from_render)
}

fn surface(
    instance: &Instance,
    canvas: HtmlCanvasElement,
) -> Result<(wgpu::Surface<'static>, PixelSize), JsValue> {
    let size = PixelSize {
        width: canvas.width(),
        height: canvas.height(),
    };
    let surface = instance
        .create_surface(SurfaceTarget::Canvas(canvas))
        .map_err(|error| {
            from_render(RenderError::Surface {
                reason: error.to_string(),
            })
        })?;
    Ok((surface, size))
}
