//! One body on the GPU.

use std::sync::Arc;

use glam::Mat4;

use crate::{
    BodyMesh, Gpu, RenderError, SkinningPath, check,
    gpu_data::{JOINT_COUNT, SKIN_WORKGROUP, SkinUniform},
    parts::{RestParts, WorldPart},
    pipelines::Pipelines,
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
    positions_rest_m: wgpu::Buffer,
    normals_rest: wgpu::Buffer,
    offset_sizes_m: wgpu::Buffer,
    colors: wgpu::Buffer,
    joints: wgpu::Buffer,
    weights: wgpu::Buffer,
    matrices: wgpu::Buffer,
    skin_group: wgpu::BindGroup,
    /// Skinned positions and normals; none where the vertex stage skins.
    skinned: Option<(Arc<wgpu::Buffer>, wgpu::Buffer)>,
    world_from_rest: [Mat4; JOINT_COUNT],
    parts: RestParts,
    /// Lengths of offset vectors, kept to spare an allocation per frame.
    sizes_scratch_m: Vec<f32>,
    pub visible: bool,
    /// Whether surface or matrices changed after the last skinning pass.
    stale: bool,
    /// Whether a surface was ever set: before, there is nothing to draw.
    has_surface: bool,
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
        let positions_rest_m = buffer("rest positions", vertex_count * 12, read)?;
        let normals_rest = buffer("rest normals", vertex_count * 12, read)?;
        let offset_sizes_m = buffer("offset sizes", vertex_count * 4, Usage::VERTEX)?;
        let colors = buffer("colors", vertex_count * 4, Usage::VERTEX)?;
        let joints = buffer("skin joints", vertex_count * 4, read)?;
        let weights = buffer("skin weights", vertex_count * 16, read)?;
        let matrices = buffer("skin matrices", size_of::<SkinUniform>(), Usage::UNIFORM)?;
        let skinned = if compute {
            let positions = buffer(
                "skinned positions",
                vertex_count * 12,
                read | Usage::COPY_SRC,
            )?;
            Some((
                Arc::new(positions),
                buffer("skinned normals", vertex_count * 12, read)?,
            ))
        } else {
            None
        };

        let mut bound = vec![&matrices];
        if let Some((positions, normals)) = &skinned {
            bound.extend([
                &positions_rest_m,
                &normals_rest,
                &joints,
                &weights,
                positions,
                normals,
            ]);
        }
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(&bound)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let skin_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("skin"),
            layout: &pipelines.skin_layout,
            entries: &entries,
        });

        gpu.queue
            .write_buffer(&indices, 0, bytemuck::cast_slice(mesh.faces));
        gpu.queue.write_buffer(&colors, 0, &mesh.colors_or_plain());
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
            joints,
            weights,
            matrices,
            skin_group,
            skinned,
            world_from_rest: [Mat4::IDENTITY; JOINT_COUNT],
            parts: RestParts::new(mesh.dominant_joints()),
            sizes_scratch_m: vec![0.0; vertex_count],
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
        queue.write_buffer(
            &self.positions_rest_m,
            0,
            bytemuck::cast_slice(positions_rest_m),
        );
        queue.write_buffer(&self.normals_rest, 0, bytemuck::cast_slice(normals_rest));
        queue.write_buffer(&self.offset_sizes_m, 0, bytemuck::cast_slice(sizes_m));
        self.parts.update(positions_rest_m);
        self.stale = true;
        self.has_surface = true;
        Ok(())
    }

    /// Uploads one frame's pose: per joint, rest pose to world.
    pub fn set_skin_matrices(
        &mut self,
        queue: &wgpu::Queue,
        world_from_rest: &[Mat4; JOINT_COUNT],
    ) -> Result<(), RenderError> {
        let columns: SkinUniform = world_from_rest.map(|matrix| matrix.to_cols_array());
        check::finite("skin matrices", columns.as_flattened())?;
        queue.write_buffer(&self.matrices, 0, bytemuck::cast_slice(&columns));
        self.world_from_rest = *world_from_rest;
        self.stale = true;
        Ok(())
    }

    /// Whether the next picture shows the body.
    pub fn is_drawn(&self) -> bool {
        self.visible && self.has_surface
    }

    /// Boxes around the body's parts in the world.
    pub fn world_parts(&self) -> impl Iterator<Item = WorldPart> + '_ {
        self.parts.in_world(&self.world_from_rest)
    }

    /// Skins in a pass that has the frame bound, unless nothing changed.
    pub fn skin(&mut self, pass: &mut wgpu::ComputePass<'_>, pipeline: &wgpu::ComputePipeline) {
        if std::mem::take(&mut self.stale) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &self.skin_group, &[]);
            pass.dispatch_workgroups((self.vertex_count as u32).div_ceil(SKIN_WORKGROUP), 1, 1);
        }
    }

    /// Skinned positions, `[V][3]` floats; none where the vertex stage skins.
    pub fn skinned_positions(&self) -> Option<&Arc<wgpu::Buffer>> {
        self.skinned.as_ref().map(|(positions, _)| positions)
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        match &self.skinned {
            Some((positions, normals)) => self.draw_with(
                pass,
                &[
                    positions,
                    normals,
                    &self.positions_rest_m,
                    &self.offset_sizes_m,
                    &self.colors,
                ],
            ),
            None => self.draw_with(
                pass,
                &[
                    &self.positions_rest_m,
                    &self.normals_rest,
                    &self.joints,
                    &self.weights,
                    &self.offset_sizes_m,
                    &self.colors,
                ],
            ),
        }
    }

    pub fn draw_shadow(&self, pass: &mut wgpu::RenderPass<'_>) {
        match &self.skinned {
            Some((positions, _)) => self.draw_with(pass, &[positions]),
            None => self.draw_with(pass, &[&self.positions_rest_m, &self.joints, &self.weights]),
        }
    }

    /// Draws from buffers in the pipeline's order of slots.
    fn draw_with(&self, pass: &mut wgpu::RenderPass<'_>, buffers: &[&wgpu::Buffer]) {
        if self.skinned.is_none() {
            pass.set_bind_group(1, &self.skin_group, &[]);
        }
        for (slot, buffer) in (0..).zip(buffers) {
            pass.set_vertex_buffer(slot, buffer.slice(..));
        }
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}
