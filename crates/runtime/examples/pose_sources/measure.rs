//! The tissue under a source against the same network under the true poses.

use std::sync::Arc;

use anyhow::Result;
use dynaskin_runtime::{Avatar, Model, PoseSource, Settled};

use dynaskin_pose_sources::Frame;
use dynaskin_pose_sources::Truth;

/// Runs of the reference, which stand this part of a tick apart.
const PHASES: usize = 4;
const TICK: f64 = 1.0 / 60.0;

/// The start is not measured: the tissue is settled there, and clocks are being found.
const SKIPPED_SECONDS: f64 = 1.0;

/// Latencies that are tried, in seconds.
const MOST_LATENCY: f64 = 0.2;

/// Offsets of the soft vertices, three numbers each, in metres.
type Offsets = Vec<f32>;

/// What the network gives for the true poses, at `PHASES` instants a tick.
pub struct Reference {
    samples: Vec<Offsets>,
}

/// How one clip went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Played {
    /// Sums of squares, in m², of difference and of true offsets.
    pub off: f64,
    pub size: f64,
    /// At the best alignment, in seconds.
    pub latency: f64,
    /// As the avatar says.
    pub said_latency: f64,
    pub false_cuts: usize,
    /// Root mean square over time of the vertex that moves most, in millimetres.
    pub moved_mm: f64,
    /// Largest of any time and vertex, in millimetres.
    pub most_mm: f64,
}

fn offsets(avatar: &Avatar) -> Offsets {
    let vertices = avatar.model().soft_vertices().iter();
    let all = avatar.offsets_rest_m();
    vertices
        .flat_map(|&vertex| all[vertex as usize].to_array())
        .collect()
}

impl Reference {
    pub fn new(model: &Arc<Model>, truth: &Truth) -> Result<Self> {
        let ticks = (truth.seconds / TICK) as usize;
        let mut samples = vec![Offsets::new(); PHASES * ticks];
        for phase in 0..PHASES {
            let mut avatar = Avatar::new(Arc::clone(model), &[0.0; 10])?;
            avatar.set_pose_source(PoseSource::AsGiven);
            for tick in 0..ticks {
                let time = TICK * (tick as f64 + phase as f64 / PHASES as f64);
                avatar.step(&truth.at(time), if tick == 0 { 0.0 } else { TICK })?;
                samples[PHASES * tick + phase] = offsets(&avatar);
            }
        }
        Ok(Self { samples })
    }

    /// Sums of squares of every `stride`th number of `got` less the reference at `time`, and of the
    /// reference.
    fn compared(&self, got: &Offsets, time: f64, stride: usize) -> (f64, f64) {
        let position = (time / TICK * PHASES as f64).max(1.0);
        let before = (position as usize).min(self.samples.len() - 3);
        let u = (position - before as f64) as f32;
        // Lagrange's cubic through the four samples around.
        let weights = [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -(u + 1.0) * u * (u - 2.0) / 2.0,
            (u + 1.0) * u * (u - 1.0) / 6.0,
        ];
        let around: [&Offsets; 4] = std::array::from_fn(|idx| &self.samples[before + idx - 1]);
        let (mut off, mut size) = (0.0_f64, 0.0_f64);
        for idx in (0..got.len()).step_by(stride) {
            let true_one = weights[0] * around[0][idx]
                + weights[1] * around[1][idx]
                + weights[2] * around[2][idx]
                + weights[3] * around[3][idx];
            let difference = got[idx] - true_one;
            off += f64::from(difference * difference);
            size += f64::from(true_one * true_one);
        }
        (off, size)
    }
}

/// Plays `frames` on a new avatar.
pub fn played(
    model: &Arc<Model>,
    source: PoseSource,
    frames: &[Frame],
    reference: Option<&Reference>,
) -> Result<Played> {
    let mut avatar = Avatar::new(Arc::clone(model), &[0.0; 10])?;
    avatar.set_pose_source(source);
    let mut got: Vec<(f64, Offsets)> = Vec::with_capacity(frames.len());
    let mut played = Played::default();
    let mut said = Vec::new();
    for (idx, frame) in frames.iter().enumerate() {
        let report = avatar.step(&frame.pose, frame.dt_seconds)?;
        played.false_cuts += usize::from(idx > 0 && report.settled == Some(Settled::Cut));
        if frame.time >= SKIPPED_SECONDS {
            got.push((frame.time, offsets(&avatar)));
            said.push(avatar.source_diagnosis().latency_seconds);
        }
    }
    played.said_latency = said.iter().sum::<f64>() / said.len().max(1) as f64;
    match reference {
        Some(reference) => align(&mut played, reference, &got),
        None => stand(&mut played, &got),
    }
    Ok(played)
}

/// Numbers that are skipped while the alignment is looked for: not a multiple of three.
const STRIDE: usize = 31;

fn align(played: &mut Played, reference: &Reference, got: &[(f64, Offsets)]) {
    let at = |latency: f64, stride: usize| {
        got.iter().fold((0.0, 0.0), |sum, (time, got)| {
            let (off, size) = reference.compared(got, time - latency, stride);
            (sum.0 + off, sum.1 + size)
        })
    };
    let mut best = (f64::INFINITY, 0.0);
    for step in -10..=(MOST_LATENCY / 1e-3) as i32 {
        let latency = 1e-3 * f64::from(step);
        let (off, size) = at(latency, STRIDE);
        if off / size < best.0 {
            best = (off / size, latency);
        }
    }
    played.latency = best.1;
    (played.off, played.size) = at(played.latency, 1);
}

/// How much the tissue of somebody moves who stands still.
fn stand(played: &mut Played, got: &[(f64, Offsets)]) {
    let Some((_, first)) = got.first() else {
        return;
    };
    let count = got.len() as f64;
    let mut mean = vec![0.0_f64; first.len()];
    for (_, offsets) in got {
        for (mean, value) in mean.iter_mut().zip(offsets) {
            *mean += f64::from(*value) / count;
        }
    }
    let mut squares = 0.0;
    for (_, offsets) in got {
        let lengths = offsets
            .chunks_exact(3)
            .zip(mean.chunks_exact(3))
            .map(|(at, mean)| {
                at.iter()
                    .zip(mean)
                    .map(|(at, mean)| (f64::from(*at) - mean).powi(2))
                    .sum::<f64>()
            });
        let most = lengths.fold(0.0, f64::max);
        squares += most / count;
        played.most_mm = played.most_mm.max(1e3 * most.sqrt());
    }
    played.moved_mm = 1e3 * squares.sqrt();
}
