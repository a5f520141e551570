//! The soft tissue of one avatar: what it remembers, and what happens to it before and after the
//! networks run. It knows no networks: what they read and write are its rows of numbers.

mod mode;
mod response;

use std::sync::Arc;

use dynaskin_body::{Materials, SHAPE_COUNT};
use dynaskin_skeleton::{JOINT_COUNT, Pose};
use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::RuntimeError;
use crate::features::{FeatureKind, MotionFeatures};
use crate::networks::LinearDecoder;
use crate::state;

pub(crate) use mode::{Fit, Mode};
pub(crate) use response::Filters;
use response::Response;

/// Time in seconds over which the previous offsets fade into the settled tissue after a cut or a stall:
/// the period of a tissue's own swing, so nothing pops.
pub const FADE_SECONDS: f64 = 0.2;

/// The tissue of one shape, come to rest in the rest pose.
#[derive(Debug)]
pub(crate) struct RestTissue {
    /// Coefficients β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// Rest positions of the joints in metres.
    pub joints_rest_m: [Vec3; JOINT_COUNT],
    /// The predictor's state.
    pub state: Vec<f32>,
    pub latent: Vec<f32>,
    /// What the networks put out. The surface there is the plainly skinned one by definition, so
    /// this is their error, and is taken away. Three numbers a soft vertex, in metres.
    pub offsets_m: Vec<f32>,
}

#[derive(Debug)]
pub(crate) struct Tissue {
    features: MotionFeatures,
    state: Vec<f32>,
    /// What the networks keep for this tissue, so as not to calculate it at every tick; no memory of
    /// the tissue's own.
    kept: Vec<f32>,
    /// The latents of the last tick and of the one before.
    latent: Vec<f32>,
    latent_before: Vec<f32>,
    /// What the decoder is given.
    decoded: Vec<f32>,
    /// Offsets as decoded, three numbers a soft vertex, in metres.
    raw_m: Vec<f32>,
    rest: Arc<RestTissue>,
    /// Changes stiffness and damping; none while they are as predicted.
    response: Option<Response>,
    /// What the next two are.
    form: Form,
    /// Whether they are to be latents as soon as they can.
    keeps_latents: bool,
    /// What is shown: 0 at rest.
    shown: Vec<f32>,
    /// What was shown before a cut, less what the cut settled to.
    faded: Vec<f32>,
    /// Time since that cut; as long as it is below [`FADE_SECONDS`], some of it is shown.
    fade_seconds: f64,
}

/// What the numbers that are shown are. Nothing but sums and multiples of them is made here, so a decoder
/// that is one matrix gives the one from the other whenever it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Offsets, three numbers a soft vertex, in metres.
    Offsets,
    /// Latents that are still to be decoded, less those at rest. Never with a response.
    Latents,
}

/// What the tissue remembers, as a saved state holds it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Memory {
    past: [Option<Pose>; 2],
    state: Vec<f32>,
    latents: [Vec<f32>; 2],
    shown_m: Vec<f32>,
    faded_m: Vec<f32>,
    fade_seconds: f64,
    /// Inputs and outputs of the response.
    response: Option<[[Vec<f32>; 2]; 2]>,
}

impl Tissue {
    /// Tissue that has come to rest in the rest pose.
    pub fn new(kind: FeatureKind, rest: &Arc<RestTissue>) -> Self {
        let numbers = rest.offsets_m.len();
        Self {
            features: MotionFeatures::new(kind, &rest.joints_rest_m, &rest.shape),
            state: rest.state.clone(),
            kept: Vec::new(),
            latent: rest.latent.clone(),
            latent_before: rest.latent.clone(),
            decoded: rest.latent.clone(),
            raw_m: rest.offsets_m.clone(),
            rest: Arc::clone(rest),
            response: None,
            form: Form::Offsets,
            keeps_latents: false,
            shown: vec![0.0; numbers],
            faded: vec![0.0; numbers],
            fade_seconds: FADE_SECONDS,
        }
    }

    /// Offsets to show, three numbers a soft vertex, in metres; gains and limits are not in them. None
    /// where they are still to be decoded.
    pub fn shown_m(&self) -> Option<&[f32]> {
        (self.form == Form::Offsets).then_some(&self.shown)
    }

    /// What gives them, multiplied with the decoder's matrix: latents, less those at rest.
    pub fn shown_latents(&self) -> Option<&[f32]> {
        (self.form == Form::Latents).then_some(&self.shown)
    }

    /// From now on nothing is decoded, as soon as what is shown follows from the last latents: nothing fades
    /// or responds then.
    pub fn keep_latents(&mut self) {
        self.keeps_latents = true;
        if self.form == Form::Offsets && self.shown.iter().all(|number| *number == 0.0) {
            self.undecode();
            self.shown.fill(0.0);
        }
    }

    /// From now on everything is decoded again, what is shown by `decoder`.
    pub fn keep_offsets<'a>(&mut self, decoder: impl FnOnce() -> Option<&'a LinearDecoder>) {
        self.keeps_latents = false;
        self.decode(decoder);
    }

    /// Takes the decoder's input in place of offsets, where that can be.
    fn undecode(&mut self) {
        if self.response.is_none() && self.fade_seconds >= FADE_SECONDS {
            self.form = Form::Latents;
            self.faded.clear();
            self.faded.resize(self.decoded.len(), 0.0);
            self.shown.resize(self.decoded.len(), 0.0);
            self.take_decoded();
        }
    }

    /// Takes offsets in place of latents, if it has latents; only these need the `decoder`.
    pub fn decode<'a>(&mut self, decoder: impl FnOnce() -> Option<&'a LinearDecoder>) {
        if self.form == Form::Latents {
            [self.shown, self.faded] = self.in_metres(decoder());
            self.form = Form::Offsets;
        }
    }

    /// What is shown and what fades, as offsets. Only latents need the `decoder`.
    pub fn in_metres(&self, decoder: Option<&LinearDecoder>) -> [Vec<f32>; 2] {
        [&self.shown, &self.faded].map(|numbers| match (self.form, decoder) {
            (Form::Latents, Some(decoder)) => {
                let mut offsets_m = vec![0.0; self.rest.offsets_m.len()];
                decoder.multiply(numbers, &mut offsets_m);
                offsets_m
            }
            _ => numbers.clone(),
        })
    }

    /// Takes over what the networks are told of the tissue's material, what is left to `filters`
    /// after them, and root inertia. What swings swings on.
    pub fn set_controls(
        &mut self,
        materials: &Materials,
        filters: Option<Filters>,
        root_inertia: f64,
    ) {
        self.features.set_materials(materials);
        self.response = match (self.response.take(), filters) {
            (_, None) => None,
            (Some(mut response), Some(filters)) => {
                response.set(filters);
                Some(response)
            }
            (None, Some(filters)) => Some(Response::new(filters, &self.shown)),
        };
        self.features.set_root_inertia(root_inertia);
    }

    /// Another length is one metre now: `ratio` is the old one over the new one.
    pub fn rescale(&mut self, ratio: f64) {
        self.features.rescale(ratio);
    }

    /// Changes the body's shape; the motion goes on.
    pub fn set_rest(&mut self, rest: &Arc<RestTissue>) {
        self.features.set_shape(&rest.joints_rest_m, &rest.shape);
        let before = std::mem::replace(&mut self.rest, Arc::clone(rest));
        if self.response.is_none() {
            // The networks' error at rest differs from shape to shape: let the difference fade.
            let left = self.fade_left();
            let (now, before) = match self.form {
                Form::Offsets => (&rest.offsets_m, &before.offsets_m),
                Form::Latents => (&rest.latent, &before.latent),
            };
            for (faded, (now, before)) in self.faded.iter_mut().zip(now.iter().zip(before)) {
                *faded = left * *faded + now - before;
            }
            self.fade_seconds = 0.0;
        }
    }

    /// Gets ready to run ticks of standing in `pose`, from the rest pose.
    pub fn begin_settling(&mut self, pose: &Pose) {
        self.features.reset();
        // One pose of history and no more: the body may be moving, and an acceleration from
        // standstill to its speed would be a blow.
        self.features.push(pose);
        self.state.copy_from_slice(&self.rest.state);
        self.latent.copy_from_slice(&self.rest.latent);
    }

    /// The latents of the last tick and of the one before.
    pub fn latents(&self) -> [&[f32]; 2] {
        [&self.latent, &self.latent_before]
    }

    /// Takes the latent of the last tick as that of standing in the pose for long. Whether it has to be
    /// decoded.
    pub fn settle(&mut self) -> bool {
        self.latent_before.copy_from_slice(&self.latent);
        self.decoded.copy_from_slice(&self.latent);
        self.form == Form::Offsets
    }

    /// Shows what was decoded after [`Self::settle`]: at once, or, where it is to `fade`, as the end
    /// of a short way from what is shown now.
    pub fn show_settled(&mut self, fade: bool) {
        std::mem::swap(&mut self.faded, &mut self.shown);
        self.take_decoded();
        if let Some(response) = &mut self.response {
            response.settle(&self.shown);
            response.show(1.0, &mut self.shown);
        }
        self.fade_seconds = FADE_SECONDS;
        if fade {
            self.fade_seconds = 0.0;
            for (faded, shown) in self.faded.iter_mut().zip(&self.shown) {
                *faded -= shown;
            }
            self.add_faded();
        }
    }

    /// Computes the features of a tick at which the body takes `pose`.
    pub fn push_pose(&mut self, pose: &Pose) {
        self.features.push(pose);
    }

    /// The features of the tick to come.
    pub fn features(&self) -> &[f32] {
        self.features.values()
    }

    /// The predictor's state.
    pub fn state(&self) -> &[f32] {
        &self.state
    }

    /// The predictor's state, to be moved on.
    pub fn state_mut(&mut self) -> &mut [f32] {
        &mut self.state
    }

    /// What the networks keep between ticks.
    pub fn kept_mut(&mut self) -> &mut Vec<f32> {
        &mut self.kept
    }

    /// Makes the last latent the one before; the next goes where [`Self::latent_mut`] says.
    pub fn begin_tick(&mut self) {
        std::mem::swap(&mut self.latent, &mut self.latent_before);
    }

    /// The last latent.
    pub fn latent_mut(&mut self) -> &mut [f32] {
        &mut self.latent
    }

    /// Whether the response must see the offsets of every tick; if so, they are decoded next.
    pub fn begin_response(&mut self) -> bool {
        if self.response.is_some() {
            self.decoded.copy_from_slice(&self.latent);
        }
        self.response.is_some()
    }

    /// Lets the response see the tick's offsets.
    pub fn respond(&mut self) {
        if let Some(response) = &mut self.response {
            response.push(&self.raw_m, &self.rest.offsets_m);
        }
    }

    /// Gets ready to show what lies `phase` (0..1) from the tick before the last to the last.
    /// Whether it has to be decoded.
    pub fn begin_showing(&mut self, phase: f64) -> bool {
        let phase = phase as f32;
        if let Some(response) = &self.response {
            response.show(phase, &mut self.shown);
            return false;
        }
        let latents = self.latent_before.iter().zip(&self.latent);
        for (shown, (before, last)) in self.decoded.iter_mut().zip(latents) {
            *shown = before + phase * (last - before);
        }
        if self.keeps_latents && self.form == Form::Offsets {
            self.undecode();
        }
        self.form == Form::Offsets
    }

    /// Shows it, `dt_seconds` after what was shown before.
    pub fn show(&mut self, dt_seconds: f64) {
        if self.response.is_none() {
            self.take_decoded();
        }
        self.fade_seconds = (self.fade_seconds + dt_seconds).min(FADE_SECONDS);
        self.add_faded();
    }

    /// What the decoder is given.
    pub fn decoder_input(&self) -> &[f32] {
        &self.decoded
    }

    /// Where the decoder writes.
    pub fn decoder_output(&mut self) -> &mut [f32] {
        &mut self.raw_m
    }

    /// Begins to let what is shown give way to nothing.
    pub fn begin_fading_out(&mut self) {
        self.faded.copy_from_slice(&self.shown);
        self.fade_seconds = 0.0;
    }

    /// Goes on with that. Whether anything changed.
    pub fn fade_out(&mut self, dt_seconds: f64) -> bool {
        if self.fade_seconds >= FADE_SECONDS {
            return false;
        }
        self.fade_seconds = (self.fade_seconds + dt_seconds).min(FADE_SECONDS);
        self.shown.fill(0.0);
        self.add_faded();
        true
    }

    /// Shows nothing.
    pub fn clear(&mut self) {
        self.shown.fill(0.0);
        self.fade_seconds = FADE_SECONDS;
    }

    fn take_decoded(&mut self) {
        let (decoded, rest) = match self.form {
            Form::Offsets => (&self.raw_m, &self.rest.offsets_m),
            Form::Latents => (&self.decoded, &self.rest.latent),
        };
        for (shown, (decoded, rest)) in self.shown.iter_mut().zip(decoded.iter().zip(rest)) {
            *shown = decoded - rest;
        }
    }

    /// Adds what is left of the offsets from before a cut.
    fn add_faded(&mut self) {
        let left = self.fade_left();
        if left > 0.0 {
            for (shown, faded) in self.shown.iter_mut().zip(&self.faded) {
                *shown += left * faded;
            }
        }
    }

    /// How much of the offsets from before a cut is left: from 1 to 0, smoothly.
    fn fade_left(&self) -> f32 {
        let gone = (self.fade_seconds / FADE_SECONDS).min(1.0) as f32;
        1.0 - gone * gone * (3.0 - 2.0 * gone)
    }

    /// What a saved state says of it, for [`Self::remember`]; `decoder` for what is not decoded yet.
    pub fn memory(&self, decoder: Option<&LinearDecoder>) -> Memory {
        let response = self.response.as_ref();
        let [shown_m, faded_m] = self.in_metres(decoder);
        Memory {
            past: self.features.past(),
            state: self.state.clone(),
            latents: [self.latent.clone(), self.latent_before.clone()],
            shown_m,
            faded_m,
            fade_seconds: self.fade_seconds,
            response: response.map(|r| [r.inputs_m.clone(), r.outputs_m.clone()]),
        }
    }

    /// Whether `memory` is one of this tissue; `responds` tells whether the saved controls change
    /// stiffness or damping.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidState`], [`RuntimeError::InvalidPose`].
    pub fn check(&self, memory: &Memory, responds: bool) -> Result<(), RuntimeError> {
        state::check_poses(memory.past.iter().flatten())?;
        state::check_list(&memory.state, self.state.len())?;
        for latent in &memory.latents {
            state::check_list(latent, self.latent.len())?;
        }
        let response = memory.response.iter().flatten().flatten();
        for offsets_m in [&memory.shown_m, &memory.faded_m]
            .into_iter()
            .chain(response)
        {
            state::check_list(offsets_m, self.rest.offsets_m.len())?;
        }
        if !(0.0..=FADE_SECONDS).contains(&memory.fade_seconds) {
            return Err(state::invalid("its fade does not fit"));
        }
        if memory.response.is_some() != responds {
            return Err(state::invalid("its controls and its tissue do not fit"));
        }
        Ok(())
    }

    /// Goes on from what a saved state said; shape and controls are already as they were then.
    pub fn remember(&mut self, memory: Memory) {
        self.features.set_past(memory.past);
        self.state = memory.state;
        [self.latent, self.latent_before] = memory.latents;
        self.form = Form::Offsets;
        self.shown = memory.shown_m;
        self.faded = memory.faded_m;
        self.fade_seconds = memory.fade_seconds;
        if let (Some(response), Some(saved)) = (&mut self.response, memory.response) {
            [response.inputs_m, response.outputs_m] = saved;
        }
    }
}
