//! Decoding on the card: bodies of one decoder in pools, each of which is decoded by two passes whatever the
//! number of its bodies.

use dynaskin_decoding::{BodyTexels, DecoderMatrix, MAX_SLOTS, WIDTH};

use crate::{
    Gpu, RenderError, Shader, SkinningPath, check,
    decoder::{CardTables, texture, write_rows},
    gpu_data::{BatchUniform, DecodedPlace, SKIN_WORKGROUP},
    pipelines::{bind_group_layout, pipeline_layout, uniform},
};

/// Names a decoder of one renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DecoderId(usize);

impl DecoderId {
    /// The id as a number, for bindings to other languages.
    pub const fn index(self) -> u32 {
        self.0 as u32
    }

    /// The id with this number; calls refuse numbers that no decoder has.
    pub const fn from_index(index: u32) -> Self {
        Self(index as usize)
    }
}

/// A body's place among those of its decoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Seat {
    pub decoder: DecoderId,
    pool: usize,
    slot: usize,
}

/// All decoders of one renderer.
#[derive(Debug)]
pub(crate) struct Decoding {
    passes: Passes,
    decoders: Vec<Decoder>,
}

#[derive(Debug)]
struct Decoder {
    tables: CardTables,
    vertex_count: usize,
    soft_vertices: Vec<u32>,
    latent_count: usize,
    pools: Vec<Pool>,
}

/// Room for some bodies of one decoder.
#[derive(Debug)]
struct Pool {
    /// By slot.
    taken: Vec<bool>,
    /// By slot: whether it has to be decoded.
    dirty: Vec<bool>,
    /// By slot, latents as the texture has them.
    numbers: Vec<f32>,
    /// What every batch is told; the slots are filled in.
    batch: BatchUniform,
    batch_buffer: wgpu::Buffer,
    latents: wgpu::Texture,
    still_positions: wgpu::Texture,
    controls: wgpu::Texture,
    group: wgpu::BindGroup,
    output: Output,
}

/// Where a pool's bodies are decoded to.
#[derive(Debug)]
enum Output {
    Buffers(DecodedBuffers),
    Textures {
        positions: wgpu::Texture,
        normals: wgpu::Texture,
        /// The positions, as the pass for normals reads them.
        group: wgpu::BindGroup,
    },
}

/// Numbers of several bodies, one after the other.
#[derive(Clone, Debug)]
pub(crate) struct DecodedBuffers {
    pub positions: wgpu::Buffer,
    pub normals: wgpu::Buffer,
    pub sizes: wgpu::Buffer,
}

/// Where a seat's surface is drawn from.
pub(crate) enum DecodedSurface<'a> {
    /// From these buffers, beginning at this vertex.
    Buffers(&'a DecodedBuffers, u64),
    /// From positions and normals in textures.
    Textures(&'a wgpu::Texture, &'a wgpu::Texture, DecodedPlace),
}

/// Pipelines and layouts.
#[derive(Debug)]
struct Passes {
    layout: wgpu::BindGroupLayout,
    kind: PassKind,
}

#[derive(Debug)]
enum PassKind {
    Compute {
        positions: wgpu::ComputePipeline,
        normals: wgpu::ComputePipeline,
    },
    Fragment {
        /// The positions that normals are made from.
        positions_layout: wgpu::BindGroupLayout,
        positions: wgpu::RenderPipeline,
        normals: wgpu::RenderPipeline,
    },
}

const DECODED_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

impl Decoding {
    /// # Errors
    ///
    /// [`RenderError::DecodingUnsupported`].
    pub fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        let compute = gpu.skinning() == SkinningPath::Compute;
        let features = gpu.adapter.get_texture_format_features(DECODED_FORMAT);
        let renders = features
            .allowed_usages
            .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
        if !compute && !renders {
            return Err(RenderError::DecodingUnsupported);
        }
        Ok(Self {
            passes: Passes::new(&gpu.device, compute),
            decoders: Vec::new(),
        })
    }

    pub fn add(&mut self, gpu: &Gpu, matrix: &DecoderMatrix<'_>) -> Result<DecoderId, RenderError> {
        self.decoders.push(Decoder {
            tables: CardTables::new(gpu, matrix)?,
            vertex_count: matrix.vertex_count,
            soft_vertices: matrix.soft_vertices.to_vec(),
            latent_count: matrix.latent_count,
            pools: Vec::new(),
        });
        Ok(DecoderId(self.decoders.len() - 1))
    }

    /// A free seat of a decoder for a body of `vertex_count` vertices.
    ///
    /// # Errors
    ///
    /// [`RenderError::UnknownDecoder`], [`RenderError::WrongLength`] for another number of vertices,
    /// [`RenderError::TooLarge`].
    pub fn seat(
        &mut self,
        gpu: &Gpu,
        id: DecoderId,
        vertex_count: usize,
    ) -> Result<Seat, RenderError> {
        let decoder = self
            .decoders
            .get_mut(id.0)
            .ok_or(RenderError::UnknownDecoder { id: id.index() })?;
        check::length("the body's vertices", vertex_count, decoder.vertex_count)?;
        let free = |pool: &Pool| pool.taken.iter().position(|taken| !taken);
        let mut pools = decoder.pools.iter().enumerate();
        let found = pools.find_map(|(pool, at)| Some((pool, free(at)?)));
        let (pool, slot) = match found {
            Some(found) => found,
            None => {
                let pool = Pool::new(gpu, &self.passes, decoder)?;
                decoder.pools.push(pool);
                (decoder.pools.len() - 1, 0)
            }
        };
        decoder.pools[pool].taken[slot] = true;
        Ok(Seat {
            decoder: id,
            pool,
            slot,
        })
    }

    /// Gives a seat back.
    pub fn free(&mut self, seat: Seat) {
        let pool = self.pool_mut(seat);
        pool.taken[seat.slot] = false;
        pool.dirty[seat.slot] = false;
    }

    pub fn surface(&self, seat: Seat) -> DecodedSurface<'_> {
        let pool = &self.decoders[seat.decoder.0].pools[seat.pool];
        match &pool.output {
            Output::Buffers(buffers) => {
                let first = seat.slot as u64 * u64::from(pool.batch.stride);
                DecodedSurface::Buffers(buffers, first)
            }
            Output::Textures {
                positions, normals, ..
            } => {
                let place = DecodedPlace {
                    first_row: seat.slot as u32 * pool.batch.body_rows,
                    width: WIDTH,
                    padding: [0; 2],
                };
                DecodedSurface::Textures(positions, normals, place)
            }
        }
    }

    /// Uploads a body's surface without offsets, and gains and limits of the soft vertices.
    ///
    /// # Errors
    ///
    /// Wrong lengths, numbers that are not finite; nothing changes.
    pub fn set_body(
        &mut self,
        queue: &wgpu::Queue,
        seat: Seat,
        still_positions_m: &[f32],
        gains: &[f32],
        limits_m: &[f32],
    ) -> Result<(), RenderError> {
        let decoder = &mut self.decoders[seat.decoder.0];
        let numbers = 3 * decoder.vertex_count;
        check::length("still positions", still_positions_m.len(), numbers)?;
        let soft_vertices = &decoder.soft_vertices;
        let body = BodyTexels::new(still_positions_m, soft_vertices, gains, limits_m)
            .map_err(RenderError::refused)?;
        let pool = &mut decoder.pools[seat.pool];
        let first = seat.slot as u32 * pool.batch.body_rows;
        write_rows(
            queue,
            &pool.still_positions,
            first,
            bytemuck::cast_slice(&body.still_positions),
        );
        write_rows(
            queue,
            &pool.controls,
            first,
            bytemuck::cast_slice(&body.controls),
        );
        Ok(())
    }

    /// Has a body decoded with the next pass.
    pub fn touch(&mut self, seat: Seat) {
        self.pool_mut(seat).dirty[seat.slot] = true;
    }

    /// Leaves a body's surface as it is.
    pub fn leave(&mut self, seat: Seat) {
        self.pool_mut(seat).dirty[seat.slot] = false;
    }

    /// Takes over the latents of a body, which the next pass decodes.
    ///
    /// # Errors
    ///
    /// A wrong length, numbers that are not finite; nothing changes.
    pub fn set_latents(&mut self, seat: Seat, latents: &[f32]) -> Result<(), RenderError> {
        let count = self.decoders[seat.decoder.0].latent_count;
        check::floats("latents", latents, count)?;
        let pool = self.pool_mut(seat);
        let row = pool.numbers.len() / pool.taken.len();
        let first = seat.slot * row;
        pool.numbers[first..first + count].copy_from_slice(latents);
        pool.dirty[seat.slot] = true;
        Ok(())
    }

    fn pool_mut(&mut self, seat: Seat) -> &mut Pool {
        &mut self.decoders[seat.decoder.0].pools[seat.pool]
    }

    /// Decodes all bodies that changed.
    pub fn encode(&mut self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder) {
        for pool in self
            .decoders
            .iter_mut()
            .flat_map(|decoder| &mut decoder.pools)
        {
            let count = pool.begin(queue);
            if count > 0 {
                self.passes.encode(pool, count, encoder);
            }
        }
    }

    /// Copies a seat's decoded surface to buffers that can be mapped: positions, and normals; and how many
    /// numbers of each a vertex takes there.
    pub fn copy(
        &self,
        device: &wgpu::Device,
        seat: Seat,
        encoder: &mut wgpu::CommandEncoder,
    ) -> ([wgpu::Buffer; 2], usize) {
        use crate::readback::host_buffer;
        match self.surface(seat) {
            DecodedSurface::Buffers(buffers, first) => {
                let bytes = 12 * self.decoders[seat.decoder.0].vertex_count as u64;
                let copy = |from: &wgpu::Buffer| {
                    let host = host_buffer(device, bytes);
                    encoder.copy_buffer_to_buffer(from, 12 * first, &host, 0, bytes);
                    host
                };
                ([&buffers.positions, &buffers.normals].map(copy), 3)
            }
            DecodedSurface::Textures(positions, normals, place) => {
                let rows = self.decoders[seat.decoder.0].pools[seat.pool]
                    .batch
                    .body_rows;
                let copy = |from: &wgpu::Texture| {
                    let host = host_buffer(device, u64::from(16 * WIDTH * rows));
                    let mut source = from.as_image_copy();
                    source.origin.y = place.first_row;
                    let target = wgpu::TexelCopyBufferInfo {
                        buffer: &host,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(16 * WIDTH),
                            rows_per_image: None,
                        },
                    };
                    let size = wgpu::Extent3d {
                        width: WIDTH,
                        height: rows,
                        depth_or_array_layers: 1,
                    };
                    encoder.copy_texture_to_buffer(source, target, size);
                    host
                };
                ([positions, normals].map(copy), 4)
            }
        }
    }
}

impl Pool {
    /// A further pool of `decoder`: twice as large as the one before, so that few bodies take little memory
    /// and many few passes.
    fn new(gpu: &Gpu, passes: &Passes, decoder: &Decoder) -> Result<Self, RenderError> {
        let vertex_count = decoder.vertex_count as u32;
        let body_rows = vertex_count.div_ceil(WIDTH).max(1);
        let limits = gpu.device.limits();
        let stride = vertex_count.next_multiple_of(64);
        let by_buffer = match passes.kind {
            PassKind::Compute { .. } => {
                limits.max_storage_buffer_binding_size / u64::from(12 * stride)
            }
            PassKind::Fragment { .. } => u64::MAX,
        };
        let by_texture = limits.max_texture_dimension_2d / body_rows;
        let largest = by_buffer
            .min(by_texture.min(MAX_SLOTS as u32).into())
            .max(1) as u32;
        let capacity = (1 << decoder.pools.len().min(6)).min(largest);
        let height = capacity * body_rows;
        let latent_width = (decoder.latent_count as u32).div_ceil(4).max(1);
        use wgpu::TextureFormat as Format;
        let read = wgpu::TextureUsages::empty();
        let make = |what, format, size| texture(gpu, what, format, size, read);
        let positions_size = [WIDTH, height];
        let still_positions = make("still positions", Format::Rgba32Float, positions_size)?;
        let controls = make("controls", Format::Rg32Float, positions_size)?;
        let latents = make("latents", Format::Rgba32Float, [latent_width, capacity])?;
        let output = Output::new(gpu, passes, positions_size, capacity * stride)?;
        let batch_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("batch"),
            size: size_of::<BatchUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let own = [&still_positions, &controls, &latents].map(view);
        let tables = &decoder.tables;
        let views = [&tables.vertices, &tables.weights, &tables.corners];
        let mut entries = vec![entry(0, batch_buffer.as_entire_binding())];
        for (binding, view) in (1..).zip(views.into_iter().chain(&own)) {
            entries.push(entry(binding, wgpu::BindingResource::TextureView(view)));
        }
        if let Output::Buffers(buffers) = &output {
            let written = [&buffers.positions, &buffers.normals, &buffers.sizes];
            for (binding, buffer) in (7..).zip(written) {
                entries.push(entry(binding, buffer.as_entire_binding()));
            }
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("decoding"),
            layout: &passes.layout,
            entries: &entries,
        });
        let slots = capacity as usize;
        Ok(Self {
            taken: vec![false; slots],
            dirty: vec![false; slots],
            numbers: vec![0.0; 4 * latent_width as usize * slots],
            batch: BatchUniform {
                vertex_count,
                body_rows,
                stride,
                height,
                slots: [0; MAX_SLOTS],
            },
            batch_buffer,
            latents,
            still_positions,
            controls,
            group,
            output,
        })
    }

    /// Uploads what the passes need; gives the number of bodies to be decoded.
    fn begin(&mut self, queue: &wgpu::Queue) -> u32 {
        let mut count = 0;
        let mut range: Option<(usize, usize)> = None;
        for (slot, dirty) in self.dirty.iter_mut().enumerate() {
            if std::mem::take(dirty) {
                self.batch.slots[count] = slot as u32;
                count += 1;
                range = Some((range.map_or(slot, |(first, _)| first), slot + 1));
            }
        }
        if let Some((first, end)) = range {
            let row = self.numbers.len() / self.taken.len();
            let numbers = &self.numbers[first * row..end * row];
            write_rows(
                queue,
                &self.latents,
                first as u32,
                bytemuck::cast_slice(numbers),
            );
            queue.write_buffer(&self.batch_buffer, 0, bytemuck::bytes_of(&self.batch));
        }
        count as u32
    }
}

impl Output {
    /// For `vertex_count` vertices of all bodies together, in buffers or in textures of `size`.
    fn new(
        gpu: &Gpu,
        passes: &Passes,
        size: [u32; 2],
        vertex_count: u32,
    ) -> Result<Self, RenderError> {
        match &passes.kind {
            PassKind::Compute { .. } => {
                use wgpu::BufferUsages as Usage;
                let buffer = |what, bytes: u32| {
                    gpu.check_buffer_size(what, u64::from(bytes))?;
                    Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some(what),
                        size: u64::from(bytes),
                        usage: Usage::VERTEX | Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                        mapped_at_creation: false,
                    }))
                };
                Ok(Self::Buffers(DecodedBuffers {
                    positions: buffer("decoded positions", 12 * vertex_count)?,
                    normals: buffer("decoded normals", 12 * vertex_count)?,
                    sizes: buffer("decoded offset sizes", 4 * vertex_count)?,
                }))
            }
            PassKind::Fragment {
                positions_layout, ..
            } => {
                use wgpu::TextureUsages as Usage;
                let usage = Usage::RENDER_ATTACHMENT | Usage::COPY_SRC;
                let make = |what| texture(gpu, what, DECODED_FORMAT, size, usage);
                let positions = make("decoded positions")?;
                let view = positions.create_view(&Default::default());
                let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("decoded positions"),
                    layout: positions_layout,
                    entries: &[entry(0, wgpu::BindingResource::TextureView(&view))],
                });
                Ok(Self::Textures {
                    positions,
                    normals: make("decoded normals")?,
                    group,
                })
            }
        }
    }
}

impl Passes {
    fn new(device: &wgpu::Device, compute: bool) -> Self {
        use wgpu::ShaderStages as Stages;
        let stages = if compute {
            Stages::COMPUTE
        } else {
            Stages::VERTEX_FRAGMENT
        };
        let reads = if compute {
            Stages::COMPUTE
        } else {
            Stages::FRAGMENT
        };
        let mut entries = vec![uniform::<BatchUniform>(0, stages)];
        let uints = [1, 3];
        entries.extend((1..7).map(|binding| {
            let sample_type = if uints.contains(&binding) {
                wgpu::TextureSampleType::Uint
            } else {
                FLOATS
            };
            texture_entry(binding, reads, sample_type)
        }));
        if compute {
            entries.extend((7..10).map(|binding| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: reads,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }));
        }
        let layout = bind_group_layout(device, "decoding", &entries);
        let kind = if compute {
            compute_passes(device, &layout)
        } else {
            fragment_passes(device, &layout)
        };
        Self { layout, kind }
    }

    fn encode(&self, pool: &Pool, count: u32, encoder: &mut wgpu::CommandEncoder) {
        match (&self.kind, &pool.output) {
            (PassKind::Compute { positions, normals }, _) => {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_bind_group(0, &pool.group, &[]);
                let groups = pool.batch.vertex_count.div_ceil(SKIN_WORKGROUP);
                for pipeline in [positions, normals] {
                    pass.set_pipeline(pipeline);
                    pass.dispatch_workgroups(groups, count, 1);
                }
            }
            (
                PassKind::Fragment {
                    positions, normals, ..
                },
                Output::Textures {
                    positions: positions_texture,
                    normals: normals_texture,
                    group,
                },
            ) => {
                let mut pass = begin_pass(encoder, positions_texture);
                pass.set_pipeline(positions);
                pass.set_bind_group(0, &pool.group, &[]);
                pass.draw(0..6, 0..count);
                drop(pass);
                let mut pass = begin_pass(encoder, normals_texture);
                pass.set_pipeline(normals);
                pass.set_bind_group(0, &pool.group, &[]);
                pass.set_bind_group(1, group, &[]);
                pass.draw(0..6, 0..count);
            }
            // A fragment pass writes to textures.
            (PassKind::Fragment { .. }, Output::Buffers(_)) => {}
        }
    }
}

fn compute_passes(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> PassKind {
    let module = Shader::DECODE_COMPUTE.module(device);
    let pipeline = |entry_point| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&pipeline_layout(device, layout, None)),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        })
    };
    PassKind::Compute {
        positions: pipeline("decode_positions"),
        normals: pipeline("decode_normals"),
    }
}

fn fragment_passes(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> PassKind {
    let module = Shader::DECODE_FRAGMENT.module(device);
    let read = texture_entry(0, wgpu::ShaderStages::FRAGMENT, FLOATS);
    let positions_layout = bind_group_layout(device, "decoded positions", &[read]);
    let pipeline = |entry_point, second| {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&pipeline_layout(device, layout, second)),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_slot"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                targets: &[Some(DECODED_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    };
    PassKind::Fragment {
        positions: pipeline("fs_positions", None),
        normals: pipeline("fs_normals", Some(&positions_layout)),
        positions_layout,
    }
}

/// A pass that writes some bodies' rows and keeps the others'.
fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    target: &wgpu::Texture,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("decode"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Load,
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    })
}

/// Floats that no sampler filters.
pub(crate) const FLOATS: wgpu::TextureSampleType =
    wgpu::TextureSampleType::Float { filterable: false };

pub(crate) fn texture_entry(
    binding: u32,
    visibility: wgpu::ShaderStages,
    sample_type: wgpu::TextureSampleType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

pub(crate) fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}
