//! What goes out: an AMASS-like `.npz`, and clips that `dynaskin train` takes.

use std::path::Path;

use dynaskin_body::{BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_npz::{NpzError, Writer};
use dynaskin_sim::{ClipData, Materials, SimSettings, soft_vertices};
use glam::Vec3;
use half::f16;

use crate::{FitError, FittedFrame, FittedSequence, SequenceFit};

impl SequenceFit<'_> {
    /// Fits all frames and writes them as they come: `poses` [T,72] (axis-angle, radians), `trans` [T,3]
    /// (metres, +Y up), `betas` [10], `mocap_framerate` and `up_axis`, as `dynaskin simulate` reads them,
    /// with `offsets_rest_m` [T,V,3] (Δ in the rest pose, metres), `rigid_distance_m` [T], `rigidity` [V] and
    /// `joint_offsets_m` [24,3] (of the rest joints from where β puts them, metres). The file is written beside and renamed: an error leaves what was there. `done` is as for
    /// [`Self::frames`], and `visit` is called with each frame in its order.
    ///
    /// # Errors
    /// [`FitError::Npz`], and as [`Self::frames`].
    pub fn write_npz(
        &self,
        path: &Path,
        done: impl Fn(usize) + Sync,
        mut visit: impl FnMut(&FittedFrame),
    ) -> Result<(), FitError> {
        let labels = Labels {
            path,
            rate_hz: self.rate_hz(),
            shape: self.shape(),
            joint_offsets_m: self.joint_offsets_m(),
            rigidity: self.rigidity(),
            frame_count: self.frame_count(),
        };
        labels.write(|write| {
            self.frames(done, |frame| {
                visit(&frame);
                write(&frame)
            })
        })
    }
}

/// What a fit's file says beside its frames.
struct Labels<'a> {
    path: &'a Path,
    rate_hz: f64,
    shape: [f32; SHAPE_COUNT],
    joint_offsets_m: [Vec3; JOINT_COUNT],
    rigidity: &'a [f64],
    frame_count: usize,
}

impl Labels<'_> {
    /// Writes the file; `frames` hands on each frame.
    fn write(
        &self,
        frames: impl FnOnce(
            &mut dyn FnMut(&FittedFrame) -> Result<(), FitError>,
        ) -> Result<(), FitError>,
    ) -> Result<(), FitError> {
        let failed = |source: NpzError| FitError::Npz {
            path: self.path.to_owned(),
            source,
        };
        let (mut poses, mut trans) = (Vec::<f64>::new(), Vec::<f64>::new());
        let mut distances: Vec<f32> = Vec::new();
        let mut writer = Writer::create(self.path).map_err(failed)?;
        let shape = [self.frame_count, self.rigidity.len(), 3];
        let written = writer.stream("offsets_rest_m", &shape, |put| {
            frames(&mut |frame: &FittedFrame| {
                let turns = frame.pose.parent_from_joint.iter();
                poses.extend(turns.flat_map(|turn| turn.to_scaled_axis().to_array()));
                trans.extend(frame.pose.root_translation_m.to_array());
                distances.push(frame.rigid_distance_m);
                put(&numbers(&frame.offsets_rest_m)).map_err(failed)
            })
        });
        written.map_err(failed)??;
        let count = self.frame_count;
        let mut rest = || {
            writer.array("poses", &[count, 3 * JOINT_COUNT], &poses)?;
            writer.array("trans", &[count, 3], &trans)?;
            writer.array("betas", &[self.shape.len()], &self.shape)?;
            writer.array("mocap_framerate", &[], &[self.rate_hz])?;
            writer.array("up_axis", &[], &[1_i64])?;
            writer.array("rigid_distance_m", &[count], &distances)?;
            writer.array("rigidity", &[self.rigidity.len()], self.rigidity)?;
            let joint_offsets_m = numbers(&self.joint_offsets_m);
            writer.array("joint_offsets_m", &[JOINT_COUNT, 3], &joint_offsets_m)
        };
        rest().map_err(failed)?;
        writer.finish().map_err(failed)
    }
}

fn numbers(offsets: &[Vec3]) -> Vec<f32> {
    offsets
        .iter()
        .flat_map(|offset| offset.to_array())
        .collect()
}

/// A fitted sequence that becomes a clip of a data set, frame by frame: at 60 Hz, with the offsets of the
/// vertices that simulated clips of this body have, too (all vertices where the body has no soft regions).
/// Between frames, offsets are interpolated in the rest pose, poses as [`Clip::resampled`] does. The
/// offsets of these vertices are held in half precision.
pub struct ClipBuilder {
    rate_hz: f64,
    shape: [f32; SHAPE_COUNT],
    vertices: Vec<u32>,
    poses: Vec<Pose>,
    /// Offsets of the vertices in the frame before.
    before_m: Vec<Vec3>,
    offsets_rest_m: Vec<f16>,
    /// Frames at 60 Hz that are there.
    ticks: usize,
}

impl ClipBuilder {
    /// A clip without frames.
    pub fn new(body: &BodyModel, rate_hz: f64, shape: [f32; SHAPE_COUNT]) -> Self {
        let vertices = if body.region_weights.is_empty() {
            (0..body.vertex_count() as u32).collect()
        } else {
            let threshold = SimSettings::for_body(body).softness_threshold;
            soft_vertices(&body.region_weights, threshold)
        };
        Self {
            rate_hz,
            shape,
            vertices,
            poses: Vec::new(),
            before_m: Vec::new(),
            offsets_rest_m: Vec::new(),
            ticks: 0,
        }
    }

    /// Adds the next frame.
    pub fn push(&mut self, frame: &FittedFrame) {
        let own = self.vertices.iter().map(|&v| v as usize);
        let now_m: Vec<Vec3> = own.map(|vertex| frame.offsets_rest_m[vertex]).collect();
        if self.poses.is_empty() {
            self.before_m.clone_from(&now_m);
        }
        self.poses.push(frame.pose.clone());
        let now = (self.poses.len() - 1) as f64;
        while self.tick_frame() <= now {
            let share = (self.tick_frame() - (now - 1.0)).clamp(0.0, 1.0) as f32;
            self.add_tick(&now_m, share);
        }
        self.before_m = now_m;
    }

    /// The fractional frame at which the next frame at 60 Hz is.
    fn tick_frame(&self) -> f64 {
        self.ticks as f64 / MODEL_RATE_HZ * self.rate_hz
    }

    fn add_tick(&mut self, now_m: &[Vec3], share: f32) {
        for (before, now) in self.before_m.iter().zip(now_m) {
            let offset = before.lerp(*now, share);
            self.offsets_rest_m
                .extend(offset.to_array().map(f16::from_f32));
        }
        self.ticks += 1;
    }

    /// The clip.
    ///
    /// # Errors
    /// [`FitError::Motion`] for a sequence that has no frames or is too long at 60 Hz.
    pub fn finish(mut self, body_sha256: &str, name: &str) -> Result<ClipData, FitError> {
        let motion = Clip {
            name: name.to_owned(),
            rate_hz: self.rate_hz,
            frames: std::mem::take(&mut self.poses),
        };
        let motion = motion.into_resampled(MODEL_RATE_HZ)?;
        // Rounding may put the last one behind the last frame.
        while self.ticks < motion.frames.len() {
            let last_m = self.before_m.clone();
            self.add_tick(&last_m, 1.0);
        }
        self.offsets_rest_m
            .truncate(motion.frames.len() * self.vertices.len() * 3);
        Ok(ClipData {
            name: name.to_owned(),
            body_sha256: body_sha256.to_owned(),
            rate_hz: MODEL_RATE_HZ,
            seed: 0,
            sim_json: "{}".to_owned(),
            shape: self.shape,
            materials: Materials::NOMINAL,
            vertices: self.vertices,
            poses: motion.frames,
            offsets_rest_m: self.offsets_rest_m,
        })
    }
}

impl FittedSequence {
    /// Writes the file of [`SequenceFit::write_npz`].
    ///
    /// # Errors
    /// [`FitError::Npz`].
    pub fn write_npz(&self, path: &Path) -> Result<(), FitError> {
        let labels = Labels {
            path,
            rate_hz: self.rate_hz,
            shape: self.shape,
            joint_offsets_m: self.joint_offsets_m,
            rigidity: &self.rigidity,
            frame_count: self.frames.len(),
        };
        labels.write(|write| self.frames.iter().try_for_each(write))
    }

    /// The sequence as a clip of a data set: see [`ClipBuilder`].
    ///
    /// # Errors
    /// As [`ClipBuilder::finish`].
    pub fn clip_data(
        &self,
        body: &BodyModel,
        body_sha256: &str,
        name: &str,
    ) -> Result<ClipData, FitError> {
        let mut clip = ClipBuilder::new(body, self.rate_hz, self.shape);
        for frame in &self.frames {
            clip.push(frame);
        }
        clip.finish(body_sha256, name)
    }
}
