//! The soft tissue of one avatar: features, predictor, decoder, response, and settling.

use std::sync::Arc;

use dynaskin_body::{JOINT_COUNT, Pose, SHAPE_COUNT};
use glam::Vec3;

use crate::RuntimeError;
use crate::avatar::{StageSeconds, Stopwatch};
use crate::clock::{TickClock, Ticks};
use crate::controls::Controls;
use crate::features::{InertialFeatures, Kinematics};
use crate::model::{Model, Networks};
use crate::onnx::{DecoderSession, PredictorSession, PredictorState};
use crate::response::Response;
use crate::state::{Reader, Writer};

/// Most ticks of standing still until the tissue counts as settled: 2 s, after which tissue of
/// adults has long come to rest.
const MAX_SETTLE_TICKS: usize = 120;

/// Settled is what changes by less than this fraction of the largest latent in one tick.
const SETTLE_TOLERANCE: f32 = 1e-6;

/// After a cut or a stall, what was shown before gives way to the settled tissue over this time, in
/// seconds: a tissue's own swing takes about as long, so nothing pops.
pub const FADE_SECONDS: f64 = 0.2;

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
    /// Changes stiffness and damping; none while they are as predicted.
    response: Option<Response>,
    /// What is shown, three numbers a soft vertex, in metres: 0 at rest.
    shown_m: Vec<f32>,
    /// What was shown before a cut, less what the cut settled to.
    faded_m: Vec<f32>,
    /// Time since that cut; as long as it is below [`FADE_SECONDS`], some of it is shown.
    fade_seconds: f64,
}

/// What the tissue remembers, read from a saved state.
#[derive(Debug)]
pub(crate) struct Memory {
    past: Kinematics,
    state: PredictorState,
    latents: [Vec<f32>; 2],
    shown_m: Vec<f32>,
    faded_m: Vec<f32>,
    fade_seconds: f64,
    /// Inputs and outputs of the response.
    response: Option<[[Vec<f32>; 2]; 2]>,
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
            response: None,
            shown_m: vec![0.0; numbers],
            faded_m: vec![0.0; numbers],
            fade_seconds: FADE_SECONDS,
        };
        tissue.measure_rest(joints_rest_m, shape)?;
        tissue.raw_m.copy_from_slice(&tissue.rest_m);
        Ok(tissue)
    }

    /// Offsets to show, three numbers a soft vertex, in metres; gains and limits are not in them.
    pub fn shown_m(&self) -> &[f32] {
        &self.shown_m
    }

    /// Takes over root inertia, stiffness and damping. What swings swings on.
    pub fn set_controls(&mut self, model: &Model, controls: &Controls) -> Result<(), RuntimeError> {
        if controls.responds_as_predicted() {
            self.response = None;
        } else {
            let (modes, regions) = (model.modes()?, &controls.regions);
            match &mut self.response {
                Some(response) => response.set(model, modes, regions),
                None => {
                    self.response = Some(Response::new(model, modes, regions, &self.shown_m));
                }
            }
        }
        self.features.set_root_inertia(controls.root_inertia.into());
        Ok(())
    }

    /// Another length is one metre now: `ratio` is the old one over the new one.
    pub fn rescale(&mut self, ratio: f64) {
        self.features.rescale(ratio);
    }

    /// Changes the body's shape; the motion goes on.
    pub fn set_shape(
        &mut self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        shape: &[f32; SHAPE_COUNT],
    ) -> Result<(), RuntimeError> {
        let rest_before_m = self.rest_m.clone();
        if let Err(error) = self.measure_rest(joints_rest_m, shape) {
            self.rest_m = rest_before_m;
            return Err(error);
        }
        self.features.set_shape(joints_rest_m, shape);
        if self.response.is_none() {
            // The networks' error at rest differs from shape to shape: let the difference fade.
            let left = self.fade_left();
            let rests = self.rest_m.iter().zip(&rest_before_m);
            for (faded, (now, before)) in self.faded_m.iter_mut().zip(rests) {
                *faded = left * *faded + now - before;
            }
            self.fade_seconds = 0.0;
        }
        Ok(())
    }

    /// The tissue after standing in `pose` for long; shows it at once, or, where it is to `fade`,
    /// as the end of a short way from what is shown now.
    pub fn settle(&mut self, pose: &Pose, fade: bool) -> Result<(), RuntimeError> {
        self.features.reset();
        // One pose of history and no more: the body may be moving, and an acceleration from
        // standstill to its speed would be a blow.
        let features = self.features.push(pose);
        self.state = settled(&mut self.predictor, features, &mut self.latent)?;
        self.latent_before.copy_from_slice(&self.latent);
        self.decoder.decode(&self.latent, &mut self.raw_m)?;
        std::mem::swap(&mut self.faded_m, &mut self.shown_m);
        for (shown, (raw, rest)) in self
            .shown_m
            .iter_mut()
            .zip(self.raw_m.iter().zip(&self.rest_m))
        {
            *shown = raw - rest;
        }
        if let Some(response) = &mut self.response {
            response.settle(&self.shown_m);
            response.show(1.0, &mut self.shown_m);
        }
        self.fade_seconds = FADE_SECONDS;
        if fade {
            self.fade_seconds = 0.0;
            for (faded, shown) in self.faded_m.iter_mut().zip(&self.shown_m) {
                *faded -= shown;
            }
            self.add_faded();
        }
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
            if let Some(response) = &mut self.response {
                self.decoder.decode(&self.latent, &mut self.raw_m)?;
                response.push(&self.raw_m, &self.rest_m);
                seconds.decode += stopwatch() - end;
            }
        }
        Ok(())
    }

    /// Shows what lies `phase` (0..1) from the tick before the last to the last, `dt_seconds` after
    /// what was shown before.
    pub fn show(&mut self, phase: f64, dt_seconds: f64) -> Result<(), RuntimeError> {
        let phase = phase as f32;
        if let Some(response) = &self.response {
            response.show(phase, &mut self.shown_m);
        } else {
            let latents = self.latent_before.iter().zip(&self.latent);
            for (shown, (before, last)) in self.latent_shown.iter_mut().zip(latents) {
                *shown = before + phase * (last - before);
            }
            self.decoder.decode(&self.latent_shown, &mut self.raw_m)?;
            let decoded = self.raw_m.iter().zip(&self.rest_m);
            for (shown, (raw, rest)) in self.shown_m.iter_mut().zip(decoded) {
                *shown = raw - rest;
            }
        }
        self.fade_seconds = (self.fade_seconds + dt_seconds).min(FADE_SECONDS);
        self.add_faded();
        Ok(())
    }

    /// Adds what is left of the offsets from before a cut.
    fn add_faded(&mut self) {
        let left = self.fade_left();
        if left > 0.0 {
            for (shown, faded) in self.shown_m.iter_mut().zip(&self.faded_m) {
                *shown += left * faded;
            }
        }
    }

    /// How much of the offsets from before a cut is left: from 1 to 0, smoothly.
    fn fade_left(&self) -> f32 {
        let gone = (self.fade_seconds / FADE_SECONDS).min(1.0) as f32;
        1.0 - gone * gone * (3.0 - 2.0 * gone)
    }

    /// Adds what the tissue remembers to a saved state.
    pub fn write(&self, writer: &mut Writer) -> Result<(), RuntimeError> {
        self.features.write(writer);
        self.state.write(writer)?;
        for numbers in [
            &self.latent,
            &self.latent_before,
            &self.shown_m,
            &self.faded_m,
        ] {
            writer.floats(numbers);
        }
        writer.double(self.fade_seconds);
        if let Some(response) = &self.response {
            for numbers in response.inputs_m.iter().chain(&response.outputs_m) {
                writer.floats(numbers);
            }
        }
        Ok(())
    }

    /// What a saved state says, for [`Self::remember`]. `responds` tells whether the saved controls
    /// change stiffness or damping.
    pub fn read(
        &self,
        reader: &mut Reader<'_>,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        responds: bool,
    ) -> Result<Memory, RuntimeError> {
        let (latents, numbers) = (self.latent.len(), self.shown_m.len());
        Ok(Memory {
            past: InertialFeatures::read_past(reader, joints_rest_m)?,
            state: self.predictor.predictor().read_state(reader)?,
            latents: [reader.floats(latents)?, reader.floats(latents)?],
            shown_m: reader.floats(numbers)?,
            faded_m: reader.floats(numbers)?,
            fade_seconds: reader.double()?.clamp(0.0, FADE_SECONDS),
            response: if responds {
                let mut list = || reader.floats(numbers);
                Some([[list()?, list()?], [list()?, list()?]])
            } else {
                None
            },
        })
    }

    /// Goes on from what a saved state said; shape and controls are already as they were then.
    pub fn remember(&mut self, memory: Memory) {
        self.features.set_past(memory.past);
        self.state = memory.state;
        [self.latent, self.latent_before] = memory.latents;
        self.shown_m = memory.shown_m;
        self.faded_m = memory.faded_m;
        self.fade_seconds = memory.fade_seconds;
        if let (Some(response), Some(saved)) = (&mut self.response, memory.response) {
            [response.inputs_m, response.outputs_m] = saved;
        }
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
pub(crate) fn settled(
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
