//! Compares the simulator with measured bodies: how each region rings after a push, and how far it moves
//! in running, walking and hopping.

mod amplitude;
mod measured;
mod survey;
mod vibration;

use dynaskin_body::{BodyModel, JOINT_COUNT, REGION_COUNT, Region, SHAPE_COUNT};
use dynaskin_motion::{MODEL_RATE_HZ, Procedural, ProceduralKind};
use glam::Vec3;

pub use amplitude::{Amplitude, amplitudes};
pub use measured::{MEASURED, Measured, Quantity};
pub use survey::{LargestOffset, Survey, largest_offsets};
pub use vibration::{Ringing, Vibration, free_vibration};

use crate::dataset::ClipData;
use crate::run::{Motion, RunError};
use crate::settings::SimSettings;
use crate::shell::{Shell, ShellReport};
use crate::simulate::{ClipLabels, simulate_clip};
use crate::solver::Solver;
use dynaskin_body::Materials;

/// Length of the motions made by formula, in seconds.
const PROCEDURAL_SECONDS: f64 = 6.0;
/// Their frames that count: repeating, neither starting nor ending.
const PROCEDURAL_FRAMES: std::ops::Range<usize> = 120..270;
/// Frames at the start of a capture during which tissue gets going.
const LEAD_FRAMES: usize = 20;
/// Usual length of a capture's gait cycle in frames.
const GAIT_FRAMES: usize = 64;

/// A motion that regions are measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Running, on the spot or ahead.
    Running,
    /// Walking.
    Walking,
    /// Hopping on both legs.
    Hopping,
}

impl Activity {
    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Walking => "walking",
            Self::Hopping => "hopping",
        }
    }
}

/// How far a body's regions move in one motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// What the motion is.
    pub activity: Activity,
    /// Name of the motion.
    pub motion: String,
    /// Whether it is a capture.
    pub captured: bool,
    /// Amplitudes by region.
    pub regions: [Amplitude; REGION_COUNT],
}

/// One body shape measured.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Shape coefficients.
    pub shape: [f32; SHAPE_COUNT],
    /// Counts, masses and depths.
    pub shell: ShellReport,
    /// Mass in kg that was added for the time step.
    pub added_mass_kg: f32,
    /// Ringing of each region.
    pub vibrations: Vec<Vibration>,
    /// Movement of each region in each motion.
    pub moved: Vec<Moved>,
}

impl Calibration {
    /// Measures one shape: rings every region and plays running, walking and hopping, made by
    /// formula and captured.
    ///
    /// # Errors
    /// [`RunError`] if a capture cannot be read or a simulation goes astray.
    pub fn of_shape(
        body: &BodyModel,
        settings: &SimSettings,
        shape: [f32; SHAPE_COUNT],
        captures: &[(Activity, Motion)],
    ) -> Result<Self, RunError> {
        let shell = Shell::for_body(body, &shape, settings)?;
        let vibrations = Region::ALL
            .map(|region| free_vibration(body, &shell, settings, region))
            .into_iter()
            .collect::<Result<_, _>>()
            .map_err(RunError::Vibration)?;
        let joints_rest_m = body.shaped(&shape).joints_m;
        let mut moved = Vec::new();
        for (activity, kind) in [
            (Activity::Running, ProceduralKind::RunInPlace),
            (Activity::Walking, ProceduralKind::Walk),
            (Activity::Hopping, ProceduralKind::Hop),
        ] {
            let parameters = Procedural {
                duration_seconds: PROCEDURAL_SECONDS,
                ..Procedural::new(kind)
            };
            let motion = Motion::Procedural {
                name: kind.name().to_owned(),
                parameters,
            };
            // Gait cycles have two steps.
            let steps = if activity == Activity::Hopping {
                1.0
            } else {
                2.0
            };
            let cycle = (steps * MODEL_RATE_HZ / parameters.tempo_hz).round() as usize;
            let clip = play(&shell, settings, &motion, &joints_rest_m, shape)?;
            moved.push(Moved {
                activity,
                motion: motion.name().to_owned(),
                captured: false,
                regions: amplitudes(body, &clip, PROCEDURAL_FRAMES, cycle),
            });
        }
        for (activity, motion) in captures {
            let clip = play(&shell, settings, motion, &joints_rest_m, shape)?;
            let frames = LEAD_FRAMES.min(clip.frame_count() / 4)..clip.frame_count();
            moved.push(Moved {
                activity: *activity,
                motion: motion.name().to_owned(),
                captured: true,
                regions: amplitudes(body, &clip, frames, GAIT_FRAMES),
            });
        }
        Ok(Self {
            shape,
            shell: shell.report(),
            added_mass_kg: Solver::new(&shell, settings).added_mass_kg(),
            vibrations,
            moved,
        })
    }

    /// Our value of a measured quantity, and what it was taken from. Walking is taken from captures
    /// where there are some: the walk made by formula has no heel strike.
    pub fn value_of(&self, measured: &Measured) -> Option<(f64, String)> {
        let region = measured.region as usize;
        let mean = |activity, of: fn(&Amplitude) -> f64| {
            let of_kind = |captured| {
                self.moved
                    .iter()
                    .filter(move |moved| moved.activity == activity && moved.captured == captured)
            };
            let captured = of_kind(true).count() > 0 && activity == Activity::Walking;
            let values: Vec<(f64, &str)> = of_kind(captured)
                .map(|moved| (of(&moved.regions[region]), moved.motion.as_str()))
                .collect();
            let names: Vec<&str> = values.iter().map(|(_, name)| *name).collect();
            let sum: f64 = values.iter().map(|(value, _)| value).sum();
            (!values.is_empty()).then(|| (sum / values.len() as f64, names.join(", ")))
        };
        let vertical = |amplitude: &Amplitude| amplitude.peak_to_peak_m[1];
        let vibration = self.vibrations.get(region);
        let pushed = "push of 0.1 m/s".to_owned();
        match measured.quantity {
            Quantity::FrequencyHz => vibration.map(|v| (v.frequency_hz, pushed)),
            Quantity::DampingRatio => vibration.map(|v| (v.damping_ratio, pushed)),
            Quantity::RunningVerticalM => mean(Activity::Running, vertical),
            Quantity::RunningTotalM => mean(Activity::Running, Amplitude::total_m),
            Quantity::WalkingTotalM => mean(Activity::Walking, Amplitude::total_m),
            Quantity::HoppingVerticalM => mean(Activity::Hopping, vertical),
        }
    }
}

fn play(
    shell: &Shell,
    settings: &SimSettings,
    motion: &Motion,
    joints_rest_m: &[Vec3; JOINT_COUNT],
    shape: [f32; SHAPE_COUNT],
) -> Result<ClipData, RunError> {
    let clip = motion.clip(joints_rest_m)?;
    let labels = ClipLabels {
        name: motion.name().to_owned(),
        body_sha256: String::new(),
        seed: 0,
        shape,
        materials: Materials::NOMINAL,
        sim_json: String::new(),
    };
    Ok(simulate_clip(shell, &clip, settings, labels)?.data)
}
