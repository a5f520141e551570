//! The renderer: bodies, camera and settings in, one picture out.

use std::collections::BTreeMap;

use dynaskin_skeleton::Skinning;
use glam::Mat4;

use crate::{
    BodyMesh, Camera, DecoderMatrix, DeviceLost, Gpu, Look, OffsetSizes, PixelSize, RenderError,
    body::Body,
    check,
    decoding::{DecoderId, Decoding},
    gpu_data::{DISC_SEGMENTS, FrameUniform, HEAT_STOPS, JOINT_COUNT},
    heat::{heat_stops_linear, linear_from_srgb},
    parts::WorldPart,
    pipelines::{DecodedPipelines, Pipelines},
    readback,
    shadow::ShadowMap,
    studio::{self, ShadowView},
    targets::{Output, Targets},
};

/// Names a body of one renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(u32);

impl BodyId {
    /// The id as a number, for bindings to other languages.
    pub const fn index(self) -> u32 {
        self.0
    }

    /// The id with this number; calls refuse numbers that no body has.
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }
}

/// Result of drawing a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// It was drawn.
    Drawn,
    /// The window is hidden or busy: nothing was drawn, which is no error.
    Skipped,
}

/// Colours of the backdrop, sRGB-encoded, 0..=1 each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// Behind the subject.
    pub center_srgb: [f32; 3],
    /// At the picture's edges.
    pub edge_srgb: [f32; 3],
}

impl Default for Background {
    /// A slate-grey studio wall.
    fn default() -> Self {
        Self {
            center_srgb: [0.46, 0.49, 0.53],
            edge_srgb: [0.15, 0.165, 0.19],
        }
    }
}

/// Draws bodies to a canvas, a window or a texture.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    output: Output,
    size: PixelSize,
    sample_count: u32,
    targets: Targets,
    shadow: ShadowMap,
    frame_buffer: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    scene_group: wgpu::BindGroup,
    bodies: BTreeMap<BodyId, Body>,
    /// Made with the first decoder.
    decoding: Option<Decoding>,
    /// Likewise; none where a compute pass decodes.
    decoded: Option<DecodedPipelines>,
    next_id: u32,
    camera: Camera,
    background: Background,
    heat_range_mm: Option<f32>,
    heat_ramp: [[f32; 4]; HEAT_STOPS],
}

impl Renderer {
    /// Draws to `surface`, which `gpu` was asked to be compatible with.
    ///
    /// # Errors
    ///
    /// [`RenderError::Surface`] where the adapter cannot present to it, [`RenderError::Device`]
    /// where the device refuses a shader or a buffer.
    pub async fn for_surface(
        gpu: Gpu,
        surface: wgpu::Surface<'static>,
        size: PixelSize,
    ) -> Result<Self, RenderError> {
        let size = size.fitted(gpu.device.limits().max_texture_dimension_2d);
        let mut output = Output::surface(surface, &gpu.adapter, size)?;
        output.resize(&gpu.device, size);
        Self::new(gpu, output, size).await
    }

    /// Draws to a texture, for [`Self::read_pixels`].
    ///
    /// # Errors
    ///
    /// [`RenderError::Device`] where the device refuses a shader or a buffer.
    pub async fn offscreen(gpu: Gpu, size: PixelSize) -> Result<Self, RenderError> {
        let size = size.fitted(gpu.device.limits().max_texture_dimension_2d);
        let output = Output::offscreen(&gpu.device, size);
        Self::new(gpu, output, size).await
    }

    async fn new(gpu: Gpu, output: Output, size: PixelSize) -> Result<Self, RenderError> {
        let errors = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let format = output.format();
        let sample_count = gpu.sample_count(format);
        let pipelines = Pipelines::new(&gpu, format, sample_count);
        let shadow = ShadowMap::new(&gpu);
        let frame_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let frame_entry = wgpu::BindGroupEntry {
            binding: 0,
            resource: frame_buffer.as_entire_binding(),
        };
        let [map_entry, sampler_entry] = shadow.entries();
        let group = |label, layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            let descriptor = wgpu::BindGroupDescriptor {
                label: Some(label),
                layout,
                entries,
            };
            gpu.device.create_bind_group(&descriptor)
        };
        let frame_group = group(
            "frame",
            &pipelines.frame_layout,
            std::slice::from_ref(&frame_entry),
        );
        let scene_entries = [frame_entry.clone(), map_entry, sampler_entry];
        let scene_group = group("scene", &pipelines.scene_layout, &scene_entries);
        let targets = Targets::new(&gpu.device, size, format, sample_count);
        if let Some(error) = errors.pop().await {
            return Err(RenderError::Device {
                message: error.to_string(),
            });
        }
        Ok(Self {
            gpu,
            pipelines,
            output,
            size,
            sample_count,
            targets,
            shadow,
            frame_buffer,
            frame_group,
            scene_group,
            bodies: BTreeMap::new(),
            decoding: None,
            decoded: None,
            next_id: 0,
            camera: Camera::default(),
            background: Background::default(),
            heat_range_mm: None,
            heat_ramp: heat_stops_linear(),
        })
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Size of the picture in pixels.
    pub fn size(&self) -> PixelSize {
        self.size
    }

    /// Waits until the device is lost; see [`Gpu::device_lost`].
    pub fn device_lost(&self) -> impl Future<Output = DeviceLost> + use<> {
        self.gpu.device_lost()
    }

    /// Adds a body. It appears once [`Self::set_surface`] gave it a surface, at the origin in its
    /// rest pose until [`Self::set_skin_matrices`] poses it.
    ///
    /// # Errors
    ///
    /// Wrong lengths, indices or weights, numbers that are not finite, or
    /// [`RenderError::TooLarge`].
    pub fn add_body(&mut self, mesh: &BodyMesh<'_>) -> Result<BodyId, RenderError> {
        let body = Body::new(&self.gpu, &self.pipelines, mesh)?;
        let id = BodyId(self.next_id);
        self.next_id += 1;
        self.bodies.insert(id, body);
        Ok(id)
    }

    /// Removes a body and frees its buffers.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`].
    pub fn remove_body(&mut self, id: BodyId) -> Result<(), RenderError> {
        let body = self.bodies.remove(&id);
        let body = body.ok_or(RenderError::UnknownBody { id: id.0 })?;
        if let (Some(seat), Some(decoding)) = (body.seat(), &mut self.decoding) {
            decoding.free(seat);
        }
        Ok(())
    }

    /// Adds a decoder, whose bodies then need latents alone: see [`Self::decode_body`]. It stays as long as the
    /// renderer.
    ///
    /// # Errors
    ///
    /// [`RenderError::DecodingUnsupported`]; wrong lengths, indices or order, numbers that are not finite,
    /// [`RenderError::TooLarge`].
    pub fn add_decoder(&mut self, matrix: &DecoderMatrix<'_>) -> Result<DecoderId, RenderError> {
        let decoding = match &mut self.decoding {
            Some(decoding) => decoding,
            none => {
                let decoding = Decoding::new(&self.gpu)?;
                if self.pipelines.skin.is_none() {
                    let (device, format) = (&self.gpu.device, self.output.format());
                    let pipelines = &self.pipelines;
                    let decoded =
                        DecodedPipelines::new(device, pipelines, format, self.sample_count);
                    self.decoded = Some(decoded);
                }
                none.insert(decoding)
            }
        };
        decoding.add(&self.gpu, matrix)
    }

    /// Lets `decoder` decode a body on the card from now on, or tells it that surface, gains or limits of the
    /// body changed. What is drawn changes with [`Self::set_latents`].
    ///
    /// # Shapes
    ///
    /// `still_positions_m`, the surface without offsets in metres, is `[V][3]` flattened; `gains` (factors)
    /// and `limits_m` (the longest offset in metres; up to half of it is left as it is) are one a soft vertex
    /// of the decoder.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`], [`RenderError::UnknownDecoder`], [`RenderError::WrongLength`], also for a
    /// decoder of another mesh, [`RenderError::NonFinite`], [`RenderError::TooLarge`].
    pub fn decode_body(
        &mut self,
        id: BodyId,
        decoder: DecoderId,
        still_positions_m: &[f32],
        gains: &[f32],
        limits_m: &[f32],
    ) -> Result<(), RenderError> {
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        let unknown = RenderError::UnknownDecoder {
            id: decoder.index(),
        };
        let decoding = self.decoding.as_mut().ok_or(unknown)?;
        let own = body.seat().filter(|seat| seat.decoder == decoder);
        let seat = match own {
            Some(seat) => seat,
            None => decoding.seat(&self.gpu, decoder, body.vertex_count())?,
        };
        let queue = &self.gpu.queue;
        let set = decoding.set_body(queue, seat, still_positions_m, gains, limits_m);
        if own.is_none() {
            if let Err(error) = set {
                decoding.free(seat);
                return Err(error);
            }
            if let Some(before) = body.seat() {
                decoding.free(before);
            }
            let surface = decoding.surface(seat);
            body.sit(
                &self.gpu,
                &self.pipelines,
                self.decoded.as_ref(),
                seat,
                &surface,
            );
        }
        set?;
        if body.is_decoded() {
            decoding.touch(seat);
        }
        body.take_still(queue, still_positions_m);
        Ok(())
    }

    /// Shows a body as its decoder makes it of `latents` (L numbers), less those at rest: all 0 is the surface
    /// without offsets.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`], [`RenderError::NotDecoded`], [`RenderError::DrapedDecoding`],
    /// [`RenderError::WrongLength`], [`RenderError::NonFinite`].
    pub fn set_latents(&mut self, id: BodyId, latents: &[f32]) -> Result<(), RenderError> {
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        let (Some(seat), Some(decoding)) = (body.seat(), &mut self.decoding) else {
            return Err(RenderError::NotDecoded { id: id.0 });
        };
        if body.is_draped() {
            return Err(RenderError::DrapedDecoding { id: id.0 });
        }
        decoding.set_latents(seat, latents)?;
        body.show_decoded();
        Ok(())
    }

    /// Gives a body its surface in the rest pose, offsets included: once, or every frame.
    ///
    /// # Shapes
    ///
    /// `positions_rest_m` (metres) and `normals_rest` (unit) are `[V][3]` flattened.
    ///
    /// # Errors
    ///
    /// Wrong lengths or numbers that are not finite; the surface then stays as it was.
    pub fn set_surface(
        &mut self,
        id: BodyId,
        positions_rest_m: &[f32],
        normals_rest: &[f32],
        offsets: OffsetSizes<'_>,
    ) -> Result<(), RenderError> {
        let queue = &self.gpu.queue;
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.set_surface(queue, positions_rest_m, normals_rest, offsets)?;
        if let (Some(seat), Some(decoding)) = (body.seat(), &mut self.decoding) {
            decoding.leave(seat);
        }
        Ok(())
    }

    /// Poses a body: per joint of SMPL's skeleton, the matrix from rest-pose to world coordinates
    /// (world from joint, times joint from rest).
    ///
    /// # Errors
    ///
    /// Numbers that are not finite; the pose then stays as it was.
    pub fn set_skin_matrices(
        &mut self,
        id: BodyId,
        world_from_rest: &[Mat4; JOINT_COUNT],
    ) -> Result<(), RenderError> {
        let queue = &self.gpu.queue;
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.set_skin_matrices(queue, world_from_rest)
    }

    /// Blends the motions of a body's joints linearly, as at first, or as dual quaternions, from the next picture
    /// on. For the latter each skin matrix must be a rigid motion after a uniform scale.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`].
    pub fn set_skinning(&mut self, id: BodyId, skinning: Skinning) -> Result<(), RenderError> {
        let queue = &self.gpu.queue;
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.set_skinning(queue, skinning);
        Ok(())
    }

    /// Displaces a body: `world_from_host` is applied after its skin matrices, so that several
    /// bodies with the same pose can stand side by side. Use rotations and translations only; the identity
    /// undoes it.
    ///
    /// # Errors
    ///
    /// Numbers that are not finite, [`RenderError::UnknownBody`].
    pub fn set_body_placement(
        &mut self,
        id: BodyId,
        world_from_host: Mat4,
    ) -> Result<(), RenderError> {
        let queue = &self.gpu.queue;
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.set_placement(queue, world_from_host)
    }

    /// Shows a body in another look: its colours at once, its surface with the next that it gets.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`].
    pub fn set_look(&mut self, id: BodyId, look: Look) -> Result<(), RenderError> {
        let queue = &self.gpu.queue;
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.set_look(queue, look);
        Ok(())
    }

    /// Shows or hides a body.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`].
    pub fn set_body_visible(&mut self, id: BodyId, visible: bool) -> Result<(), RenderError> {
        let body = self
            .bodies
            .get_mut(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        body.visible = visible;
        Ok(())
    }

    /// Moves the camera.
    ///
    /// # Errors
    ///
    /// Numbers that are not finite or out of range; see [`Camera`].
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), RenderError> {
        camera.validate()?;
        self.camera = camera;
        Ok(())
    }

    /// Shows offset sizes as colours from 0 to `range_mm` millimetres, or the painted colours.
    /// [`crate::heat_ramp_srgb`] has the legend's colours.
    ///
    /// # Errors
    ///
    /// A range that is not finite or not positive.
    pub fn set_heat_map(&mut self, range_mm: Option<f32>) -> Result<(), RenderError> {
        if let Some(range_mm) = range_mm {
            check::finite("the heat map's range", &[range_mm])?;
            if !(1e-3..=1e6).contains(&range_mm) {
                return Err(RenderError::OutOfRange {
                    what: "the heat map's range",
                    index: 0,
                    value: f64::from(range_mm),
                    expected: "0.001 to 1,000,000 mm".into(),
                });
            }
        }
        self.heat_range_mm = range_mm;
        Ok(())
    }

    /// Paints the backdrop.
    ///
    /// # Errors
    ///
    /// Colours that are not finite. Others are clamped to 0..=1.
    pub fn set_background(&mut self, background: Background) -> Result<(), RenderError> {
        check::finite("the background's centre", &background.center_srgb)?;
        check::finite("the background's edge", &background.edge_srgb)?;
        self.background = background;
        Ok(())
    }

    /// Takes over a new picture size; sizes beyond the device's limit shrink to fit.
    pub fn resize(&mut self, size: PixelSize) {
        let size = size.fitted(self.gpu.device.limits().max_texture_dimension_2d);
        if size != self.size {
            self.size = size;
            self.output.resize(&self.gpu.device, size);
            let format = self.output.format();
            self.targets = Targets::new(&self.gpu.device, size, format, self.sample_count);
        }
    }

    /// Draws one picture and presents it.
    ///
    /// # Errors
    ///
    /// [`RenderError::DeviceLost`] and [`RenderError::SurfaceLost`] (make a new renderer), or
    /// [`RenderError::Device`] with what the device said since the last picture.
    pub fn render(&mut self) -> Result<Frame, RenderError> {
        self.gpu.check_health()?;
        let (picture, presented) = match &self.output {
            Output::Offscreen { texture } => (texture.create_view(&Default::default()), None),
            Output::Surface { .. } => match self.next_surface_texture()? {
                None => return Ok(Frame::Skipped),
                Some(next) => (next.texture.create_view(&Default::default()), Some(next)),
            },
        };
        let shadow = self.write_frame();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.encode_decoding(&mut encoder);
        self.encode_skinning(&mut encoder);
        self.encode_shadow(&mut encoder, shadow);
        self.encode_picture(&mut encoder, &picture);
        self.gpu.queue.submit([encoder.finish()]);
        if let Some(texture) = presented {
            self.gpu.queue.present(texture);
        }
        Ok(Frame::Drawn)
    }

    /// Skins on the GPU and reads the positions back: `[V][3]` flattened, metres, in the world.
    /// The future borrows nothing, so drawing can go on while it waits.
    ///
    /// # Errors
    ///
    /// [`RenderError::ReadBackUnsupported`] where the vertex stage skins (WebGL2),
    /// [`RenderError::UnknownBody`], and what the device reports.
    pub fn read_skinned_positions(
        &mut self,
        id: BodyId,
    ) -> Result<impl Future<Output = Result<Vec<f32>, RenderError>> + use<>, RenderError> {
        self.gpu.check_health()?;
        // Before anything is encoded: what is not submitted would never be decoded.
        let body = self.bodies.get(&id);
        let body = body.ok_or(RenderError::UnknownBody { id: id.0 })?;
        let skinned = body.skinned_positions().cloned();
        let skinned = skinned.ok_or(RenderError::ReadBackUnsupported)?;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.encode_decoding(&mut encoder);
        self.encode_skinning(&mut encoder);
        let host = readback::host_buffer(&self.gpu.device, skinned.size());
        encoder.copy_buffer_to_buffer(&skinned, 0, &host, 0, skinned.size());
        self.gpu.queue.submit([encoder.finish()]);
        Ok(readback::read(self.gpu.device.clone(), host))
    }

    /// Decodes on the card and reads the surface back, in the rest pose: positions in metres and unit normals,
    /// both `[V][3]` flattened. The future borrows nothing.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownBody`], [`RenderError::NotDecoded`], and what the device reports.
    pub fn read_decoded(
        &mut self,
        id: BodyId,
    ) -> Result<impl Future<Output = Result<[Vec<f32>; 2], RenderError>> + use<>, RenderError> {
        self.gpu.check_health()?;
        let body = self
            .bodies
            .get(&id)
            .ok_or(RenderError::UnknownBody { id: id.0 })?;
        let vertex_count = body.vertex_count();
        let seat = body.seat().filter(|_| body.is_decoded());
        let (Some(seat), Some(decoding)) = (seat, &mut self.decoding) else {
            return Err(RenderError::NotDecoded { id: id.0 });
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        decoding.encode(&self.gpu.queue, &mut encoder);
        let (hosts, numbers) = decoding.copy(&self.gpu.device, seat, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let device = self.gpu.device.clone();
        Ok(async move {
            let mut surface = [Vec::new(), Vec::new()];
            for (vectors, host) in surface.iter_mut().zip(hosts) {
                let read: Vec<f32> = readback::read(device.clone(), host).await?;
                let own = read.chunks_exact(numbers).take(vertex_count);
                vectors.extend(own.flat_map(|vector| &vector[..3]));
            }
            Ok(surface)
        })
    }

    /// Pixels of the last picture of an offscreen renderer: rows from the top, RGBA, sRGB-encoded.
    ///
    /// # Errors
    ///
    /// [`RenderError::NotOffscreen`], and what the device reports.
    pub async fn read_pixels(&self) -> Result<Vec<u8>, RenderError> {
        let Output::Offscreen { texture } = &self.output else {
            return Err(RenderError::NotOffscreen);
        };
        readback::read_texture(&self.gpu, texture).await
    }

    /// The surface's next texture; a surface that changed is configured anew, once.
    fn next_surface_texture(&self) -> Result<Option<wgpu::SurfaceTexture>, RenderError> {
        use wgpu::CurrentSurfaceTexture as Current;
        let Output::Surface { surface, config } = &self.output else {
            return Ok(None);
        };
        for _attempt in 0..2 {
            match surface.get_current_texture() {
                Current::Success(texture) | Current::Suboptimal(texture) => {
                    return Ok(Some(texture));
                }
                Current::Timeout | Current::Occluded => return Ok(None),
                Current::Outdated | Current::Lost => surface.configure(&self.gpu.device, config),
                Current::Validation => {
                    self.gpu.check_health()?;
                    break;
                }
            }
        }
        Err(RenderError::SurfaceLost)
    }

    /// Gives what the key light sees.
    fn write_frame(&self) -> ShadowView {
        let drawn = self.bodies.values().filter(|body| body.is_drawn());
        let parts: Vec<WorldPart> = drawn.flat_map(Body::world_parts).collect();
        let shadow = studio::fit_shadow(&parts, self.shadow.size_px());
        let (occluders, occluder_count) = studio::occluders(&parts);
        let camera = &self.camera;
        let linear = |srgb: [f32; 3]| {
            let [r, g, b] = srgb.map(|encoded| linear_from_srgb(encoded.clamp(0.0, 1.0)));
            [r, g, b, 1.0]
        };
        let frame = FrameUniform {
            clip_from_world: camera
                .clip_from_world(self.size.aspect())
                .to_cols_array_2d(),
            shadow_from_world: shadow.shadow_from_world.to_cols_array_2d(),
            eye_world_m: camera.eye_world_m.to_array(),
            occluder_count,
            key_world: studio::key_world().to_array(),
            shadow_texel: 1.0 / self.shadow.size_px() as f32,
            fill_world: studio::fill_world(camera).to_array(),
            shadow_texel_m: shadow.texel_m,
            rim_world: studio::rim_world(camera).to_array(),
            heat_on: u32::from(self.heat_range_mm.is_some()),
            floor_center_m: studio::floor_center_m(camera),
            floor_radius_m: studio::FLOOR_RADIUS_M,
            inverse_heat_range_per_m: self.heat_range_mm.map_or(0.0, |range_mm| 1e3 / range_mm),
            inverse_size_px: [1.0 / self.size.width as f32, 1.0 / self.size.height as f32],
            aspect: self.size.aspect(),
            shadow_share: shadow.side_px as f32 / self.shadow.size_px() as f32,
            background_center: linear(self.background.center_srgb),
            background_edge: linear(self.background.edge_srgb),
            heat_ramp: self.heat_ramp,
            occluders,
        };
        self.gpu
            .queue
            .write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&frame));
        shadow
    }

    fn encode_decoding(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(decoding) = &mut self.decoding {
            decoding.encode(&self.gpu.queue, encoder);
        }
    }

    fn encode_skinning(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let Some(skin) = &self.pipelines.skin else {
            return;
        };
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&skin.pipeline);
        pass.set_bind_group(0, &self.frame_group, &[]);
        for body in self.bodies.values_mut() {
            body.skin(&mut pass);
        }
    }

    fn encode_shadow(&self, encoder: &mut wgpu::CommandEncoder, view: ShadowView) {
        let mut pass = self.shadow.begin_pass(encoder, view.side_px);
        pass.set_pipeline(&self.pipelines.shadow);
        pass.set_bind_group(0, &self.frame_group, &[]);
        for body in self.drawn(false) {
            body.draw_shadow(&mut pass);
        }
        if let Some(decoded) = &self.decoded {
            pass.set_pipeline(&decoded.shadow);
            for body in self.drawn(true) {
                body.draw_shadow(&mut pass);
            }
        }
    }

    /// Bodies that are drawn with the pipelines for surfaces in textures, or the others.
    fn drawn(&self, from_textures: bool) -> impl Iterator<Item = &Body> {
        let bodies = self.bodies.values().filter(|body| body.is_drawn());
        bodies.filter(move |body| body.textures().is_some() == from_textures)
    }

    fn encode_picture(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView) {
        let mut pass = self.targets.begin_pass(encoder, picture);
        pass.set_bind_group(0, &self.scene_group, &[]);
        // Bodies first: the floor and the backdrop are then shaded only where they are seen.
        pass.set_pipeline(&self.pipelines.body);
        for body in self.drawn(false) {
            body.draw(&mut pass);
        }
        if let Some(decoded) = &self.decoded {
            pass.set_pipeline(&decoded.body);
            for body in self.drawn(true) {
                body.draw(&mut pass);
            }
        }
        pass.set_pipeline(&self.pipelines.floor);
        pass.draw(0..3 * DISC_SEGMENTS, 0..1);
        pass.set_pipeline(&self.pipelines.backdrop);
        pass.draw(0..3, 0..1);
    }
}
