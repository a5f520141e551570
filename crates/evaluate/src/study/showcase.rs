//! Single clips: curves over time, and one frame as offsets.

use dynaskin_body::{BodyModel, Pose, SHAPE_COUNT};

use super::Contestant;
use super::groups::Groups;
use dynaskin_train::{ClipEntry, DataSet, TrainError, motion_of, offsets_of};

/// Mean error over the soft vertices, frame by frame.
#[derive(Clone, Debug)]
pub struct ClipCurves {
    /// The clip's name.
    pub name: String,
    /// `[method][frame]` in millimetres.
    pub soft_mm: Vec<Vec<f64>>,
}

/// Plays one clip to all contestants.
///
/// # Errors
/// [`TrainError::Runtime`], and what reading a clip can give.
pub fn curves(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    entry: &ClipEntry,
) -> Result<ClipCurves, TrainError> {
    let clip = data_set.read(entry)?;
    let groups = Groups::new(model, &data_set.vertices);
    let (motion, truth) = (motion_of(&clip), offsets_of(&clip));
    let coordinates = 3 * data_set.vertices.len();
    let mut soft_mm = Vec::new();
    for contestant in contestants {
        let predicted = contestant.predict(model, &motion, &clip)?;
        let frames = truth.chunks_exact(coordinates);
        let frames = frames.zip(predicted.chunks_exact(coordinates));
        let soft = frames.map(|(truth, got)| f64::from(groups.errors_mm(truth, got)[1]));
        soft_mm.push(soft.collect());
    }
    Ok(ClipCurves {
        name: clip.name,
        soft_mm,
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
