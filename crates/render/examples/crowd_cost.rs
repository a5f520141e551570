//! What a crowd costs the thread that steps and draws it, decoded by the CPU and by the graphics card.
//!
//! `cargo run --release -p dynaskin-render --example crowd_cost -- models/female 100`
//!
//! Linux only: it reads the thread's own time, so that other programs and a graphics card in software do not
//! count.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_render::{
    BodyId, BodyMesh, DecoderMatrix, Gpu, OffsetSizes, PixelSize, Renderer, SkinningPath, wgpu,
};
use dynaskin_runtime::{Avatar, Crowd, Decoding, Model};
use glam::Vec3;

const WARM_UP_TICKS: usize = 20;
const TICKS: usize = 300;

/// Milliseconds a tick.
#[derive(Clone, Copy, Default)]
struct Cost {
    step: f64,
    update: f64,
    draw: f64,
}

/// One crowd in a renderer of its own.
struct Stage {
    renderer: Renderer,
    crowd: Crowd,
    avatars: Vec<(Avatar, BodyId)>,
    decoding: Decoding,
    cost: Cost,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, number] = arguments.as_slice() else {
        return Err("give a model's folder and the number of avatars".into());
    };
    let folder = Path::new(folder);
    let mut read = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let bundle = read("bundle.json")?;
    let model = Arc::new(Model::load(&bundle, &mut read)?);
    let number: usize = number.parse()?;
    for skinning in [SkinningPath::Compute, SkinningPath::VertexStage] {
        let both = [Decoding::InStep, Decoding::OnDemand];
        let mut stages = Vec::new();
        for decoding in both {
            stages.push(Stage::new(&model, number, skinning, decoding)?);
        }
        let kinds = [ProceduralKind::Hop, ProceduralKind::RunInPlace];
        let joints_rest_m = stages[0].avatars[0].0.joints_rest_m();
        let clips = kinds.map(|kind| Procedural::new(kind).clip(joints_rest_m));
        let clips: Vec<Clip> = clips.into_iter().collect::<Result<_, _>>()?;
        for tick in 0..WARM_UP_TICKS + TICKS {
            for stage in &mut stages {
                stage.tick(&clips, tick)?;
            }
        }
        println!("{skinning:?}, {}", stages[0].renderer.gpu().info().name);
        for stage in &stages {
            let Cost { step, update, draw } = stage.cost;
            let all = step + update + draw;
            println!(
                "  {number} avatars, decoding {:?}: steps {step:.2} ms, updates {update:.2} ms, \
                 drawing calls {draw:.2} ms, together {all:.2} ms of the thread's time a tick",
                stage.decoding
            );
        }
    }
    Ok(())
}

impl Stage {
    fn new(
        model: &Arc<Model>,
        number: usize,
        skinning: SkinningPath,
        decoding: Decoding,
    ) -> Result<Self, Box<dyn Error>> {
        let instance = wgpu::Instance::default();
        let gpu = pollster::block_on(Gpu::new(&instance, None, Some(skinning)))?;
        // Small: a graphics card in software takes the processor away.
        let size = PixelSize {
            width: 32,
            height: 32,
        };
        let mut renderer = pollster::block_on(Renderer::offscreen(gpu, size))?;
        let body = model.body();
        let joints: Vec<u8> = body.skin.iter().flat_map(|skin| skin.joints).collect();
        let weights: Vec<f32> = body.skin.iter().flat_map(|skin| skin.weights).collect();
        let mesh = BodyMesh {
            faces: body.faces.as_flattened(),
            skin_joints: &joints,
            skin_weights: &weights,
            colors_srgba: &[],
        };
        let matrix = model.linear_decoder().ok_or("the decoder is no matrix")?;
        let decoder = renderer.add_decoder(&DecoderMatrix {
            vertex_count: body.vertex_count(),
            faces: body.faces.as_flattened(),
            soft_vertices: model.soft_vertices(),
            starts: matrix.starts(),
            latents: matrix.latents(),
            weights_m: matrix.weights().as_flattened(),
            latent_count: matrix.latent_count(),
        })?;
        let mut avatars = Vec::new();
        for index in 0..number {
            let mut shape = [0.0; 10];
            shape[1] = (index % 5) as f32 - 2.0;
            let mut avatar = Avatar::new(Arc::clone(model), &shape)?;
            avatar.set_decoding(decoding);
            let id = renderer.add_body(&mesh)?;
            if decoding == Decoding::OnDemand {
                let still_m: Vec<f32> = flat(avatar.still_positions_rest_m()).to_vec();
                let (gains, limits_m) = (avatar.vertex_gains(), avatar.vertex_limits_m());
                renderer.decode_body(id, decoder, &still_m, gains, limits_m)?;
            }
            avatars.push((avatar, id));
        }
        Ok(Self {
            renderer,
            crowd: Crowd::new(Arc::clone(model))?,
            avatars,
            decoding,
            cost: Cost::default(),
        })
    }

    fn tick(&mut self, clips: &[Clip], tick: usize) -> Result<(), Box<dyn Error>> {
        let pose = |index: usize| {
            let clip = &clips[index % clips.len()];
            clip.pose_at((tick as f64 / 60.0 + 0.37 * index as f64) % clip.duration_seconds())
        };
        let poses: Vec<_> = (0..self.avatars.len()).map(pose).collect();
        let start = thread_ms()?;
        let mut all: Vec<&mut Avatar> = self.avatars.iter_mut().map(|(avatar, _)| avatar).collect();
        self.crowd
            .step_all(&mut all, &poses, 1.0 / 60.0, &mut || 0.0)?;
        let stepped = thread_ms()?;
        for (avatar, id) in &self.avatars {
            match avatar.undecoded_latents() {
                Some(latents) => self.renderer.set_latents(*id, latents)?,
                None => self.renderer.set_surface(
                    *id,
                    flat(avatar.positions_rest_m()),
                    flat(avatar.normals_rest()),
                    OffsetSizes::Vectors(flat(avatar.offsets_rest_m())),
                )?,
            }
            self.renderer
                .set_skin_matrices(*id, avatar.skin_matrices())?;
        }
        let updated = thread_ms()?;
        self.renderer.render()?;
        let drawn = thread_ms()?;
        // So that neither crowd waits for the other's pictures.
        let device = self.renderer.gpu().device();
        device.poll(wgpu::PollType::wait_indefinitely())?;
        if tick >= WARM_UP_TICKS {
            let share = 1.0 / TICKS as f64;
            self.cost.step += share * (stepped - start);
            self.cost.update += share * (updated - stepped);
            self.cost.draw += share * (drawn - updated);
        }
        Ok(())
    }
}

fn flat(vectors: &[Vec3]) -> &[f32] {
    bytemuck::cast_slice(vectors)
}

/// Time that this thread has had on a processor, in milliseconds.
fn thread_ms() -> Result<f64, Box<dyn Error>> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds = text.split_whitespace().next().ok_or("no time")?;
    Ok(1e-6 * nanoseconds.parse::<f64>()?)
}
