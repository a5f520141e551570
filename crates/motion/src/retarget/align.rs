//! Constant rotations between the rest poses of source and body.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DMat3, DQuat, DVec3};

use super::Source;
use crate::MotionError;

/// Largest correction of the pitch of the soles, in radians.
const MAX_SOLE_PITCH: f64 = 0.2;

/// What the soles of the source's rest pose are flat against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoleReference {
    /// The floor.
    Floor,
    /// The plane across the shin: feet that turn with spread legs, as in CMU's skeletons.
    Shin,
}

/// Rest alignments: `world rotation of the body's joint = world rotation of the source's joint *
/// source_from_target`.
pub struct Alignment {
    pub source_from_target: [DQuat; JOINT_COUNT],
}

impl Alignment {
    pub fn new(
        source: &Source<'_>,
        target_m: &[DVec3; JOINT_COUNT],
        reference: SoleReference,
    ) -> Result<Self, MotionError> {
        let trunk = trunk_alignment(source, target_m)?;
        let mut alignment = Self {
            source_from_target: [trunk; JOINT_COUNT],
        };
        for (joint, child) in [
            (Joint::LeftHip, Joint::LeftKnee),
            (Joint::LeftKnee, Joint::LeftAnkle),
            (Joint::LeftShoulder, Joint::LeftElbow),
            (Joint::LeftElbow, Joint::LeftWrist),
        ] {
            alignment.follow_bone(source, target_m, joint, child);
            alignment.follow_bone(source, target_m, joint.mirrored(), child.mirrored());
        }
        for (knee, ankle, foot) in [
            (Joint::LeftKnee, Joint::LeftAnkle, Joint::LeftFoot),
            (Joint::RightKnee, Joint::RightAnkle, Joint::RightFoot),
        ] {
            let sole = sole_alignment(source, target_m, [knee, ankle, foot], reference);
            alignment.source_from_target[ankle as usize] = sole;
            alignment.source_from_target[foot as usize] = sole;
        }
        for (elbow, wrist, hand) in [
            (Joint::LeftElbow, Joint::LeftWrist, Joint::LeftHand),
            (Joint::RightElbow, Joint::RightWrist, Joint::RightHand),
        ] {
            let forearm = alignment.source_from_target[elbow as usize];
            alignment.source_from_target[wrist as usize] = forearm;
            alignment.source_from_target[hand as usize] = forearm;
        }
        Ok(alignment)
    }

    /// Turns the left and the right foot so that soles whose toes point up by these angles
    /// (radians) become flat. Larger angles than rest poses explain are how somebody stands.
    pub fn pitch_soles(&mut self, toes_up: [f64; 2]) {
        let feet = [
            [Joint::LeftAnkle, Joint::LeftFoot],
            [Joint::RightAnkle, Joint::RightFoot],
        ];
        for (joints, angle) in feet.into_iter().zip(toes_up) {
            let down = DQuat::from_rotation_x(angle.clamp(-MAX_SOLE_PITCH, MAX_SOLE_PITCH));
            for joint in joints {
                self.source_from_target[joint as usize] *= down;
            }
        }
    }

    /// Starts from the parent's alignment, which carries the twist along the limb, and adds the
    /// smallest rotation that brings the bone from `joint` to `child` onto the source's.
    fn follow_bone(
        &mut self,
        source: &Source<'_>,
        target_m: &[DVec3; JOINT_COUNT],
        joint: Joint,
        child: Joint,
    ) {
        let parent = joint.parent().unwrap_or(Joint::Pelvis);
        let inherited = self.source_from_target[parent as usize];
        let target_bone = inherited * (target_m[child as usize] - target_m[joint as usize]);
        let source_end = source.rest_of(child).or_else(|| source.end_of(joint));
        let source_bone = match (source.rest_of(joint), source_end) {
            (Some(start), Some(end)) => end - start,
            _ => DVec3::ZERO,
        };
        self.source_from_target[joint as usize] =
            match (target_bone.try_normalize(), source_bone.try_normalize()) {
                (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to) * inherited,
                _ => inherited,
            };
    }
}

/// The trunk: both rest poses stand upright, so only the facing can differ. Up is not taken from
/// bone directions, because the body's spine curves where the source's is straight.
fn trunk_alignment(
    source: &Source<'_>,
    target_m: &[DVec3; JOINT_COUNT],
) -> Result<DQuat, MotionError> {
    let source_at = |joint: Joint| source.rest_of(joint).unwrap_or_default();
    let source_frame = upright_frame("source", &source_at)?;
    let target_frame = upright_frame("target", &|joint| target_m[joint as usize])?;
    Ok(DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize())
}

/// Frame of a standing body: x to its left, y up, z ahead. Directions close to an axis of the world
/// are meant to be that axis: bodies are measured, skeletons are drawn along axes.
fn upright_frame(
    skeleton: &'static str,
    at: &dyn Fn(Joint) -> DVec3,
) -> Result<DMat3, MotionError> {
    let degenerate = |problem: &str| MotionError::Degenerate {
        skeleton,
        problem: format!("{problem}; the rest pose must be a standing person"),
    };
    let trunk = at(Joint::LeftShoulder) + at(Joint::RightShoulder)
        - at(Joint::LeftHip)
        - at(Joint::RightHip);
    let across = at(Joint::LeftHip) - at(Joint::RightHip);
    let up = trunk
        .try_normalize()
        .ok_or_else(|| degenerate("hips and shoulders coincide"))?;
    let up = near_axis(up);
    let left = across
        .reject_from_normalized(up)
        .try_normalize()
        .ok_or_else(|| degenerate("the hips coincide or lie above each other"))?;
    let left = near_axis(left)
        .reject_from_normalized(up)
        .normalize_or(left);
    Ok(DMat3::from_cols(left, up, left.cross(up)))
}

/// The world axis within 25 degrees of `direction`, else `direction`.
fn near_axis(direction: DVec3) -> DVec3 {
    let near = 25.0_f64.to_radians().cos();
    DVec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .find(|axis| axis.dot(direction) > near)
        .unwrap_or(direction)
}

/// Alignment of a foot that lays the body's flat sole onto the source's and turns its toes to where
/// the source's point.
fn sole_alignment(
    source: &Source<'_>,
    target_m: &[DVec3; JOINT_COUNT],
    [knee, ankle, foot]: [Joint; 3],
    reference: SoleReference,
) -> DQuat {
    let source_at = |joint: Joint| source.rest_of(joint);
    let toes = source_at(foot).or_else(|| source.end_of(ankle));
    let (Some(source_knee), Some(source_ankle)) = (source_at(knee), source_at(ankle)) else {
        return DQuat::IDENTITY;
    };
    let up = match reference {
        SoleReference::Floor => DVec3::Y,
        SoleReference::Shin => (source_knee - source_ankle).normalize_or(DVec3::Y),
    };
    let ahead = toes.map_or(DVec3::ZERO, |toes| toes - source_ankle);
    let source_frame = sole_frame(up, ahead);
    let target_frame = sole_frame(DVec3::Y, target_m[foot as usize] - target_m[ankle as usize]);
    DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize()
}

/// y along `up`, z along `ahead` as far as that is possible.
fn sole_frame(up: DVec3, ahead: DVec3) -> DMat3 {
    let ahead = ahead
        .reject_from_normalized(up)
        .try_normalize()
        .unwrap_or_else(|| DVec3::Z.reject_from_normalized(up).normalize_or(DVec3::X));
    DMat3::from_cols(up.cross(ahead), up, ahead)
}
