//! The soft tissue of one avatar: features, predictor, decoder, and settling.

use std::sync::Arc;

use dynaskin_body::{JOINT_COUNT, Pose, SHAPE_COUNT};
use glam::Vec3;

use crate::RuntimeError;
use crate::avatar::{StageSeconds, Stopwatch};
use crate::clock::{TickClock, Ticks};
use crate::features::InertialFeatures;
use crate::model::Networks;
use crate::onnx::{DecoderSession, PredictorSession, PredictorState};

/// Most ticks of standing still until the tissue counts as settled: 2 s, after which tissue of
/// adults has long come to rest.
const MAX_SETTLE_TICKS: usize = 120;

/// Settled is what changes by less than this fraction of the largest latent in one tick.
const SETTLE_TOLERANCE: f32 = 1e-6;

#[derive(Debug)]
pub(crate) struct Tissue {
    features: InertialFeatures,
    predictor: PredictorSession,
    decoder: DecoderSession,
    state: PredictorState,
    /// The latents of the last tick and of the one before.
    latent: Vec<f32>,
    latent_before: Vec<f32>,
    /// What is decoded: between the two.
    latent_shown: Vec<f32>,
    /// Offsets as decoded, three numbers a soft vertex, in metres.
    raw_m: Vec<f32>,
    /// What the networks put out when the body stands in the rest pose for good. The surface there
    /// is the plainly skinned one by definition, so this is their error, and is taken away.
    rest_m: Vec<f32>,
}

impl Tissue {
    /// Tissue that has come to rest in the rest pose.
    pub fn new(
        networks: &Networks,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        shape: &[f32; SHAPE_COUNT],
    ) -> Result<Self, RuntimeError> {
        let latents = networks.bundle.latent_count;
        let numbers = 3 * networks.bundle.vertices.len();
        let mut tissue = Self {
            features: InertialFeatures::new(joints_rest_m, shape),
            state: networks.predictor.zero_state()?,
            predictor: PredictorSession::new(Arc::clone(&networks.predictor))?,
            decoder: DecoderSession::new(&networks.decoder)?,
            latent: vec![0.0; latents],
            latent_before: vec![0.0; latents],
            latent_shown: vec![0.0; latents],
            raw_m: vec![0.0; numbers],
            rest_m: vec![0.0; numbers],
        };
        tissue.measure_rest(joints_rest_m, shape)?;
        tissue.raw_m.copy_from_slice(&tissue.rest_m);
        Ok(tissue)
    }

    /// Offsets as last decoded and those at rest, three numbers a soft vertex, in metres.
    pub fn decoded_m(&self) -> (&[f32], &[f32]) {
        (&self.raw_m, &self.rest_m)
    }

    /// Changes the body's shape; the motion goes on.
    pub fn set_shape(
        &mut self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        shape: &[f32; SHAPE_COUNT],
    ) -> Result<(), RuntimeError> {
        self.measure_rest(joints_rest_m, shape)?;
        self.features.set_shape(joints_rest_m, shape);
        Ok(())
    }

    /// The tissue after standing in `pose` for long.
    pub fn settle(&mut self, pose: &Pose) -> Result<(), RuntimeError> {
        self.features.reset();
        // One pose of history and no more: the body may be moving, and an acceleration from
        // standstill to its speed would be a blow.
        let features = self.features.push(pose);
        self.state = settled(&mut self.predictor, features, &mut self.latent)?;
        self.latent_before.copy_from_slice(&self.latent);
        Ok(())
    }

    /// Runs the ticks of a step from the clock's pose to `pose`.
    pub fn tick(
        &mut self,
        clock: &TickClock,
        pose: &Pose,
        ticks: Ticks,
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        for index in 0..ticks.count {
            let start = stopwatch();
            let features = self.features.push(&clock.pose_of_tick(ticks, index, pose));
            let predicted_from = stopwatch();
            std::mem::swap(&mut self.latent, &mut self.latent_before);
            self.predictor
                .step(features, &mut self.state, &mut self.latent)?;
            let end = stopwatch();
            seconds.features += predicted_from - start;
            seconds.predict += end - predicted_from;
        }
        Ok(())
    }

    /// Decodes what lies `phase` (0..1) from the tick before the last to the last.
    pub fn decode(&mut self, phase: f64) -> Result<(), RuntimeError> {
        let phase = phase as f32;
        let latents = self.latent_before.iter().zip(&self.latent);
        for (shown, (before, last)) in self.latent_shown.iter_mut().zip(latents) {
            *shown = before + phase * (last - before);
        }
        self.decoder.decode(&self.latent_shown, &mut self.raw_m)
    }

    /// Finds [`Self::rest_m`] for a shape.
    fn measure_rest(
        &mut self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        shape: &[f32; SHAPE_COUNT],
    ) -> Result<(), RuntimeError> {
        let mut features = InertialFeatures::new(joints_rest_m, shape);
        let standing = features.push(&Pose::REST);
        settled(&mut self.predictor, standing, &mut self.latent_shown)?;
        self.decoder.decode(&self.latent_shown, &mut self.rest_m)
    }
}

/// Feeds the same `features` until the latent stays; gives the state and fills `latent`.
fn settled(
    predictor: &mut PredictorSession,
    features: &[f32],
    latent: &mut [f32],
) -> Result<PredictorState, RuntimeError> {
    let mut state = predictor.predictor().zero_state()?;
    let mut before = vec![0.0_f32; latent.len()];
    for _ in 0..MAX_SETTLE_TICKS {
        before.copy_from_slice(latent);
        predictor.step(features, &mut state, latent)?;
        let size = latent.iter().fold(0.0_f32, |size, x| size.max(x.abs()));
        let change = latent
            .iter()
            .zip(&before)
            .fold(0.0_f32, |change, (a, b)| change.max((a - b).abs()));
        if change <= SETTLE_TOLERANCE * size {
            break;
        }
    }
    Ok(state)
}
