//! Long motion and rest: whether predictions drift, and whether they settle.

use dynaskin_body::{BodyModel, Pose};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_sim::ClipData;

use super::groups::Groups;
use super::{Contestant, mean};
use crate::TrainError;
use crate::data::{ClipEntry, DataSet, features_of, motion_of, offsets_of};

/// Length of the way from the last pose of a motion to the next one, in ticks.
const BRIDGE_TICKS: usize = 45;
/// Frames at the start of each pass that do not count: tissue remembers the bridge, which was not
/// simulated.
const LEAD_TICKS: usize = 60;
/// Frames a minute.
const MINUTE_TICKS: usize = 3600;
/// How long a body stands still.
const REST_TICKS: usize = 600;
/// A body counts as settled below this mean offset of its soft vertices.
const SETTLED_MM: f64 = 0.1;

/// A method over minutes of continuous motion, in millimetres over the soft vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Mean length of the predicted offsets in the first and in the last minute.
    pub offset_mm: [f64; 2],
    /// Mean error in the first and in the last minute.
    pub error_mm: [f64; 2],
}

/// Plays a held-out clip again and again for `minutes` (at least two), with a smooth way from each
/// end to the next start, and compares the first minute with the last (in whole passes). The truth of each pass is the
/// clip's own, but for its first second. `progress` is told methods done and in all.
///
/// # Errors
/// [`TrainError::Config`] for a clip that is too short; [`TrainError::Runtime`], and what reading a
/// clip can give.
pub fn drift(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    entry: &ClipEntry,
    minutes: usize,
    mut progress: impl FnMut(usize, usize),
) -> Result<Vec<Drift>, TrainError> {
    let clip = data_set.read(entry)?;
    if clip.frame_count() <= LEAD_TICKS || minutes < 2 {
        return Err(TrainError::Config {
            setting: "drift",
            got: format!("{} frames over {minutes} minutes", clip.frame_count()),
            expected: format!("a clip of more than {LEAD_TICKS} frames and two minutes or more"),
        });
    }
    let (truth, groups) = (offsets_of(&clip), Groups::new(model, &data_set.vertices));
    let pass = looped(&motion_of(&clip));
    // Minutes of whole passes, so that the first and the last hold the same frames.
    let per_minute = (MINUTE_TICKS / pass.frames.len()).max(1);
    let passes = minutes * per_minute;
    let ticks = passes * pass.frames.len();
    let coordinates = 3 * data_set.vertices.len();
    let still = vec![0.0; coordinates];
    let counts = |tick: usize| {
        let frame = tick % pass.frames.len();
        let minute = tick / MINUTE_TICKS;
        (minute == 0 || minute + 1 == minutes) && (LEAD_TICKS..clip.frame_count()).contains(&frame)
    };
    let all = contestants.len();
    let mut drifts = Vec::new();
    for contestant in contestants {
        let (mut offset_mm, mut error_mm) = ([0.0; 2], [0.0; 2]);
        let mut frames = [0usize; 2];
        let mut add = |tick: usize, predicted: &[f32]| {
            let frame = tick % pass.frames.len();
            let end = usize::from(tick / pass.frames.len() >= per_minute);
            let truth = &truth[frame * coordinates..(frame + 1) * coordinates];
            offset_mm[end] += f64::from(groups.errors_mm(predicted, &still)[1]);
            error_mm[end] += f64::from(groups.errors_mm(truth, predicted)[1]);
            frames[end] += 1;
        };
        match &mut contestant.player {
            None => (0..ticks)
                .filter(|tick| counts(*tick))
                .for_each(|tick| add(tick, &still)),
            Some(player) => {
                let mut motion = pass.clone();
                motion.frames = (0..ticks)
                    .map(|tick| pass.frames[tick % pass.frames.len()].clone())
                    .collect();
                let features = features_of(player.feature_kind(), model, &motion, &clip)?;
                player.visit(&features, counts, add)?;
            }
        }
        let per = |sums: [f64; 2]| [0, 1].map(|end| sums[end] / frames[end].max(1) as f64);
        drifts.push(Drift {
            offset_mm: per(offset_mm),
            error_mm: per(error_mm),
        });
        progress(drifts.len(), all);
    }
    Ok(drifts)
}

/// A method's body coming to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Settling {
    /// Mean length of the soft vertices' offsets in millimetres, tick by tick from the moment the
    /// rest pose is reached.
    pub offset_mm: Vec<f64>,
    /// Seconds until it stays below a tenth of a millimetre; none where it does not.
    pub seconds: Option<f64>,
}

/// Plays a clip, moves smoothly into the rest pose and stands there for ten seconds.
///
/// # Errors
/// [`TrainError::Runtime`], and what reading a clip can give.
pub fn settling(
    contestants: &mut [Contestant],
    data_set: &DataSet,
    model: &BodyModel,
    entry: &ClipEntry,
) -> Result<Vec<Settling>, TrainError> {
    let clip: ClipData = data_set.read(entry)?;
    let groups = Groups::new(model, &data_set.vertices);
    let mut motion = motion_of(&clip);
    let last = motion.frames[motion.frames.len() - 1].clone();
    let rest = Pose {
        root_translation_m: last.root_translation_m,
        ..Pose::REST
    };
    motion.frames.extend(bridge(&last, &rest));
    let start = motion.frames.len();
    motion.frames.extend(std::iter::repeat_n(rest, REST_TICKS));
    let coordinates = 3 * data_set.vertices.len();
    let still = vec![0.0; coordinates];
    let mut all = Vec::new();
    for contestant in contestants {
        let mut offset_mm = Vec::with_capacity(REST_TICKS);
        match &mut contestant.player {
            None => offset_mm.resize(REST_TICKS, 0.0),
            Some(player) => {
                let features = features_of(player.feature_kind(), model, &motion, &clip)?;
                player.visit(
                    &features,
                    |tick| tick >= start,
                    |_, offsets| offset_mm.push(f64::from(groups.errors_mm(offsets, &still)[1])),
                )?;
            }
        }
        let moving = offset_mm.iter().rposition(|x| *x >= SETTLED_MM);
        let seconds = match moving {
            None => Some(0.0),
            Some(tick) if tick + 1 < offset_mm.len() => Some((tick + 1) as f64 / MODEL_RATE_HZ),
            Some(_) => None,
        };
        all.push(Settling { offset_mm, seconds });
    }
    Ok(all)
}

/// A motion with the way back to its start.
fn looped(motion: &Clip) -> Clip {
    let mut looped = motion.clone();
    if let (Some(first), Some(last)) = (motion.frames.first(), motion.frames.last()) {
        looped.frames.extend(bridge(last, first));
    }
    looped
}

/// Poses between two, both left out, that start and end slowly.
fn bridge(from: &Pose, to: &Pose) -> Vec<Pose> {
    let steps = BRIDGE_TICKS as f64;
    let at = |tick: usize| {
        let t = tick as f64 / steps;
        let share = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        let mut pose = from.clone();
        pose.root_translation_m = from.root_translation_m.lerp(to.root_translation_m, share);
        for (joint, rotation) in pose.parent_from_joint.iter_mut().enumerate() {
            let (a, mut b) = (from.parent_from_joint[joint], to.parent_from_joint[joint]);
            if a.dot(b) < 0.0 {
                b = -b;
            }
            *rotation = a.slerp(b, share).normalize();
        }
        pose
    };
    (1..BRIDGE_TICKS).map(at).collect()
}

impl Settling {
    /// Mean offset in the last second, in millimetres.
    pub fn end_mm(&self) -> f64 {
        mean(self.offset_mm.iter().rev().take(60).copied())
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;

    #[test]
    fn a_bridge_leads_from_one_pose_to_the_other_without_a_jolt() {
        let from = Pose::REST;
        let mut to = Pose::REST;
        to.root_translation_m = DVec3::new(0.4, 0.0, 0.0);
        to.parent_from_joint[3] = -DQuat::from_rotation_x(0.8);
        let mut poses = vec![from.clone()];
        poses.extend(bridge(&from, &to));
        poses.push(to.clone());
        let x: Vec<f64> = poses.iter().map(|pose| pose.root_translation_m.x).collect();
        let largest_m_s2 = x
            .windows(3)
            .map(|x| (x[0] - 2.0 * x[1] + x[2]).abs() * 3600.0);
        assert!(largest_m_s2.fold(0.0, f64::max) < 5.0);
        // The short way round, though the quaternions lie on opposite sides.
        let turn = |pose: &Pose| pose.parent_from_joint[3].angle_between(DQuat::IDENTITY);
        assert!(
            poses[1..poses.len() - 1]
                .iter()
                .all(|pose| turn(pose) <= 0.8 + 1e-9)
        );
        assert!(poses.iter().all(Pose::is_valid));
        assert_eq!(x[0], 0.0);
        assert_eq!(x[x.len() - 1], 0.4);
    }
}
