//! Measures on a model's networks how its regions swing.

use dynaskin_body::{BodyModel, Pose, REGION_COUNT, SHAPE_COUNT};
use glam::DVec3;

use crate::RuntimeError;
use crate::features::MotionFeatures;
use crate::networks::{AtRest, Networks, Sessions};
use crate::tissue::{Fit, Mode};

/// Length of the pulse that modes are measured with, in ticks: short beside the period of soft
/// tissue, long enough for second differences to see its shape.
const PULSE_TICKS: usize = 6;

/// Rise of the pelvis in that pulse, in metres: its peak acceleration is 20 m/s², of a hop's size.
const PULSE_HEIGHT_M: f64 = 0.01;

/// Ticks after the pulse in which tissue is watched swinging out.
const WATCHED_TICKS: usize = 45;

/// A vertex is part of a region for the measurement from this membership on.
const MEMBER: f32 = 0.5;

/// The modes of a model's regions at the average shape: the networks are given a short bump, and
/// the recursion of second order that best describes how each region swings out is its mode.
///
/// # Errors
/// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
pub(crate) fn modes(
    body: &BodyModel,
    networks: &Networks,
) -> Result<[Mode; REGION_COUNT], RuntimeError> {
    if body.region_weights.len() != REGION_COUNT {
        return Ok([Mode::TYPICAL; REGION_COUNT]);
    }
    let shape = [0.0; SHAPE_COUNT];
    let joints_rest_m = body.shaped(&shape).joints_m;
    let mut features = MotionFeatures::new(networks.bundle.feature_kind, &joints_rest_m, &shape);
    let mut sessions = Sessions::new(networks)?;
    let standing = features.push(&Pose::REST);
    let AtRest {
        mut state,
        mut latent,
        offsets_m: rest_m,
    } = sessions.at_rest(standing)?;
    let Sessions { predictor, decoder } = &mut sessions;

    let mut past = [rest_m.clone(), rest_m.clone()];
    let mut now = rest_m.clone();
    let mut fits = [Fit::default(); REGION_COUNT];
    for tick in 1..=PULSE_TICKS + WATCHED_TICKS {
        let turn = std::f64::consts::TAU * tick.min(PULSE_TICKS) as f64 / PULSE_TICKS as f64;
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::Y * (0.5 * PULSE_HEIGHT_M * (1.0 - turn.cos()));
        predictor.step(features.push(&pose), &mut state, &mut latent)?;
        decoder.decode(&latent, &mut now)?;
        // The accelerations of the pulse reach two ticks past it.
        if tick >= PULSE_TICKS + 4 {
            for (fit, weights) in fits.iter_mut().zip(&body.region_weights) {
                for (slot, &vertex) in networks.bundle.vertices.iter().enumerate() {
                    if weights[vertex as usize] < MEMBER {
                        continue;
                    }
                    for number in 3 * slot..3 * slot + 3 {
                        let at = |list: &[f32]| f64::from(list[number] - rest_m[number]);
                        fit.add(at(&now), at(&past[0]), at(&past[1]));
                    }
                }
            }
        }
        past.swap(0, 1);
        std::mem::swap(&mut past[0], &mut now);
    }
    Ok(fits.map(|fit| fit.mode().unwrap_or(Mode::TYPICAL)))
}
