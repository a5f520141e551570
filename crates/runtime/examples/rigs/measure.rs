//! The networks, and how far they are from the simulator.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use dynaskin_body::{Materials, Region};
use dynaskin_motion::Clip;
use dynaskin_runtime::features::{FeatureKind, clip_features};
use dynaskin_runtime::{Bundle, Decoder, DecoderSession, Predictor, PredictorSession};

use crate::truth::Simulator;

/// A vertex belongs to a region, or to what is soft, from this weight on.
const MEMBERSHIP: f32 = 0.5;

/// Sums of errors and of simulated offsets, metres: all soft vertices, chest, upper arms.
#[derive(Clone, Copy, Debug, Default)]
pub struct Off {
    error: [f64; 3],
    size: [f64; 3],
    count: [usize; 3],
}

impl Off {
    pub fn add(&mut self, other: &Self) {
        for k in 0..3 {
            self.error[k] += other.error[k];
            self.size[k] += other.size[k];
            self.count[k] += other.count[k];
        }
    }

    pub fn ratios(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.error[k] / self.size[k])
    }

    pub fn static_mm(&self) -> f64 {
        1e3 * self.size[0] / self.count[0] as f64
    }
}

pub struct Network {
    predictor: PredictorSession,
    decoder: DecoderSession,
    kind: FeatureKind,
    latents: usize,
}

impl Network {
    pub fn new(model: &Path) -> Result<Self> {
        let read = |file: &str| std::fs::read(model.join(file));
        let bundle = Bundle::from_json(&read("bundle.json")?)?;
        let kind = bundle.feature_kind;
        let predictor = read(&bundle.predictor.file)?;
        let predictor = Predictor::load_conditioned(&predictor, kind.condition_count())?;
        let decoder = Decoder::load(&read(&bundle.decoder.file)?)?;
        Ok(Self {
            predictor: PredictorSession::new(Arc::new(predictor))?,
            latents: decoder.latent_count(),
            decoder: DecoderSession::new(&decoder)?,
            kind,
        })
    }

    /// `[frame][slot][xyz]`, metres.
    fn play(&mut self, clip: &Clip, simulator: &Simulator) -> Result<Vec<f32>> {
        let features = clip_features(
            self.kind,
            &clip.frames,
            clip.rate_hz,
            simulator.joints_rest_m(),
            &[0.0; 10],
            &Materials::NOMINAL,
        )?;
        let mut state = self.predictor.predictor().zero_state();
        let mut latent = vec![0.0; self.latents];
        let mut frame = vec![0.0; 3 * simulator.vertices().len()];
        let mut offsets = Vec::new();
        for features in features.chunks_exact(self.kind.count()) {
            self.predictor.step(features, &mut state, &mut latent)?;
            self.decoder.decode(&latent, &mut frame)?;
            offsets.extend_from_slice(&frame);
        }
        Ok(offsets)
    }

    pub fn off(&mut self, clip: &Clip, truth: &[f32], simulator: &Simulator) -> Result<Off> {
        let shown = self.play(clip, simulator)?;
        let mut off = Off::default();
        for (k, slots) in groups(simulator).into_iter().enumerate() {
            for (shown, truth) in frames(&shown, simulator).zip(frames(truth, simulator)) {
                for slot in &slots {
                    let at =
                        |offsets: &[f32]| [0, 1, 2].map(|axis| f64::from(offsets[3 * slot + axis]));
                    let (shown, truth) = (at(shown), at(truth));
                    off.error[k] += length([0, 1, 2].map(|axis| shown[axis] - truth[axis]));
                    off.size[k] += length(truth);
                    off.count[k] += 1;
                }
            }
        }
        Ok(off)
    }

    /// Mean length of the chest's offsets in the last frame, of the networks and of the simulator.
    pub fn resting_chest_mm(
        &mut self,
        clip: &Clip,
        truth: &[f32],
        simulator: &Simulator,
    ) -> Result<[f64; 2]> {
        let shown = self.play(clip, simulator)?;
        let [_, chest, _] = groups(simulator);
        Ok([&shown[..], truth].map(|offsets| {
            let last = frames(offsets, simulator).last().unwrap_or_default();
            let lengths = chest
                .iter()
                .map(|slot| length([0, 1, 2].map(|axis| f64::from(last[3 * slot + axis]))));
            1e3 * lengths.sum::<f64>() / chest.len() as f64
        }))
    }
}

fn frames<'a>(offsets: &'a [f32], simulator: &Simulator) -> impl Iterator<Item = &'a [f32]> {
    offsets.chunks_exact(3 * simulator.vertices().len())
}

/// Slots of all soft vertices, of the chest and of the upper arms.
fn groups(simulator: &Simulator) -> [Vec<usize>; 3] {
    let slots = |weight: &dyn Fn(usize) -> f32| -> Vec<usize> {
        let vertices = simulator.vertices().iter().enumerate();
        vertices
            .filter(|(_, vertex)| weight(**vertex as usize) >= MEMBERSHIP)
            .map(|(slot, _)| slot)
            .collect()
    };
    let region = |region: Region| &simulator.body.region_weights[region as usize];
    [
        slots(&|vertex| simulator.body.softness(vertex)),
        slots(&|vertex| region(Region::Chest)[vertex]),
        slots(&|vertex| region(Region::UpperArms)[vertex]),
    ]
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
