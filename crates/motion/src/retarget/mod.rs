//! Retargets the motion of a file's skeleton to the body's.
//!
//! Rest poses differ: the sources stand in a T-pose, often with spread legs, the body in an A-pose.
//! Per joint a constant alignment takes the body's rest bone to the source's; then the source's
//! world rotation at each frame, times the alignment, is the body's. Limbs point where the source's
//! point; the trunk bends as the source's does; the feet keep their soles where the source's are.

mod align;
mod evidence;
mod floor;
mod mapping;
mod names;
mod posing;
mod reading;
mod sides;
mod skeleton;
mod source;
mod up;
mod vocabulary;

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::Vec3;

use crate::{Clip, MotionError};
use align::{Alignment, SoleReference};
use evidence::Evidence;
#[cfg(feature = "amass")]
pub(crate) use floor::put_on_floor;
pub use mapping::{Drive, JointReport, LengthUnit, Mapping};
use posing::poses;
use sides::Facing;
use skeleton::{Source, leg_length};
pub use source::{SourceMotion, World};

/// Retargets the motion of a file's skeleton to a skeleton with these rest joint positions (metres).
///
/// The clip keeps the file's frame rate ([`Clip::resampled`] changes it) and has an empty name. The
/// pelvis starts at x = z = 0; standing soles are on y = 0 (single frames may lie lower).
/// Translations are scaled by the ratio of the leg lengths.
///
/// # Errors
/// [`MotionError::MissingJoints`] where the names do not show a person,
/// [`MotionError::Degenerate`] where bones have no length, [`MotionError::TooFar`] where the root is
/// more than 10 km from the origin, [`MotionError::TooMuch`] for more than 10 million rotations.
pub fn retarget(
    motion: &dyn SourceMotion,
    target_joints_m: &[Vec3; JOINT_COUNT],
) -> Result<(Clip, JointReport), MotionError> {
    retarget_watched(motion, target_joints_m, &mut |_| {})
}

/// As [`retarget`]; `progress` receives the fraction that is done, 0 to 1.
///
/// # Errors
/// As [`retarget`].
pub fn retarget_watched(
    motion: &dyn SourceMotion,
    target_joints_m: &[Vec3; JOINT_COUNT],
    progress: &mut dyn FnMut(f64),
) -> Result<(Clip, JointReport), MotionError> {
    let mut notes = Vec::new();
    let mut mapping = Mapping::new(motion)?;
    let mut source = upright(motion, &mapping);
    let mut evidence = Evidence::new(&source);
    let facing = Facing::new(&source, &evidence);
    notes.extend(facing.note().map(str::to_owned));
    if matches!(facing, Facing::Back) {
        mapping = mapping.mirrored();
        source = upright(motion, &mapping);
        evidence = Evidence::new(&source);
    }
    notes.extend(source.note.map(str::to_owned));
    check_work(&source)?;
    let target_m = target_joints_m.map(|joint| joint.as_dvec3());
    let source_leg = source.leg_length();
    let target_leg_m = leg_length(&target_m);
    check_leg("source", source_leg)?;
    check_leg("target", target_leg_m)?;
    let scale = target_leg_m / source_leg;

    // Whether the source's feet in the rest pose stand on the floor or turn with spread legs is
    // not written anywhere: what keeps the soles flatter is right.
    let mut flattest: Option<(f64, Alignment, Vec<String>)> = None;
    let every = motion.frame_count().div_ceil(MAX_JUDGED_FRAMES);
    for reference in [SoleReference::Floor, SoleReference::Shin] {
        let (alignment, said) = Alignment::new(&source, &evidence, &target_m, reference)?;
        let frames = poses(&source, &alignment, &target_m, scale, every, &mut |_| {});
        let tilt = floor::sole_tilt(&frames, motion.frame_seconds(), target_joints_m);
        if flattest.as_ref().is_none_or(|(least, ..)| tilt < *least) {
            flattest = Some((tilt, alignment, said));
        }
    }
    let Some((_, mut alignment, said)) = flattest else {
        return Err(MotionError::EmptyClip);
    };
    notes.extend(said);
    // Rest feet are not drawn exactly flat either: standing feet show by how much. Long files fill
    // a hundred megabytes with poses, so these are gone before the next ones are made, and of very long
    // ones every few frames tell.
    let standing_pitch = {
        let mut half = |done: f64| progress(0.5 * done);
        let every = motion.frame_count().div_ceil(MAX_STANDING_FRAMES);
        let seconds = motion.frame_seconds() * every as f64;
        let frames = poses(&source, &alignment, &target_m, scale, every, &mut half);
        if floor::ever_stands(&frames, seconds, target_joints_m) {
            floor::standing_pitch(&frames, seconds, target_joints_m)
        } else {
            notes.push("nobody stands in the file: the pitch of the feet is as drawn".to_owned());
            [0.0; 2]
        }
    };
    alignment.pitch_soles(standing_pitch);
    let mut half = |done: f64| progress(0.5 + 0.5 * done);
    let mut frames = poses(&source, &alignment, &target_m, scale, 1, &mut half);
    floor::put_on_floor(&mut frames, motion.frame_seconds(), target_joints_m);
    check_distance(&frames)?;
    let report = JointReport::new(motion, &mapping, source_leg, scale, notes);
    let clip = Clip {
        name: String::new(),
        rate_hz: 1.0 / motion.frame_seconds(),
        frames,
    };
    Ok((clip, report))
}

/// The file's skeleton with +Y up.
fn upright<'a>(motion: &'a dyn SourceMotion, mapping: &Mapping) -> Source<'a> {
    let source = Source::new(motion, mapping);
    let (up_from_file, note) = up::find_up(&source);
    source.turned(up_from_file, note)
}

/// Most frames times joints that are needed of each: 45 minutes at 60 Hz of a rig in which 61 joints
/// stand between the root and a person's hands, feet and head. Small files can ask for far more: two
/// keys an hour apart and thousands of nodes.
const MAX_ROTATIONS: usize = 10_000_000;

fn check_work(source: &Source<'_>) -> Result<(), MotionError> {
    let (frames, joints) = (source.motion.frame_count(), source.needed.len());
    if frames.saturating_mul(joints) > MAX_ROTATIONS {
        return Err(MotionError::TooMuch {
            frames,
            joints,
            limit: MAX_ROTATIONS,
        });
    }
    Ok(())
}

/// Frames that the pitch of standing feet comes from, at most: eight minutes at 60 Hz.
const MAX_STANDING_FRAMES: usize = 30_000;

/// Frames that the choice between two rest poses of the feet looks at, at most.
const MAX_JUDGED_FRAMES: usize = 2_000;

/// Farthest way from the start in metres: no capture leads there, and farther away the single
/// precision of a skinned surface gets coarse.
const MAX_DISTANCE_M: f64 = 1e4;

fn check_distance(frames: &[Pose]) -> Result<(), MotionError> {
    let far = frames.iter().enumerate().find_map(|(frame, pose)| {
        let distance_m = pose.root_translation_m.length();
        let is_near = distance_m.is_finite() && distance_m <= MAX_DISTANCE_M;
        (!is_near).then_some((frame, distance_m))
    });
    match far {
        None => Ok(()),
        Some((frame, distance_m)) => Err(MotionError::TooFar {
            frame: frame + 1,
            distance_m,
            limit_m: MAX_DISTANCE_M,
        }),
    }
}

fn check_leg(skeleton: &'static str, leg: f64) -> Result<(), MotionError> {
    if leg > 1e-6 && leg.is_finite() {
        Ok(())
    } else {
        Err(MotionError::Degenerate {
            skeleton,
            problem: format!("the left leg has length {leg}, expected more than 0"),
        })
    }
}
