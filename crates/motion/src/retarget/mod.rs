//! Motion of a file's skeleton carried over to the body's.
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
mod reading;
mod source;
mod vocabulary;

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3, Vec3};

use crate::{Clip, MotionError};
use align::{Alignment, SoleReference};
use evidence::{Evidence, sides_vote};
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
    let mut notes = Vec::new();
    let mut mapping = Mapping::new(motion)?;
    let mut source = Source::new(motion, &mapping);
    let mut evidence = Evidence::new(&source);
    match facing(sides_vote(&source, &evidence)) {
        Facing::Ahead => {}
        Facing::Unknown => notes.push(
            "neither toes nor knees nor elbows tell where ahead is: left and right are as named"
                .to_owned(),
        ),
        Facing::Disputed => notes.push(
            "toes, knees and elbows do not agree where ahead is: left and right are as named"
                .to_owned(),
        ),
        Facing::Back => {
            notes.push(
                "left and right are exchanged in the file, as toes, knees and elbows say: taken the \
                 other way round"
                    .to_owned(),
            );
            mapping = mapping.mirrored();
            source = Source::new(motion, &mapping);
            evidence = Evidence::new(&source);
        }
    }
    notes.extend(source.note.clone());
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
        let mut said = Vec::new();
        let alignment = Alignment::new(&source, &evidence, &target_m, reference, &mut said)?;
        let frames = source.poses(&alignment, &target_m, scale, every);
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
    // hundreds of megabytes with poses, so these are gone before the next ones are made.
    let standing_pitch = {
        let frames = source.poses(&alignment, &target_m, scale, 1);
        if floor::ever_stands(&frames, motion.frame_seconds(), target_joints_m) {
            floor::standing_pitch(&frames, motion.frame_seconds(), target_joints_m)
        } else {
            notes.push("nobody stands in the file: the pitch of the feet is as drawn".to_owned());
            [0.0; 2]
        }
    };
    alignment.pitch_soles(standing_pitch);
    let mut frames = source.poses(&alignment, &target_m, scale, 1);
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

/// Where a person faces, judged by the body against the names of its sides.
enum Facing {
    Ahead,
    Back,
    Disputed,
    Unknown,
}

/// Two of three that speak up decide; a vote is a mean sine over both sides. Toes count double:
/// hardly anybody's point back.
fn facing([toes, knees, elbows]: [f64; 3]) -> Facing {
    let say = |vote: f64| {
        if vote.abs() < 0.1 { 0.0 } else { vote.signum() }
    };
    let [toes, knees, elbows] = [2.0 * say(toes), say(knees), say(elbows)];
    let sum = toes + knees + elbows;
    if toes == 0.0 && knees == 0.0 && elbows == 0.0 {
        Facing::Unknown
    } else if sum > 0.0 {
        Facing::Ahead
    } else if sum <= -2.0 && knees <= 0.0 {
        Facing::Back
    } else {
        Facing::Disputed
    }
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
    mapping: Mapping,
    /// Rest positions turned to +Y up, file unit.
    rest: Vec<DVec3>,
    /// Takes the file's axes to +Y up.
    up_from_file: DQuat,
    /// What is to be said of the file's up.
    note: Option<String>,
}

impl<'a> Source<'a> {
    fn new(motion: &'a dyn SourceMotion, mapping: &Mapping) -> Self {
        let mut source = Self {
            motion,
            mapping: mapping.clone(),
            rest: motion.rest_positions(),
            up_from_file: DQuat::IDENTITY,
            note: None,
        };
        (source.up_from_file, source.note) = source.find_up();
        for position in &mut source.rest {
            *position = source.up_from_file * *position;
        }
        source
    }

    /// World rotations and positions at a frame, with +Y up.
    fn world(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let mut world = self.motion.world_joints(frame);
        if self.up_from_file != DQuat::IDENTITY {
            for (rotation, position) in &mut world {
                *rotation = self.up_from_file * *rotation * self.up_from_file.inverse();
                *position = self.up_from_file * *position;
            }
        }
        world
    }

    /// Whether the file tells where the toes of a foot point: not along the shin.
    fn has_toes(&self, ankle: Joint, foot: Joint) -> bool {
        if self.rest_of(foot).is_some() {
            return true;
        }
        let knee = if ankle == Joint::LeftAnkle {
            Joint::LeftKnee
        } else {
            Joint::RightKnee
        };
        let (Some(knee), Some(ankle_m), Some(end)) =
            (self.rest_of(knee), self.rest_of(ankle), self.end_of(ankle))
        else {
            return false;
        };
        let (shin, toes) = (ankle_m - knee, end - ankle_m);
        toes.length() > 0.02 * self.leg_length() && toes.angle_between(shin) > 0.5
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

    /// Where up is in the file: +Y, unless the body stands along another axis throughout and either
    /// its zero pose does, too, or its ankles are where a floor through the origin wants them.
    fn find_up(&self) -> (DQuat, Option<String>) {
        let count = self.motion.frame_count();
        let mut mean = DVec3::ZERO;
        let mut ankles: Vec<DVec3> = Vec::new();
        let mut judged = 0.0;
        for frame in (0..count).step_by(count.div_ceil(50).max(1)) {
            let world = self.motion.world_joints(frame);
            mean += self.trunk(|joint| world[joint].1).normalize_or_zero();
            judged += 1.0;
            let at = |joint| world[self.source_joint(joint)].1;
            ankles.push(at(Joint::LeftAnkle).min(at(Joint::RightAnkle)));
        }
        mean /= f64::max(judged, 1.0);
        let rest = self.trunk(|joint| self.rest[joint]).normalize_or_zero();
        let leg = self.leg_length();
        let lowest = |axis: DVec3| {
            let mut heights: Vec<f64> = ankles.iter().map(|ankle| ankle.dot(axis)).collect();
            heights.sort_by(f64::total_cmp);
            heights.get(heights.len() / 10).copied().unwrap_or_default()
        };
        let stands_on_origin = |axis: DVec3| (-0.1..0.35).contains(&(lowest(axis) / leg.max(1e-9)));
        let is_along = |direction: DVec3, axis: DVec3| {
            let along = direction.dot(axis);
            along > 0.0 && (direction - along * axis).abs().max_element() < along
        };
        let up = [DVec3::Z, DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::NEG_X]
            .into_iter()
            .find(|axis| is_along(mean, *axis));
        let Some(up) = up else {
            let lies = mean.y < 0.3;
            let note = "where up is cannot be made out by the body: +Y is taken";
            return (DQuat::IDENTITY, lies.then(|| note.to_owned()));
        };
        let is_clear = mean.dot(up) > 0.75;
        let is_up = if up == DVec3::Z {
            is_along(rest, up) || (is_clear && stands_on_origin(up))
        } else if up == DVec3::NEG_Y {
            is_clear && is_along(rest, up)
        } else {
            is_clear && (is_along(rest, up) || stands_on_origin(up))
        };
        if !is_up {
            let note = "the body lies throughout: +Y is taken for up";
            return (DQuat::IDENTITY, Some(note.to_owned()));
        }
        let turn = if up == DVec3::NEG_Y {
            DQuat::from_rotation_x(std::f64::consts::PI)
        } else {
            DQuat::from_rotation_arc(up, DVec3::Y)
        };
        let turn = if up == DVec3::Z {
            DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2)
        } else {
            turn
        };
        let note = (up != DVec3::Z).then(|| format!("the body stands along {up}: taken for up"));
        (turn, note)
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
        let world = self.world(frame);
        let rotation = |source: usize| world[source].0;
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
                    let [low, high] =
                        [low, high].map(|source| rotation(source) * alignment.of_source[source]);
                    low.slerp(high, fraction)
                }
                Drive::Parent => parent,
            };
            pose.parent_from_joint[idx] = (parent.inverse() * target_rotation[idx]).normalize();
        }
        // Pelvis joints sit at different heights in different skeletons; the hips do not.
        let hips = |position: &dyn Fn(Joint) -> DVec3| {
            (position(Joint::LeftHip) + position(Joint::RightHip)) / 2.0
        };
        let source_hips = hips(&|joint| world[self.source_joint(joint)].1);
        let pelvis_m = target_m[Joint::Pelvis as usize];
        let hips_from_pelvis_m = hips(&|joint| target_m[joint as usize]) - pelvis_m;
        pose.root_translation_m =
            scale * source_hips - target_rotation[0] * hips_from_pelvis_m - pelvis_m;
        pose
    }
}
