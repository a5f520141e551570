//! Simulating a whole data set: what is planned, run in parallel and resumed.

mod error;
mod execute;
mod motions;
mod poses;
mod rigs;
mod shapes;

use std::path::PathBuf;

use dynaskin_body::{BodyModel, REGION_COUNT, SHAPE_COUNT};
use sha2::{Digest as _, Sha256};

use crate::materials::drawn_materials;
use crate::settings::SimSettings;
use dynaskin_body::Materials;
pub use error::RunError;
pub use execute::execute;
pub use motions::{Motion, captures, held_poses, procedurals, thin_captures};
pub use poses::{HeldPoses, PoseMovement};
pub use rigs::{CollarHabit, RigHabit};
pub(crate) use shapes::even_shape;
pub use shapes::{DRAWN_SHAPES, HELD_OUT_SHAPES, TRAINING_SHAPES, drawn_shape};

/// One clip of the data set: a motion, perhaps mirrored, on one body shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The motion.
    pub motion: Motion,
    /// Whether left and right are exchanged.
    pub mirrored: bool,
    /// Index into the training shapes, followed by the held-out and the drawn ones.
    pub shape: usize,
    /// Material multipliers.
    pub materials: Materials,
    /// What the rig makes of the motion.
    pub rig: RigHabit,
    /// Frames at 60 Hz.
    pub frames: usize,
    /// What is unusual in the motion's file, one sentence each.
    pub notes: Vec<String>,
}

impl Job {
    /// Name of the clip and stem of its file: `16_04__s2`, mirrored `16_04m__s2`.
    pub fn name(&self) -> String {
        let mirrored = if self.mirrored { "m" } else { "" };
        format!("{}{mirrored}__s{}", self.motion.name(), self.shape)
    }
}

/// What every job of a run shares.
#[derive(Clone, Debug)]
pub struct Run<'a> {
    /// The body model.
    pub body: &'a BodyModel,
    /// SHA-256 of its GLB file, lower-case hex.
    pub body_sha256: &'a str,
    /// Simulator settings.
    pub settings: SimSettings,
    /// Seed that shapes are drawn with.
    pub seed: u64,
    /// Folder of the clip files.
    pub out: PathBuf,
    /// At most this many frames of each motion.
    pub limit_frames: Option<usize>,
    /// Whether each motion is also simulated mirrored. Training of our networks ties left and right
    /// anyway, so mirrored clips only add further shapes.
    pub mirrored: bool,
    /// Whether every second clip has its own materials, drawn by name and seed.
    pub vary_materials: bool,
    /// Whether every second capture is played through another kind of rig, drawn by name and seed.
    pub vary_rigs: bool,
    /// Number of training shapes to draw from, at most [`TRAINING_SHAPES`]'s.
    pub shapes: usize,
    /// Whether every second motion also comes on one of [`DRAWN_SHAPES`] further training shapes.
    pub further_shapes: bool,
}

/// How one job went.
#[derive(Debug)]
pub struct JobReport {
    /// Name of the clip.
    pub name: String,
    /// Frames of the clip.
    pub frames: usize,
    /// What came out.
    pub outcome: Outcome,
}

/// What came out of one job.
#[derive(Debug)]
pub enum Outcome {
    /// Simulated and written.
    Written {
        /// Time steps per tick, above the settings' number after a retry.
        substeps: u32,
        /// Largest offset in metres among the vertices of each region.
        largest_m: [f32; REGION_COUNT],
        /// Whether a sound clip of other settings, motion length or seed stood there before.
        replaced: bool,
    },
    /// A finished file with the same settings was there.
    Kept,
    /// No file was written.
    Failed(RunError),
}

impl Run<'_> {
    /// The shape coefficients with this index: training shapes first, then held-out ones, then
    /// drawn ones.
    pub fn shape(index: usize) -> [f32; SHAPE_COUNT] {
        let mut named = TRAINING_SHAPES.iter().chain(&HELD_OUT_SHAPES);
        match named.nth(index) {
            Some(shape) => *shape,
            None => drawn_shape(index - shapes::FIRST_DRAWN),
        }
    }

    /// The clips to make of these motions, longest first so that threads end together.
    ///
    /// Each motion and, if wanted, its mirror image is simulated on one training shape drawn by name
    /// and seed; every fourth also on a held-out one, and every second on a further training shape if
    /// these are wanted. Procedural motions, which are few and
    /// mostly symmetric, are simulated on three shapes instead of mirrored.
    ///
    /// # Errors
    /// [`RunError`] if a motion cannot be read or made.
    pub fn plan(&self, motions: &[Motion]) -> Result<Vec<Job>, RunError> {
        let mut jobs = Vec::new();
        let shaped = self.body.shaped(&[0.0; SHAPE_COUNT]);
        for motion in motions {
            let (clip, notes) = motion.clip_and_notes(&shaped.joints_m)?;
            let frames = clip
                .frames
                .len()
                .min(self.limit_frames.unwrap_or(usize::MAX));
            let images: &[bool] = if self.mirrored && matches!(motion, Motion::Capture { .. }) {
                &[false, true]
            } else {
                &[false]
            };
            for &mirrored in images {
                let name = format!("{}{mirrored}", motion.name());
                let draws = if motion.is_procedural() { 3 } else { 1 };
                let further = shapes::draw_further(&name, self.seed);
                let further = further.filter(|_| self.further_shapes);
                let drawn = shapes::draw(&name, self.seed, self.shapes, draws);
                for shape in drawn.into_iter().chain(further) {
                    let mut job = Job {
                        motion: motion.clone(),
                        mirrored,
                        shape,
                        materials: Materials::NOMINAL,
                        rig: RigHabit::NONE,
                        frames,
                        notes: notes.clone(),
                    };
                    job.materials = self.materials(&job.name());
                    if self.vary_rigs && matches!(job.motion, Motion::Capture { .. }) {
                        job.rig = RigHabit::drawn(&job.name(), self.seed);
                    }
                    jobs.push(job);
                }
            }
        }
        jobs.sort_by(|a, b| {
            b.frames
                .cmp(&a.frames)
                .then_with(|| a.name().cmp(&b.name()))
        });
        Ok(jobs)
    }

    fn materials(&self, name: &str) -> Materials {
        let coin = Sha256::digest(format!("varied {} {name}", self.seed))[0];
        if self.vary_materials && coin.is_multiple_of(2) {
            drawn_materials(name, self.seed)
        } else {
            Materials::NOMINAL
        }
    }
}
