//! Simulating a whole clip, with a retry where it goes astray.

use dynaskin_body::SHAPE_COUNT;
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use half::f16;

use crate::dataset::ClipData;
use crate::settings::SimSettings;
use crate::shell::Shell;
use crate::solver::{Solver, Unstable};
use dynaskin_body::Materials;

/// Factors on the number of time steps that are tried where the usual number fails.
const RETRY_FACTORS: [u32; 2] = [2, 4];

/// A clip that could not be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The clip is not at the model's rate.
    #[error("clip {clip} has {rate_hz} frames a second, expected 60: resample it first")]
    Rate {
        /// The clip.
        clip: String,
        /// Its rate.
        rate_hz: f64,
    },
    /// The clip has no poses, or one that is no pose.
    #[error("clip {clip}: {reason}")]
    BadPose {
        /// The clip.
        clip: String,
        /// What is wrong.
        reason: String,
    },
    /// No time step tried was small enough.
    #[error("clip {clip}: {source}; smaller steps were tried")]
    Unstable {
        /// The clip.
        clip: String,
        /// Where the last try ended.
        source: Unstable,
    },
}

/// What a clip's data file holds besides the simulation's own results.
#[derive(Clone, Debug)]
pub struct ClipLabels {
    /// Name of the data clip.
    pub name: String,
    /// SHA-256 of the body GLB, lower-case hex.
    pub body_sha256: String,
    /// Seed of the run.
    pub seed: u64,
    /// Shape coefficients β of the shell.
    pub shape: [f32; SHAPE_COUNT],
    /// Material multipliers that the shell was built with.
    pub materials: Materials,
    /// How it was simulated, as JSON.
    pub sim_json: String,
}

/// A simulated clip and how it went.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The clip with its offsets.
    pub data: ClipData,
    /// Time steps per tick that it took; above the settings' number after a retry.
    pub substeps: u32,
}

/// Simulates a clip at 60 Hz. Should it become unstable, it is run again with twice and with four
/// times the time steps.
///
/// # Errors
/// [`SimError`]; there is then no output, never one with numbers that are not finite.
pub fn simulate_clip(
    shell: &Shell,
    clip: &Clip,
    settings: &SimSettings,
    labels: ClipLabels,
) -> Result<Simulated, SimError> {
    check(clip)?;
    let attempt = |factor: u32| {
        let tried = SimSettings {
            substeps: settings.substeps * factor,
            // The added mass stays the same, so that smaller steps are further from the limit.
            stability_limit: settings.stability_limit / factor as f32,
            ..settings.clone()
        };
        run(shell, clip, &tried).map(|offsets_rest_m| (tried.substeps, offsets_rest_m))
    };
    let mut outcome = attempt(1);
    for factor in RETRY_FACTORS {
        if outcome.is_err() {
            outcome = attempt(factor);
        }
    }
    let (substeps, offsets_rest_m) = outcome.map_err(|source| SimError::Unstable {
        clip: clip.name.clone(),
        source,
    })?;
    let data = ClipData {
        name: labels.name,
        body_sha256: labels.body_sha256,
        rate_hz: MODEL_RATE_HZ,
        seed: labels.seed,
        sim_json: labels.sim_json,
        shape: labels.shape,
        materials: labels.materials,
        vertices: shell.vertices().to_vec(),
        poses: clip.frames.clone(),
        offsets_rest_m,
    };
    Ok(Simulated { data, substeps })
}

fn check(clip: &Clip) -> Result<(), SimError> {
    if (clip.rate_hz - MODEL_RATE_HZ).abs() > 1e-6 {
        return Err(SimError::Rate {
            clip: clip.name.clone(),
            rate_hz: clip.rate_hz,
        });
    }
    let bad = |reason| {
        Err(SimError::BadPose {
            clip: clip.name.clone(),
            reason,
        })
    };
    if clip.frames.is_empty() {
        return bad("it has no frames".to_owned());
    }
    match clip.frames.iter().position(|pose| !pose.is_valid()) {
        Some(frame) => bad(format!(
            "frame {frame} is not finite or holds a quaternion whose length is not 1"
        )),
        None => Ok(()),
    }
}

fn run(shell: &Shell, clip: &Clip, settings: &SimSettings) -> Result<Vec<f16>, Unstable> {
    let mut solver = Solver::new(shell, settings);
    let mut offsets = Vec::with_capacity(clip.frames.len() * shell.vertices().len() * 3);
    for pose in &clip.frames {
        solver.step(pose)?;
        for offset in solver.offsets_rest_m() {
            offsets.extend(offset.to_array().map(f16::from_f32));
        }
    }
    Ok(offsets)
}
