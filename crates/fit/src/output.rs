//! What goes out: an AMASS-like `.npz`, and clips that `dynaskin train` takes.

use std::path::Path;

use dynaskin_body::{BodyModel, JOINT_COUNT};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_npz::Writer;
use dynaskin_sim::{ClipData, Materials, SimSettings, soft_vertices};
use glam::Vec3;
use half::f16;

use crate::{FitError, FittedSequence};

impl FittedSequence {
    /// The poses as a motion.
    pub fn motion(&self, name: &str) -> Clip {
        Clip {
            name: name.to_owned(),
            rate_hz: self.rate_hz,
            frames: self.frames.iter().map(|frame| frame.pose.clone()).collect(),
        }
    }

    /// Writes `poses` [T,72] (axis-angle, radians), `trans` [T,3] (metres, +Y up), `betas` [10],
    /// `mocap_framerate` and `up_axis`, as `dynaskin simulate` reads them, with `offsets_rest_m`
    /// [T,V,3] (Δ in the rest pose, metres), `rigid_distance_m` [T] and `rigidity` [V]. The file is
    /// written beside and renamed.
    ///
    /// # Errors
    /// [`FitError::Npz`].
    pub fn write_npz(&self, path: &Path) -> Result<(), FitError> {
        self.npz(path).map_err(|source| FitError::Npz {
            path: path.to_owned(),
            source,
        })
    }

    fn npz(&self, path: &Path) -> Result<(), dynaskin_npz::NpzError> {
        let count = self.frames.len();
        let poses: Vec<f64> = self
            .frames
            .iter()
            .flat_map(|frame| frame.pose.parent_from_joint)
            .flat_map(|turn| turn.to_scaled_axis().to_array())
            .collect();
        let trans: Vec<f64> = self
            .frames
            .iter()
            .flat_map(|frame| frame.pose.root_translation_m.to_array())
            .collect();
        let offsets: Vec<f32> = self
            .frames
            .iter()
            .flat_map(|frame| &frame.offsets_rest_m)
            .flat_map(|offset| offset.to_array())
            .collect();
        let distances: Vec<f32> = self.frames.iter().map(|f| f.rigid_distance_m).collect();
        let vertices = self.rigidity.len();
        let mut writer = Writer::create(path)?;
        writer.array("poses", &[count, 3 * JOINT_COUNT], &poses)?;
        writer.array("trans", &[count, 3], &trans)?;
        writer.array("betas", &[self.shape.len()], &self.shape)?;
        writer.array("mocap_framerate", &[], &[self.rate_hz])?;
        writer.array("up_axis", &[], &[1_i64])?;
        writer.array("offsets_rest_m", &[count, vertices, 3], &offsets)?;
        writer.array("rigid_distance_m", &[count], &distances)?;
        writer.array("rigidity", &[vertices], &self.rigidity)?;
        writer.finish()
    }

    /// The sequence as a clip of a data set: at 60 Hz, with the offsets of the vertices that
    /// simulated clips of this body have, too (all vertices where the body has no soft regions).
    /// Between frames, offsets are interpolated in the rest pose, poses as [`Clip::resampled`] does.
    ///
    /// # Errors
    /// [`FitError::Motion`] for a sequence that is too long at 60 Hz.
    pub fn clip_data(
        &self,
        body: &BodyModel,
        body_sha256: &str,
        name: &str,
    ) -> Result<ClipData, FitError> {
        let motion = self.motion(name).resampled(MODEL_RATE_HZ)?;
        let vertices = if body.region_weights.is_empty() {
            (0..body.vertex_count() as u32).collect()
        } else {
            let threshold = SimSettings::for_body(body).softness_threshold;
            soft_vertices(&body.region_weights, threshold)
        };
        let mut offsets_rest_m = Vec::with_capacity(motion.frames.len() * vertices.len() * 3);
        for frame in 0..motion.frames.len() {
            let at = frame as f64 / MODEL_RATE_HZ * self.rate_hz;
            for &vertex in &vertices {
                let offset = self.offset_at(at, vertex as usize);
                offsets_rest_m.extend(offset.to_array().map(f16::from_f32));
            }
        }
        Ok(ClipData {
            name: name.to_owned(),
            body_sha256: body_sha256.to_owned(),
            rate_hz: MODEL_RATE_HZ,
            seed: 0,
            sim_json: "{}".to_owned(),
            shape: self.shape,
            materials: Materials::NOMINAL,
            vertices,
            poses: motion.frames,
            offsets_rest_m,
        })
    }

    /// The offset of a vertex at a fractional frame, clamped to the sequence.
    fn offset_at(&self, frame: f64, vertex: usize) -> Vec3 {
        let last = self.frames.len() - 1;
        let before = (frame.floor() as usize).min(last);
        let after = (before + 1).min(last);
        let offset = |frame: usize| self.frames[frame].offsets_rest_m[vertex];
        offset(before).lerp(offset(after), (frame - before as f64) as f32)
    }
}
