//! The renderer as JavaScript sees it.

use dynaskin_render::{
    Background, BodyId, BodyMesh, Camera, DecoderId, DecoderMatrix, Frame, Look, OffsetSizes,
    PixelSize, RenderError, Renderer as Inner, Skinning, heat_ramp_srgb,
};
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::Poll;

use dynaskin_render::wgpu::PollType;
use glam::{Mat4, Vec3};
use js_sys::{Float32Array, Function, Promise};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, future_to_promise};
use web_sys::HtmlCanvasElement;

use crate::{
    backend::{self, Backend},
    error::{from_render, js_error},
};

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = setTimeout)]
    fn set_timeout(then: &Function);
}

/// Waits until the page's next task.
async fn next_task() -> Result<JsValue, JsValue> {
    JsFuture::from(Promise::new(&mut |then, _| set_timeout(&then))).await
}

/// The heat map's colours for a legend: 16 times red, green, blue, sRGB-encoded, 0..=1, evenly
/// spaced from no offset to the end of the range.
#[wasm_bindgen]
pub fn heat_ramp() -> Float32Array {
    Float32Array::from(heat_ramp_srgb().as_flattened())
}

/// Draws bodies to a canvas.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Renderer {
    inner: Inner,
    canvas: HtmlCanvasElement,
    backend: Backend,
}

#[wasm_bindgen]
impl Renderer {
    /// A renderer for `canvas`, which must not have a context yet. `backend` is `auto` (WebGPU
    /// where it works, else WebGL2), `webgpu` or `webgl2`.
    pub async fn create(canvas: HtmlCanvasElement, backend: String) -> Result<Self, JsValue> {
        let (inner, backend) = backend::create(canvas.clone(), &backend).await?;
        Ok(Self {
            inner,
            canvas,
            backend,
        })
    }

    /// `webgpu` or `webgl2`.
    #[wasm_bindgen(getter)]
    pub fn backend(&self) -> String {
        self.backend.name().into()
    }

    /// The graphics adapter as the browser names it; may be empty.
    #[wasm_bindgen(getter)]
    pub fn adapter(&self) -> String {
        self.inner.gpu().info().name
    }

    /// Settles when the graphics device is lost: with the reason, or with null where the renderer was
    /// freed. A WebGL2 context that the browser takes away is no matter of the device: the canvas
    /// tells that by `webglcontextlost`.
    pub fn lost(&self) -> Promise {
        let device_lost = self.inner.device_lost();
        future_to_promise(async move {
            let lost = device_lost.await;
            Ok(if lost.by_dropping {
                JsValue::NULL
            } else {
                lost.message.into()
            })
        })
    }

    /// Adds a body and returns its id. `faces` are vertex indices (3 a triangle), `skin_joints` and
    /// `skin_weights` 4 a vertex, `colors_srgba` 4 a vertex or empty.
    pub fn add_body(
        &mut self,
        faces: &[u32],
        skin_joints: &[u8],
        skin_weights: &[f32],
        colors_srgba: &[u8],
    ) -> Result<u32, JsValue> {
        let mesh = BodyMesh {
            faces,
            skin_joints,
            skin_weights,
            colors_srgba,
        };
        self.inner
            .add_body(&mesh)
            .map(BodyId::index)
            .map_err(from_render)
    }

    /// Removes a body.
    pub fn remove_body(&mut self, id: u32) -> Result<(), JsValue> {
        self.inner
            .remove_body(BodyId::from_index(id))
            .map_err(from_render)
    }

    /// Gives a body its rest-pose surface, offsets included: positions in metres and unit normals,
    /// 3 a vertex. `offsets_m`, for the heat map: vectors (3 a vertex), sizes (1 a vertex) or
    /// nothing.
    pub fn set_surface(
        &mut self,
        id: u32,
        positions_rest_m: &[f32],
        normals_rest: &[f32],
        offsets_m: Option<Vec<f32>>,
    ) -> Result<(), JsValue> {
        let offsets = match &offsets_m {
            None => OffsetSizes::Zero,
            Some(sizes_m) if sizes_m.len() * 3 == positions_rest_m.len() => {
                OffsetSizes::Sizes(sizes_m)
            }
            Some(vectors_m) => OffsetSizes::Vectors(vectors_m),
        };
        let id = BodyId::from_index(id);
        self.inner
            .set_surface(id, positions_rest_m, normals_rest, offsets)
            .map_err(from_render)
    }

    /// Adds a decoder and returns its id; nothing where this card cannot decode it. `faces` are those of its
    /// bodies, of `vertex_count` vertices; soft vertex `i` has the weights from number `starts[i]` up to
    /// `starts[i + 1]`, `weights_m` (3 each) of `latents` (1 each).
    #[allow(clippy::too_many_arguments)] // Arrays without a name, as JavaScript passes them.
    pub fn add_decoder(
        &mut self,
        vertex_count: usize,
        faces: &[u32],
        soft_vertices: &[u32],
        starts: &[u32],
        latents: &[u32],
        weights_m: &[f32],
        latent_count: usize,
    ) -> Result<Option<u32>, JsValue> {
        let matrix = DecoderMatrix {
            vertex_count,
            faces,
            soft_vertices,
            starts,
            latents,
            weights_m,
            latent_count,
        };
        match self.inner.add_decoder(&matrix) {
            Ok(id) => Ok(Some(id.index())),
            Err(RenderError::DecodingUnsupported | RenderError::TooLarge { .. }) => Ok(None),
            Err(error) => Err(from_render(error)),
        }
    }

    /// Lets a decoder decode a body, or tells that these changed: positions without offsets (3 a vertex,
    /// metres), and of the soft vertices gains, then limits in metres.
    pub fn decode_body(
        &mut self,
        id: u32,
        decoder: u32,
        still_positions_m: &[f32],
        vertex_controls: &[f32],
    ) -> Result<(), JsValue> {
        let (gains, limits_m) = vertex_controls.split_at(vertex_controls.len() / 2);
        let decoder = DecoderId::from_index(decoder);
        self.inner
            .decode_body(
                BodyId::from_index(id),
                decoder,
                still_positions_m,
                gains,
                limits_m,
            )
            .map_err(from_render)
    }

    /// Shows a body as its decoder makes it of `latents`. False for a draped body, which needs a surface.
    pub fn set_latents(&mut self, id: u32, latents: &[f32]) -> Result<bool, JsValue> {
        match self.inner.set_latents(BodyId::from_index(id), latents) {
            Ok(()) => Ok(true),
            Err(RenderError::DrapedDecoding { .. }) => Ok(false),
            Err(error) => Err(from_render(error)),
        }
    }

    /// Reads back the surface that the card has decoded, in the rest pose: positions in metres, then
    /// normals, 3 a vertex.
    pub fn read_decoded(&mut self, id: u32) -> Result<Promise, JsValue> {
        let reading = self
            .inner
            .read_decoded(BodyId::from_index(id))
            .map_err(from_render)?;
        let device = self.inner.gpu().device().clone();
        Ok(future_to_promise(async move {
            let mut reading = pin!(reading);
            loop {
                let asked = poll_fn(|context| Poll::Ready(reading.as_mut().poll(context)));
                if let Poll::Ready(surface) = asked.await {
                    let surface = surface.map_err(from_render)?;
                    return Ok(Float32Array::from(surface.concat().as_slice()).into());
                }
                // WebGL2 tells what is done between two tasks of the page alone, and only who asks.
                next_task().await?;
                device
                    .poll(PollType::Poll)
                    .map_err(|error| js_error("gpu", &error.to_string()))?;
            }
        }))
    }

    /// Poses a body: 24 column-major 4-by-4 matrices from rest-pose to world coordinates.
    pub fn set_skin_matrices(&mut self, id: u32, world_from_rest: &[f32]) -> Result<(), JsValue> {
        let columns: &[[f32; 16]; 24] = match world_from_rest.as_chunks::<16>() {
            (matrices, []) => matrices.try_into().ok(),
            _ => None,
        }
        .ok_or_else(|| wrong_length("the skin matrices", 384, world_from_rest.len()))?;
        let matrices = columns.map(|columns| Mat4::from_cols_array(&columns));
        self.inner
            .set_skin_matrices(BodyId::from_index(id), &matrices)
            .map_err(from_render)
    }

    /// Blends the motions of a body's joints as dual quaternions, or linearly.
    pub fn set_skinning(&mut self, id: u32, dual_quaternions: bool) -> Result<(), JsValue> {
        let skinning = if dual_quaternions {
            Skinning::DualQuaternion
        } else {
            Skinning::Linear
        };
        self.inner
            .set_skinning(BodyId::from_index(id), skinning)
            .map_err(from_render)
    }

    /// Stands a body elsewhere: a column-major 4-by-4 matrix, applied after the skin matrices.
    pub fn set_body_placement(&mut self, id: u32, world_from_host: &[f32]) -> Result<(), JsValue> {
        let columns: &[f32; 16] = world_from_host
            .try_into()
            .map_err(|_| wrong_length("the placement", 16, world_from_host.len()))?;
        self.inner
            .set_body_placement(BodyId::from_index(id), Mat4::from_cols_array(columns))
            .map_err(from_render)
    }

    /// Shows a body as matt plaster or as painted, and its clothes as cloth that spans or as paint.
    pub fn set_look(&mut self, id: u32, sculpture: bool, draped: bool) -> Result<(), JsValue> {
        let look = Look { sculpture, draped };
        self.inner
            .set_look(BodyId::from_index(id), look)
            .map_err(from_render)
    }

    /// Shows or hides a body.
    pub fn set_body_visible(&mut self, id: u32, visible: bool) -> Result<(), JsValue> {
        self.inner
            .set_body_visible(BodyId::from_index(id), visible)
            .map_err(from_render)
    }

    /// Moves the camera: eye and target in metres (3 numbers each), vertical field of view.
    pub fn set_camera(
        &mut self,
        eye_world_m: &[f32],
        target_world_m: &[f32],
        fov_y_radians: f32,
    ) -> Result<(), JsValue> {
        let camera = Camera {
            eye_world_m: Vec3::from(three("the camera's eye", eye_world_m)?),
            target_world_m: Vec3::from(three("the camera's target", target_world_m)?),
            fov_y_radians,
        };
        self.inner.set_camera(camera).map_err(from_render)
    }

    /// Colours bodies by offset size from 0 to `range_mm` millimetres; as painted without a range.
    pub fn set_heat_map(&mut self, range_mm: Option<f32>) -> Result<(), JsValue> {
        self.inner.set_heat_map(range_mm).map_err(from_render)
    }

    /// Paints the backdrop: sRGB-encoded red, green, blue, 0..=1.
    pub fn set_background(
        &mut self,
        center_srgb: &[f32],
        edge_srgb: &[f32],
    ) -> Result<(), JsValue> {
        let background = Background {
            center_srgb: three("the background's centre", center_srgb)?,
            edge_srgb: three("the background's edge", edge_srgb)?,
        };
        self.inner.set_background(background).map_err(from_render)
    }

    /// Sets the size of canvas and picture: CSS pixels times `pixel_ratio`.
    pub fn resize(&mut self, width: f32, height: f32, pixel_ratio: f32) -> Result<(), JsValue> {
        let size = PixelSize::from_css(width, height, pixel_ratio).map_err(from_render)?;
        self.inner.resize(size);
        // The device's limit may have made it smaller.
        let size = self.inner.size();
        self.canvas.set_width(size.width);
        self.canvas.set_height(size.height);
        Ok(())
    }

    /// Draws one picture; false where the page is hidden and nothing was drawn.
    pub fn render(&mut self) -> Result<bool, JsValue> {
        self.inner
            .render()
            .map(|frame| frame == Frame::Drawn)
            .map_err(from_render)
    }

    /// Skins on the GPU and reads the positions back: 3 a vertex, metres, in the world. WebGPU
    /// only; drawing may go on meanwhile.
    pub fn read_skinned_positions(&mut self, id: u32) -> Result<Promise, JsValue> {
        let reading = self
            .inner
            .read_skinned_positions(BodyId::from_index(id))
            .map_err(from_render)?;
        Ok(future_to_promise(async move {
            let positions_m = reading.await.map_err(from_render)?;
            Ok(Float32Array::from(positions_m.as_slice()).into())
        }))
    }
}

fn three(what: &str, values: &[f32]) -> Result<[f32; 3], JsValue> {
    values
        .try_into()
        .map_err(|_| wrong_length(what, 3, values.len()))
}

fn wrong_length(what: &str, expected: usize, got: usize) -> JsValue {
    js_error(
        "argument",
        &format!("{what}: {got} numbers, expected {expected}"),
    )
}
