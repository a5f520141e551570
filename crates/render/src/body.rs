//! One body on the GPU.

use std::borrow::Cow;

use dynaskin_skeleton::Skinning;
use glam::Mat4;

use crate::{
    BodyMesh, Gpu, RenderError, SkinningPath, check,
    decoding::{DecodedSurface, Seat},
    gpu_data::{JOINT_COUNT, MaterialUniform, SKIN_WORKGROUP, SkinUniform},
    look::{Look, Looks},
    paint::{Hem, Paint},
    parts::{RestParts, WorldPart},
    pipelines::{DecodedPipelines, Pipelines},
};

/// How far each vertex is from where plain skinning would have it, for the heat map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OffsetSizes<'a> {
    /// Nowhere.
    Zero,
    /// Sizes in metres, `[V]`.
    Sizes(&'a [f32]),
    /// Offset vectors in metres, `[V][3]` flattened; their lengths are taken.
    Vectors(&'a [f32]),
}

/// One skinning dispatch holds at most 65,535 workgroups on every device.
const MAX_VERTICES: usize = 65_535 * SKIN_WORKGROUP as usize;

/// Buffers of one body. Made once; frames only write into them.
#[derive(Debug)]
pub(crate) struct Body {
    vertex_count: usize,
    index_count: u32,
    indices: wgpu::Buffer,
    positions_rest_m: Part,
    normals_rest: Part,
    offset_sizes_m: Part,
    colors: wgpu::Buffer,
    /// Cut with the first surface: how far apart vertices are is not known before.
    hem: Option<Hem>,
    material: wgpu::Buffer,
    look: Look,
    looks: Looks,
    joints: wgpu::Buffer,
    weights: wgpu::Buffer,
    matrices: wgpu::Buffer,
    /// What the drawing stages bind: material and, where the vertex stage skins, the matrices.
    draw_group: wgpu::BindGroup,
    /// None where the vertex stage skins.
    skinned: Option<Skinned>,
    /// As the host set them, before the placement.
    world_from_rest: [Mat4; JOINT_COUNT],
    /// Where the host's world lies in the picture's.
    placement: Mat4,
    /// The matrices that are drawn with: placement times `world_from_rest`.
    placed: [Mat4; JOINT_COUNT],
    skinning: Skinning,
    parts: RestParts,
    /// Of the surface without offsets, where the card decodes.
    still_parts: RestParts,
    /// Lengths of offset vectors, kept to spare an allocation per frame.
    sizes_scratch_m: Vec<f32>,
    /// Where the card decodes it; none for bodies that the host decodes.
    seat: Option<Seat>,
    /// What a body is drawn with whose surface is in textures.
    decoded_group: Option<wgpu::BindGroup>,
    /// Whether the surface is the decoded one, not one that the host uploaded.
    is_decoded: bool,
    pub visible: bool,
    /// Whether surface or matrices changed after the last skinning pass.
    stale: bool,
    /// Whether a surface was ever set: before, there is nothing to draw.
    has_surface: bool,
}

/// A body's part of a buffer, which may have others' as well.
#[derive(Clone, Debug)]
struct Part {
    buffer: wgpu::Buffer,
    /// In bytes.
    first: u64,
    length: u64,
}

impl Part {
    fn whole(buffer: wgpu::Buffer) -> Self {
        Self {
            first: 0,
            length: buffer.size(),
            buffer,
        }
    }

    fn write(&self, queue: &wgpu::Queue, numbers: &[f32]) {
        queue.write_buffer(&self.buffer, self.first, bytemuck::cast_slice(numbers));
    }

    fn slice(&self) -> wgpu::BufferSlice<'_> {
        self.buffer.slice(self.first..self.first + self.length)
    }

    fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: self.first,
            size: wgpu::BufferSize::new(self.length),
        })
    }
}

/// What the skinning pass writes.
#[derive(Debug)]
struct Skinned {
    positions: wgpu::Buffer,
    normals: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl Body {
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, mesh: &BodyMesh<'_>) -> Result<Self, RenderError> {
        use wgpu::BufferUsages as Usage;
        mesh.validate()?;
        let vertex_count = mesh.vertex_count();
        let index_count = u32::try_from(mesh.faces.len()).map_err(|_| RenderError::TooLarge {
            what: "faces",
            needed_bytes: mesh.faces.len() as u64 * 4,
            limit_bytes: u64::from(u32::MAX) * 4,
        })?;
        if vertex_count > MAX_VERTICES {
            return Err(RenderError::TooLarge {
                what: "rest positions",
                needed_bytes: vertex_count as u64 * 12,
                limit_bytes: MAX_VERTICES as u64 * 12,
            });
        }
        let buffer = |what, bytes: usize, usage| {
            gpu.check_buffer_size(what, bytes as u64)?;
            Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size: bytes as u64,
                usage: usage | Usage::COPY_DST,
                mapped_at_creation: false,
            }))
        };
        let compute = gpu.skinning() == SkinningPath::Compute;
        // WebGL2 knows no storage buffers.
        let read = if compute {
            Usage::VERTEX | Usage::STORAGE
        } else {
            Usage::VERTEX
        };
        let indices = buffer("faces", mesh.faces.len() * 4, Usage::INDEX)?;
        let positions_rest_m = Part::whole(buffer("rest positions", vertex_count * 12, read)?);
        let normals_rest = Part::whole(buffer("rest normals", vertex_count * 12, read)?);
        let offset_sizes_m = Part::whole(buffer("offset sizes", vertex_count * 4, Usage::VERTEX)?);
        let colors = buffer("colors", vertex_count * 4, Usage::VERTEX)?;
        let joints = buffer("skin joints", vertex_count * 4, read)?;
        let weights = buffer("skin weights", vertex_count * 16, read)?;
        let matrices = buffer("skin matrices", size_of::<SkinUniform>(), Usage::UNIFORM)?;
        let material = buffer("material", size_of::<MaterialUniform>(), Usage::UNIFORM)?;
        let (skinned, draw_group) = match &pipelines.skin {
            Some(skin) => {
                let positions = buffer(
                    "skinned positions",
                    vertex_count * 12,
                    read | Usage::COPY_SRC,
                )?;
                let normals = buffer("skinned normals", vertex_count * 12, read)?;
                let bound = [
                    (0, matrices.as_entire_binding()),
                    (1, positions_rest_m.binding()),
                    (2, normals_rest.binding()),
                    (3, joints.as_entire_binding()),
                    (4, weights.as_entire_binding()),
                    (5, positions.as_entire_binding()),
                    (6, normals.as_entire_binding()),
                ];
                let pass_group = bind_group(gpu, "skinning pass", &skin.layout, &bound);
                let bound = [(7, material.as_entire_binding())];
                let draw_group = bind_group(gpu, "body", &pipelines.draw_layout, &bound);
                (
                    Some(Skinned {
                        positions,
                        normals,
                        group: pass_group,
                    }),
                    draw_group,
                )
            }
            None => {
                let bound = [
                    (0, matrices.as_entire_binding()),
                    (7, material.as_entire_binding()),
                ];
                (
                    None,
                    bind_group(gpu, "body", &pipelines.draw_layout, &bound),
                )
            }
        };

        let paint = Paint::new(mesh);
        let looks = Looks::new(mesh, &paint);
        gpu.queue
            .write_buffer(&material, 0, bytemuck::bytes_of(&paint.material));
        gpu.queue
            .write_buffer(&indices, 0, bytemuck::cast_slice(mesh.faces));
        gpu.queue.write_buffer(&colors, 0, &paint.colors);
        gpu.queue.write_buffer(&joints, 0, mesh.skin_joints);
        gpu.queue
            .write_buffer(&weights, 0, bytemuck::cast_slice(mesh.skin_weights));
        let mut body = Self {
            vertex_count,
            index_count,
            indices,
            positions_rest_m,
            normals_rest,
            offset_sizes_m,
            colors,
            hem: paint.hem,
            material,
            look: Look::default(),
            looks,
            joints,
            weights,
            matrices,
            draw_group,
            skinned,
            world_from_rest: [Mat4::IDENTITY; JOINT_COUNT],
            placement: Mat4::IDENTITY,
            placed: [Mat4::IDENTITY; JOINT_COUNT],
            skinning: Skinning::default(),
            parts: RestParts::new(mesh.dominant_joints()),
            still_parts: RestParts::new(mesh.dominant_joints()),
            sizes_scratch_m: vec![0.0; vertex_count],
            seat: None,
            decoded_group: None,
            is_decoded: false,
            visible: true,
            stale: true,
            has_surface: false,
        };
        body.set_skin_matrices(&gpu.queue, &[Mat4::IDENTITY; JOINT_COUNT])?;
        Ok(body)
    }

    /// Uploads one frame's rest-pose surface.
    pub fn set_surface(
        &mut self,
        queue: &wgpu::Queue,
        positions_rest_m: &[f32],
        normals_rest: &[f32],
        offsets: OffsetSizes<'_>,
    ) -> Result<(), RenderError> {
        check::floats("positions_rest_m", positions_rest_m, self.vertex_count * 3)?;
        check::floats("normals_rest", normals_rest, self.vertex_count * 3)?;
        let sizes_m = match offsets {
            OffsetSizes::Zero => {
                self.sizes_scratch_m.fill(0.0);
                &self.sizes_scratch_m
            }
            OffsetSizes::Sizes(sizes_m) => {
                check::floats("offset sizes", sizes_m, self.vertex_count)?;
                sizes_m
            }
            OffsetSizes::Vectors(offsets_m) => {
                check::floats("offsets", offsets_m, self.vertex_count * 3)?;
                let vectors = offsets_m.as_chunks::<3>().0;
                for (size, [x, y, z]) in self.sizes_scratch_m.iter_mut().zip(vectors) {
                    *size = (x * x + y * y + z * z).sqrt();
                }
                &self.sizes_scratch_m
            }
        };
        let drawn = self.looks.drape(self.look).map(|drape| {
            let mut drawn = (positions_rest_m.to_vec(), normals_rest.to_vec());
            drape.apply(&mut drawn.0, &mut drawn.1);
            drawn
        });
        let (positions_drawn_m, normals_drawn) = match &drawn {
            Some((positions_m, normals)) => (positions_m.as_slice(), normals.as_slice()),
            None => (positions_rest_m, normals_rest),
        };
        self.positions_rest_m.write(queue, positions_drawn_m);
        self.normals_rest.write(queue, normals_drawn);
        self.offset_sizes_m.write(queue, sizes_m);
        self.is_decoded = false;
        if let Some(hem) = self.hem.take() {
            let still_m = without_offsets(positions_rest_m, offsets);
            queue.write_buffer(&self.colors, 0, &hem.cut(&still_m));
        }
        self.parts.update(positions_rest_m);
        self.stale = true;
        self.has_surface = true;
        Ok(())
    }

    /// Where the card decodes it, if it does.
    pub fn seat(&self) -> Option<Seat> {
        self.seat
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Whether the look needs the surface on the CPU.
    pub fn is_draped(&self) -> bool {
        self.looks.drape(self.look).is_some()
    }

    /// Whether the surface is one that the card decodes.
    pub fn is_decoded(&self) -> bool {
        self.is_decoded
    }

    /// Gets ready to be drawn from where the card decodes.
    pub fn sit(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        decoded: Option<&DecodedPipelines>,
        seat: Seat,
        surface: &DecodedSurface<'_>,
    ) {
        self.seat = Some(seat);
        self.is_decoded = false;
        match surface {
            DecodedSurface::Buffers(buffers, first) => {
                let count = self.vertex_count as u64;
                let part = |buffer: &wgpu::Buffer, bytes: u64| Part {
                    buffer: buffer.clone(),
                    first: bytes * first,
                    length: bytes * count,
                };
                self.positions_rest_m = part(&buffers.positions, 12);
                self.normals_rest = part(&buffers.normals, 12);
                self.offset_sizes_m = part(&buffers.sizes, 4);
                if let (Some(skin), Some(skinned)) = (&pipelines.skin, &mut self.skinned) {
                    let bound = [
                        (0, self.matrices.as_entire_binding()),
                        (1, self.positions_rest_m.binding()),
                        (2, self.normals_rest.binding()),
                        (3, self.joints.as_entire_binding()),
                        (4, self.weights.as_entire_binding()),
                        (5, skinned.positions.as_entire_binding()),
                        (6, skinned.normals.as_entire_binding()),
                    ];
                    skinned.group = bind_group(gpu, "skinning pass", &skin.layout, &bound);
                }
                // What the buffers held stays behind.
                self.has_surface = false;
            }
            DecodedSurface::Textures(positions, normals, place) => {
                let Some(decoded) = decoded else {
                    return;
                };
                let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("decoded place"),
                    size: size_of_val(place) as u64,
                    usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                });
                gpu.queue
                    .write_buffer(&uniform, 0, bytemuck::bytes_of(place));
                let [positions, normals] =
                    [positions, normals].map(|texture| texture.create_view(&Default::default()));
                let bound = [
                    (0, self.matrices.as_entire_binding()),
                    (7, self.material.as_entire_binding()),
                    (8, wgpu::BindingResource::TextureView(&positions)),
                    (9, wgpu::BindingResource::TextureView(&normals)),
                    (10, uniform.as_entire_binding()),
                ];
                let group = bind_group(gpu, "decoded body", &decoded.draw_layout, &bound);
                self.decoded_group = Some(group);
            }
        }
    }

    /// Takes note of the surface without offsets, where the card decodes.
    pub fn take_still(&mut self, queue: &wgpu::Queue, positions_m: &[f32]) {
        if let Some(hem) = self.hem.take() {
            queue.write_buffer(&self.colors, 0, &hem.cut(positions_m));
        }
        // Its boxes are a few centimetres off where tissue swings, which shadows do not show.
        self.still_parts.update(positions_m);
        self.stale = true;
    }

    /// The card's surface is the one to be drawn, and it changed.
    pub fn show_decoded(&mut self) {
        self.is_decoded = true;
        self.has_surface = true;
        self.stale = true;
    }

    /// Shows the body in another look: its colours at once, its surface with the next that it gets.
    pub fn set_look(&mut self, queue: &wgpu::Queue, look: Look) {
        self.look = look;
        let material = self.looks.material(look);
        queue.write_buffer(&self.material, 0, bytemuck::bytes_of(&material));
    }

    /// Uploads one frame's pose: per joint, rest pose to world.
    pub fn set_skin_matrices(
        &mut self,
        queue: &wgpu::Queue,
        world_from_rest: &[Mat4; JOINT_COUNT],
    ) -> Result<(), RenderError> {
        let columns = world_from_rest.map(|matrix| matrix.to_cols_array());
        check::finite("skin matrices", columns.as_flattened())?;
        self.world_from_rest = *world_from_rest;
        self.place(queue);
        Ok(())
    }

    /// Stands the body elsewhere: everything its pose says happens in `world_from_host` then.
    pub fn set_placement(
        &mut self,
        queue: &wgpu::Queue,
        world_from_host: Mat4,
    ) -> Result<(), RenderError> {
        check::finite("the placement", &world_from_host.to_cols_array())?;
        self.placement = world_from_host;
        self.place(queue);
        Ok(())
    }

    /// Blends the joints' motions in another way from now on.
    pub fn set_skinning(&mut self, queue: &wgpu::Queue, skinning: Skinning) {
        if self.skinning != skinning {
            self.skinning = skinning;
            self.place(queue);
        }
    }

    fn place(&mut self, queue: &wgpu::Queue) {
        self.placed = self.world_from_rest.map(|matrix| self.placement * matrix);
        let joints = SkinUniform::new(&self.placed, self.skinning);
        queue.write_buffer(&self.matrices, 0, bytemuck::bytes_of(&joints));
        self.stale = true;
    }

    /// Whether the next picture shows the body.
    pub fn is_drawn(&self) -> bool {
        self.visible && self.has_surface
    }

    /// Boxes around the body's parts in the world.
    pub fn world_parts(&self) -> impl Iterator<Item = WorldPart> + '_ {
        let parts = if self.is_decoded {
            &self.still_parts
        } else {
            &self.parts
        };
        parts.in_world(&self.placed)
    }

    /// Skins in a pass that has the frame bound, unless nothing changed.
    pub fn skin(&mut self, pass: &mut wgpu::ComputePass<'_>) {
        if let Some(skinned) = &self.skinned
            && std::mem::take(&mut self.stale)
        {
            pass.set_bind_group(1, &skinned.group, &[]);
            pass.dispatch_workgroups((self.vertex_count as u32).div_ceil(SKIN_WORKGROUP), 1, 1);
        }
    }

    /// Skinned positions, `[V][3]` floats; none where the vertex stage skins.
    pub fn skinned_positions(&self) -> Option<&wgpu::Buffer> {
        self.skinned.as_ref().map(|skinned| &skinned.positions)
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let [joints, weights, colors] =
            [&self.joints, &self.weights, &self.colors].map(|b| b.slice(..));
        if let Some(group) = self.textures() {
            pass.set_bind_group(1, group, &[]);
            return self.draw_with(pass, &[joints, weights, colors]);
        }
        pass.set_bind_group(1, &self.draw_group, &[]);
        let rest = self.positions_rest_m.slice();
        let sizes = self.offset_sizes_m.slice();
        match &self.skinned {
            Some(Skinned {
                positions, normals, ..
            }) => {
                let [positions, normals] = [positions, normals].map(|b| b.slice(..));
                self.draw_with(pass, &[positions, normals, rest, sizes, colors]);
            }
            None => {
                let normals = self.normals_rest.slice();
                self.draw_with(pass, &[rest, normals, joints, weights, sizes, colors]);
            }
        }
    }

    /// What the body is drawn with where the vertex stage reads its surface from textures, which takes other
    /// pipelines.
    pub fn textures(&self) -> Option<&wgpu::BindGroup> {
        self.decoded_group.as_ref().filter(|_| self.is_decoded)
    }

    pub fn draw_shadow(&self, pass: &mut wgpu::RenderPass<'_>) {
        let [joints, weights] = [&self.joints, &self.weights].map(|b| b.slice(..));
        match (&self.skinned, self.textures()) {
            (Some(skinned), _) => self.draw_with(pass, &[skinned.positions.slice(..)]),
            (None, Some(group)) => {
                pass.set_bind_group(1, group, &[]);
                self.draw_with(pass, &[joints, weights]);
            }
            (None, None) => {
                pass.set_bind_group(1, &self.draw_group, &[]);
                self.draw_with(pass, &[self.positions_rest_m.slice(), joints, weights]);
            }
        }
    }

    /// Draws from buffers in the pipeline's order of slots.
    fn draw_with(&self, pass: &mut wgpu::RenderPass<'_>, buffers: &[wgpu::BufferSlice<'_>]) {
        for (slot, buffer) in (0..).zip(buffers) {
            pass.set_vertex_buffer(slot, *buffer);
        }
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

/// The surface as it would be at rest, where the offsets say so: clothes are cut the same then
/// whenever a body appears.
fn without_offsets<'a>(positions_m: &'a [f32], offsets: OffsetSizes<'_>) -> Cow<'a, [f32]> {
    match offsets {
        OffsetSizes::Vectors(offsets_m) => {
            let pairs = positions_m.iter().zip(offsets_m);
            pairs.map(|(position, offset)| position - offset).collect()
        }
        OffsetSizes::Zero | OffsetSizes::Sizes(_) => positions_m.into(),
    }
}

/// A bind group of resources at the given bindings.
fn bind_group(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[(u32, wgpu::BindingResource<'_>)],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: resource.clone(),
        })
        .collect();
    let descriptor = wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    };
    gpu.device.create_bind_group(&descriptor)
}
