//! Long motion and rest: whether predictions drift, and whether they settle.

use dynaskin_body::{BodyModel, Pose};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_sim::ClipData;

use super::groups::Groups;
use super::{Contestant, mean};
use dynaskin_train::{ClipEntry, DataSet, TrainError, features_of, motion_of, offsets_of};

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
/// end to the next start, and compares the first minute with the last: as many whole passes as a
/// minute holds, so that both hold the same frames. The truth of each pass is the clip's own, but for
/// its first second. `progress` is told methods done and in all.
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
    let pass = looped(&motion_of(&clip));
    let passes = Passes::over(minutes, pass.frames.len());
    let mut motion = pass.clone();
    motion.frames = std::iter::repeat_n(&pass.frames, passes.all)
        .flatten()
        .cloned()
        .collect();
    let truth = Truth {
        offsets_m: &offsets_of(&clip),
        groups: &Groups::new(model, &data_set.vertices),
        coordinates: 3 * data_set.vertices.len(),
    };
    let still = vec![0.0; truth.coordinates];
    let all = contestants.len();
    let mut drifts = Vec::new();
    for contestant in contestants {
        drifts.push(match &mut contestant.player {
            None => truth.drift(passes, |wanted, see| {
                let ticks = (0..passes.all * passes.ticks).filter(|tick| wanted(*tick));
                ticks.for_each(|tick| see(tick, &still));
                Ok(())
            })?,
            Some(player) => {
                let features = features_of(player.feature_kind(), model, &motion, &clip)?;
                truth.drift(passes, |wanted, see| player.visit(&features, wanted, see))?
            }
        });
        progress(drifts.len(), all);
    }
    Ok(drifts)
}

/// The passes of a clip that a run of some minutes is made of.
#[derive(Clone, Copy, Debug)]
struct Passes {
    /// Length of one, with the way back to its start.
    ticks: usize,
    /// How many the first and the last minute hold: as many as fit into one, and at least one.
    a_minute: usize,
    /// How many there are: the last ends no earlier than the last minute.
    all: usize,
}

impl Passes {
    fn over(minutes: usize, ticks: usize) -> Self {
        let a_minute = (MINUTE_TICKS / ticks).max(1);
        Self {
            ticks,
            a_minute,
            all: (minutes * MINUTE_TICKS).div_ceil(ticks).max(2 * a_minute),
        }
    }

    /// 0 in the first minute, 1 in the last, none between them.
    fn end(self, tick: usize) -> Option<usize> {
        let pass = tick / self.ticks;
        match (pass < self.a_minute, pass + self.a_minute >= self.all) {
            (true, _) => Some(0),
            (_, true) => Some(1),
            _ => None,
        }
    }
}

/// A clip's own offsets, `[frame][slot][xyz]` flat in metres.
struct Truth<'a> {
    offsets_m: &'a [f32],
    groups: &'a Groups,
    coordinates: usize,
}

impl Truth<'_> {
    /// Measures what `play` shows: it is given the ticks that are wanted, and what is to see their
    /// offsets.
    fn drift(
        &self,
        passes: Passes,
        play: impl FnOnce(
            &dyn Fn(usize) -> bool,
            &mut dyn FnMut(usize, &[f32]),
        ) -> Result<(), TrainError>,
    ) -> Result<Drift, TrainError> {
        let known = LEAD_TICKS..self.offsets_m.len() / self.coordinates;
        let wanted =
            |tick: usize| passes.end(tick).is_some() && known.contains(&(tick % passes.ticks));
        let still = vec![0.0; self.coordinates];
        let (mut offset_mm, mut error_mm) = ([0.0; 2], [0.0; 2]);
        let mut frames = [0usize; 2];
        play(&wanted, &mut |tick, predicted| {
            let Some(end) = passes.end(tick) else {
                return;
            };
            let start = (tick % passes.ticks) * self.coordinates;
            let truth = &self.offsets_m[start..start + self.coordinates];
            offset_mm[end] += f64::from(self.groups.errors_mm(predicted, &still)[1]);
            error_mm[end] += f64::from(self.groups.errors_mm(truth, predicted)[1]);
            frames[end] += 1;
        })?;
        let per = |sums: [f64; 2]| [0, 1].map(|end| sums[end] / frames[end].max(1) as f64);
        Ok(Drift {
            offset_mm: per(offset_mm),
            error_mm: per(error_mm),
        })
    }
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
        // What is not a number has not settled.
        let moving = offset_mm
            .iter()
            .rposition(|x| x.is_nan() || *x >= SETTLED_MM);
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
    use dynaskin_train::fixture;

    #[test]
    fn drift_is_seen_in_clips_that_do_not_divide_a_minute() {
        const MINUTES: usize = 4;
        const MM_PER_TICK: f64 = 1e-3;
        let model = fixture::symmetric_body(2);
        let groups = Groups::new(&model, &[0, 1, 2, 3]);
        for frames in [61, 200, 481, 1000, 3000, 5000, 9000] {
            let truth = Truth {
                offsets_m: &vec![0.0; 12 * frames],
                groups: &groups,
                coordinates: 12,
            };
            let passes = Passes::over(MINUTES, frames + BRIDGE_TICKS - 1);
            // An error along x that grows tick by tick.
            let mut seen = Vec::new();
            let drift = truth.drift(passes, |wanted, see| {
                for tick in (0..passes.all * passes.ticks).filter(|tick| wanted(*tick)) {
                    let x_m = (1e-3 * MM_PER_TICK * tick as f64) as f32;
                    see(tick, &[x_m, 0.0, 0.0].repeat(4));
                    seen.push(tick);
                }
                Ok(())
            });
            let [first, last] = drift.expect("a drift").error_mm;
            let apart_ticks = (last - first) / MM_PER_TICK;

            // Both ends hold the same frames of the clip, as many times.
            let frame = |tick: &usize| tick % passes.ticks;
            let half = seen.len() / 2;
            let (early, late) = (seen[..half].iter(), seen[half..].iter());
            assert!(early.map(frame).eq(late.map(frame)), "{frames} frames");
            assert_eq!(frame(&seen[0]), LEAD_TICKS);
            let shift = (seen[half] - seen[0]) as f64;
            assert!((apart_ticks - shift).abs() < 1.0, "{frames}: {apart_ticks}");
            // They lie as far apart as the first and the last minute, give or take two passes.
            let minutes_apart = ((MINUTES - 1) * MINUTE_TICKS) as f64;
            assert!(
                (shift - minutes_apart).abs() <= 2.0 * passes.ticks as f64,
                "{frames}"
            );
            assert!(seen[half - 1] < MINUTE_TICKS.max(passes.ticks), "{frames}");
            assert!(seen[half] >= (MINUTES - 1) * MINUTE_TICKS || passes.ticks > MINUTE_TICKS);
        }
    }

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
