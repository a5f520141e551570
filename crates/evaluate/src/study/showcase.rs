//! Single clips: curves over time, and one frame as offsets.

use dynaskin_body::{BodyModel, Pose, SHAPE_COUNT};

use super::contestant::Contestant;
use super::groups::{Groups, SOFT};
use dynaskin_train::{ClipEntry, DataSet, TrainError, motion_of, offsets_of};

/// Mean errors frame by frame.
#[derive(Clone, Debug)]
pub struct ClipCurves {
    /// The clip's name.
    pub name: String,
    /// `[method][frame][group]` in millimetres; groups by [`super::group_names`].
    errors_mm: Vec<Vec<Vec<f32>>>,
}

impl ClipCurves {
    /// Frame by frame the error of a method over a group of vertices, in millimetres; NaN for a group without
    /// vertices.
    pub fn of_group_mm(&self, method: usize, group: usize) -> Vec<f64> {
        let frames = self.errors_mm[method].iter();
        frames.map(|errors| f64::from(errors[group])).collect()
    }

    /// The errors of all methods over the soft vertices, `[method][frame]`.
    pub fn soft_mm(&self) -> Vec<Vec<f64>> {
        let methods = 0..self.errors_mm.len();
        methods
            .map(|method| self.of_group_mm(method, SOFT))
            .collect()
    }
}

/// Plays one clip to all contestants. `done` is called after each.
///
/// # Errors
/// [`TrainError::Runtime`], and what reading a clip can give.
pub fn curves(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    entry: &ClipEntry,
    mut done: impl FnMut(),
) -> Result<ClipCurves, TrainError> {
    let clip = data_set.read(entry)?;
    let groups = Groups::new(model, &data_set.vertices);
    let (motion, truth) = (motion_of(&clip), offsets_of(&clip));
    let coordinates = 3 * data_set.vertices.len();
    let mut errors_mm = Vec::new();
    for contestant in contestants {
        let predicted = contestant.predict(model, &motion, &clip)?;
        let frames = truth.chunks_exact(coordinates);
        let frames = frames.zip(predicted.chunks_exact(coordinates));
        let errors = frames.map(|(truth, got)| groups.errors_mm(truth, got));
        errors_mm.push(errors.collect());
        done();
    }
    Ok(ClipCurves {
        name: clip.name,
        errors_mm,
    })
}

/// One frame of a clip.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The clip's name.
    pub name: String,
    /// The frame's pose.
    pub pose: Pose,
    /// The body's shape.
    pub shape: [f32; SHAPE_COUNT],
    /// Simulated offsets `[slot][xyz]` in metres.
    pub truth_m: Vec<f32>,
    /// Predicted ones, one a method.
    pub predicted_m: Vec<Vec<f32>>,
}

/// What all contestants make of frame `frame` of a clip, having seen the frames before.
///
/// # Errors
/// [`TrainError::Runtime`], and what reading a clip can give.
pub fn snapshot(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    entry: &ClipEntry,
    frame: usize,
) -> Result<Snapshot, TrainError> {
    let clip = data_set.read(entry)?;
    let mut motion = motion_of(&clip);
    let frame = frame.min(motion.frames.len() - 1);
    motion.frames.truncate(frame + 1);
    let coordinates = 3 * data_set.vertices.len();
    let mut predicted_m = Vec::new();
    for contestant in contestants {
        let all = contestant.predict(model, &motion, &clip)?;
        predicted_m.push(all[frame * coordinates..].to_vec());
    }
    Ok(Snapshot {
        pose: clip.poses[frame].clone(),
        shape: clip.shape,
        truth_m: offsets_of(&clip)[frame * coordinates..(frame + 1) * coordinates].to_vec(),
        predicted_m,
        name: clip.name,
    })
}
