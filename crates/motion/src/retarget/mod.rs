//! Motion of a file's skeleton carried over to the body's.
//!
//! Rest poses differ: the sources stand in a T-pose, often with spread legs, the body in an A-pose.
//! Per joint a constant alignment takes the body's rest bone to the source's; then the source's
//! world rotation at each frame, times the alignment, is the body's. Limbs point where the source's
//! point; the trunk bends as the source's does; the feet keep their soles where the source's are.

mod align;
mod floor;
mod mapping;
mod names;
mod source;
mod vocabulary;

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3, Vec3};

use crate::{Clip, MotionError};
use align::{Alignment, SoleReference};
#[cfg(feature = "amass")]
pub(crate) use floor::put_on_floor;
use mapping::{Drive, Mapping};
pub use mapping::{JointReport, LengthUnit};
pub use source::SourceMotion;

/// Carries the motion of a file's skeleton over to a skeleton with these rest joint positions (metres).
///
/// The clip keeps the file's frame rate ([`Clip::resampled`] changes it) and has an empty name. The
/// pelvis starts at x = z = 0; standing soles are on y = 0 (single frames may lie lower).
/// Translations are scaled by the ratio of the leg lengths.
///
/// # Errors
/// [`MotionError::MissingJoints`] where the names do not show a person,
/// [`MotionError::Degenerate`] where bones have no length, [`MotionError::TooFar`] where the body
/// leaves for another country.
pub fn retarget(
    motion: &dyn SourceMotion,
    target_joints_m: &[Vec3; JOINT_COUNT],
) -> Result<(Clip, JointReport), MotionError> {
    let mapping = Mapping::new(motion)?;
    let source = Source::new(motion, &mapping);
    let target_m = target_joints_m.map(|joint| joint.as_dvec3());
    let source_leg = source.leg_length();
    let target_leg_m = leg_length(&target_m);
    check_leg("source", source_leg)?;
    check_leg("target", target_leg_m)?;
    let scale = target_leg_m / source_leg;

    // Whether the source's feet in the rest pose stand on the floor or turn with spread legs is
    // not written anywhere: what keeps the soles flatter is right.
    let mut flattest: Option<(f64, Alignment)> = None;
    let every = motion.frame_count().div_ceil(MAX_JUDGED_FRAMES);
    for reference in [SoleReference::Floor, SoleReference::Shin] {
        let alignment = Alignment::new(&source, &target_m, reference)?;
        let frames = source.poses(&alignment, &target_m, scale, every);
        let tilt = floor::sole_tilt(&frames, motion.frame_seconds(), target_joints_m);
        if flattest.as_ref().is_none_or(|(least, _)| tilt < *least) {
            flattest = Some((tilt, alignment));
        }
    }
    let Some((_, mut alignment)) = flattest else {
        return Err(MotionError::EmptyClip);
    };
    // Rest feet are not drawn exactly flat either: standing feet show by how much. Long files fill
    // hundreds of megabytes with poses, so these are gone before the next ones are made.
    let standing_pitch = {
        let frames = source.poses(&alignment, &target_m, scale, 1);
        floor::standing_pitch(&frames, motion.frame_seconds(), target_joints_m)
    };
    alignment.pitch_soles(standing_pitch);
    let mut frames = source.poses(&alignment, &target_m, scale, 1);
    floor::put_on_floor(&mut frames, motion.frame_seconds(), target_joints_m);
    check_distance(&frames)?;
    let report = JointReport::new(motion, &mapping, source_leg, scale);
    let clip = Clip {
        name: String::new(),
        rate_hz: 1.0 / motion.frame_seconds(),
        frames,
    };
    Ok((clip, report))
}

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

/// Hip to knee to ankle on the left.
fn leg_length(rest: &[DVec3; JOINT_COUNT]) -> f64 {
    let [hip, knee, ankle] =
        [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle].map(|joint| rest[joint as usize]);
    hip.distance(knee) + knee.distance(ankle)
}

/// A source skeleton with +Y up.
struct Source<'a> {
    motion: &'a dyn SourceMotion,
    mapping: &'a Mapping,
    /// Rest positions turned to +Y up, file unit.
    rest: Vec<DVec3>,
    /// Takes the file's axes to +Y up.
    up_from_file: DQuat,
}

impl<'a> Source<'a> {
    fn new(motion: &'a dyn SourceMotion, mapping: &'a Mapping) -> Self {
        let mut source = Self {
            motion,
            mapping,
            rest: motion.rest_positions(),
            up_from_file: DQuat::IDENTITY,
        };
        if source.is_z_up() {
            source.up_from_file = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
            for position in &mut source.rest {
                *position = source.up_from_file * *position;
            }
        }
        source
    }

    fn source_joint(&self, joint: Joint) -> usize {
        self.mapping.source(joint).unwrap_or(0)
    }

    /// From the middle of the knees to the middle of the shoulders: up, for somebody standing.
    fn trunk(&self, position: impl Fn(usize) -> DVec3) -> DVec3 {
        let at = |joint| position(self.source_joint(joint));
        at(Joint::LeftShoulder) + at(Joint::RightShoulder)
            - at(Joint::LeftKnee)
            - at(Joint::RightKnee)
    }

    /// Whether the file's up is +Z: the rest pose stands along it and, on average, the motion does.
    fn is_z_up(&self) -> bool {
        let rest = self.trunk(|joint| self.rest[joint]);
        if rest.z <= rest.y.abs() {
            return false;
        }
        let count = self.motion.frame_count();
        let mean: DVec3 = (0..count)
            .step_by(count.div_ceil(50))
            .map(|frame| {
                let world = self.motion.world_joints(frame);
                self.trunk(|joint| world[joint].1).normalize_or_zero()
            })
            .sum();
        mean.z > mean.y.abs()
    }

    /// Rest position of the source joint of `joint`.
    fn rest_of(&self, joint: Joint) -> Option<DVec3> {
        Some(self.rest[self.mapping.source(joint)?])
    }

    /// Rest position of the end of a joint's bone where no joint of ours ends it.
    fn end_of(&self, joint: Joint) -> Option<DVec3> {
        let source = self.mapping.source(joint)?;
        let end = self.motion.bone_end(source)?;
        Some(self.rest[source] + self.up_from_file * end)
    }

    fn leg_length(&self) -> f64 {
        leg_length(&Joint::ALL.map(|joint| self.rest_of(joint).unwrap_or_default()))
    }

    /// Poses of every `every`-th frame.
    fn poses(
        &self,
        alignment: &Alignment,
        target_m: &[DVec3; JOINT_COUNT],
        scale: f64,
        every: usize,
    ) -> Vec<Pose> {
        (0..self.motion.frame_count())
            .step_by(every.max(1))
            .map(|frame| self.pose(frame, alignment, target_m, scale))
            .collect()
    }

    fn pose(
        &self,
        frame: usize,
        alignment: &Alignment,
        target_m: &[DVec3; JOINT_COUNT],
        scale: f64,
    ) -> Pose {
        let world = self.motion.world_joints(frame);
        let rotation =
            |source: usize| self.up_from_file * world[source].0 * self.up_from_file.inverse();
        let mut target_rotation = [DQuat::IDENTITY; JOINT_COUNT];
        let mut pose = Pose::REST;
        for joint in Joint::ALL {
            let idx = joint as usize;
            let parent = joint
                .parent()
                .map_or(DQuat::IDENTITY, |parent| target_rotation[parent as usize]);
            target_rotation[idx] = match self.mapping.drives[idx] {
                Drive::Joint(source) => rotation(source) * alignment.source_from_target[idx],
                Drive::Between(low, high, fraction) => {
                    rotation(low).slerp(rotation(high), fraction)
                        * alignment.source_from_target[idx]
                }
                Drive::Parent => parent,
            };
            pose.parent_from_joint[idx] = (parent.inverse() * target_rotation[idx]).normalize();
        }
        // Pelvis joints sit at different heights in different skeletons; the hips do not.
        let hips = |position: &dyn Fn(Joint) -> DVec3| {
            (position(Joint::LeftHip) + position(Joint::RightHip)) / 2.0
        };
        let source_hips = self.up_from_file * hips(&|joint| world[self.source_joint(joint)].1);
        let pelvis_m = target_m[Joint::Pelvis as usize];
        let hips_from_pelvis_m = hips(&|joint| target_m[joint as usize]) - pelvis_m;
        pose.root_translation_m =
            scale * source_hips - target_rotation[0] * hips_from_pelvis_m - pelvis_m;
        pose
    }
}
