//! The source joints that drive the body's joints, and what is reported of them.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::DVec3;

use super::names::named_joints;
use super::source::SourceMotion;
use crate::MotionError;

/// Without these there is no person to move.
const REQUIRED: [Joint; 11] = [
    Joint::Pelvis,
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
];

/// How a joint's world rotation follows from the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// A source joint turns it.
    Joint(usize),
    /// Between two source joints (spines with fewer joints than the body's), by this fraction.
    Between(usize, usize, f64),
    /// Nothing: it keeps its rest rotation relative to its parent.
    Parent,
}

/// Source joints of the body's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    /// What turns each of the body's joints, in SMPL's order.
    pub drives: [Drive; JOINT_COUNT],
    /// From above the pelvis to the joint that carries both arms; the pelvis where there is none.
    pub spine: Vec<usize>,
}

impl Mapping {
    /// Finds who is who by the names and the tree of a skeleton.
    ///
    /// # Errors
    /// [`MotionError::MissingJoints`] where they do not show a person.
    pub fn new(motion: &dyn SourceMotion) -> Result<Self, MotionError> {
        let mut found = named_joints(motion);
        let rest = motion.rest_positions();
        let shortest = shortest_bone(&rest, &found);
        if let Some(pelvis) = turning_pelvis(motion, &found, &rest, shortest) {
            found[Joint::Pelvis as usize] = Some(pelvis);
        }
        let missing: Vec<Joint> = REQUIRED
            .into_iter()
            .filter(|joint| found[*joint as usize].is_none())
            .collect();
        if !missing.is_empty() {
            return Err(MotionError::MissingJoints {
                missing,
                recognised: found.iter().flatten().count(),
                total: motion.joint_count(),
                names: (0..motion.joint_count())
                    .map(|joint| motion.name(joint).to_owned())
                    .filter(|name| !name.is_empty())
                    .collect(),
            });
        }
        let mut drives = found.map(|joint| joint.map_or(Drive::Parent, Drive::Joint));
        let mut spine_joints = Vec::new();
        if let (Some(pelvis), Some(left), Some(right)) = (
            found[Joint::Pelvis as usize],
            found[Joint::LeftCollar as usize].or(found[Joint::LeftShoulder as usize]),
            found[Joint::RightCollar as usize].or(found[Joint::RightShoulder as usize]),
        ) {
            let mut spine = spine_chain(motion, pelvis, left, right);
            // Of joints at one place the last one turns the bone.
            let chain = spine.clone();
            let mut place = 0;
            spine.retain(|joint| {
                place += 1;
                let next = chain.get(place);
                next.is_none_or(|next| rest[*next].distance(rest[*joint]) > shortest)
            });
            let joints = [Joint::Spine1, Joint::Spine2, Joint::Spine3];
            for (joint, drive) in joints.into_iter().zip(spine_drives(pelvis, &spine)) {
                drives[joint as usize] = drive;
            }
            spine_joints = if spine.is_empty() {
                vec![pelvis]
            } else {
                spine
            };
        }
        let mut mapping = Self {
            drives,
            spine: spine_joints,
        };
        mapping.take_turns_without_length(motion, &rest, shortest);
        for joint in Joint::ALL {
            if let Some(named) = motion.named_by_caller(joint) {
                mapping.drives[joint as usize] = Drive::Joint(named);
            }
        }
        Ok(mapping)
    }

    /// The same with left and right exchanged.
    pub fn mirrored(&self) -> Self {
        Self {
            drives: Joint::ALL.map(|joint| self.drives[joint.mirrored() as usize]),
            spine: self.spine.clone(),
        }
    }

    /// A joint that only turns stands at the place of the one it hangs on: of a limb's joints at one
    /// place the last turns the bone.
    fn take_turns_without_length(
        &mut self,
        motion: &dyn SourceMotion,
        rest: &[DVec3],
        shortest: f64,
    ) {
        let limbs = [
            (Joint::LeftCollar, Joint::LeftShoulder),
            (Joint::LeftShoulder, Joint::LeftElbow),
            (Joint::LeftElbow, Joint::LeftWrist),
            (Joint::LeftHip, Joint::LeftKnee),
            (Joint::LeftKnee, Joint::LeftAnkle),
            (Joint::LeftAnkle, Joint::LeftFoot),
            (Joint::Neck, Joint::Head),
        ];
        let both = limbs
            .into_iter()
            .flat_map(|(joint, next)| [(joint, next), (joint.mirrored(), next.mirrored())]);
        for (joint, next) in both {
            let (Some(own), Some(next)) = (self.source(joint), self.source(next)) else {
                continue;
            };
            let between = std::iter::successors(motion.parent(next), |joint| motion.parent(*joint));
            let between: Vec<usize> = between.take_while(|joint| *joint != own).collect();
            let hangs_on_own = between
                .last()
                .is_some_and(|first| motion.parent(*first) == Some(own));
            let last_here = between
                .into_iter()
                .find(|idx| rest[*idx].distance(rest[own]) <= shortest);
            if let (true, Some(last)) = (hangs_on_own, last_here) {
                self.drives[joint as usize] = Drive::Joint(last);
            }
        }
    }

    /// Whether each source joint turns one of the body's or carries one that does.
    fn used(&self, motion: &dyn SourceMotion) -> Vec<bool> {
        let mut is_used = vec![false; motion.joint_count()];
        for drive in self.drives {
            match drive {
                Drive::Joint(source) => is_used[source] = true,
                Drive::Between(low, high, _) => {
                    is_used[low] = true;
                    is_used[high] = true;
                }
                Drive::Parent => {}
            }
        }
        // Parents come before their children.
        for joint in (0..motion.joint_count()).rev() {
            if let (true, Some(parent)) = (is_used[joint], motion.parent(joint)) {
                is_used[parent] = true;
            }
        }
        is_used
    }

    /// The source joints without which no pose is known, ascending: the first, and those that turn the
    /// body's or carry one that does.
    pub fn needed(&self, motion: &dyn SourceMotion) -> Vec<usize> {
        let used = self.used(motion).into_iter().enumerate();
        used.filter(|(joint, is_used)| *joint == 0 || *is_used)
            .map(|(joint, _)| joint)
            .collect()
    }

    /// The source joint of `joint`, if one alone turns it.
    pub fn source(&self, joint: Joint) -> Option<usize> {
        match self.drives[joint as usize] {
            Drive::Joint(source) => Some(source),
            _ => None,
        }
    }
}

/// Bones up to this length have none, in the file's unit.
fn shortest_bone(rest: &[DVec3], found: &[Option<usize>; JOINT_COUNT]) -> f64 {
    let at = |joint: Joint| {
        found[joint as usize]
            .map(|idx| rest[idx])
            .unwrap_or_default()
    };
    1e-3 * at(Joint::LeftHip).distance(at(Joint::LeftAnkle))
}

/// The last joint at the pelvis's place that carries legs and trunk, which turns them all.
fn turning_pelvis(
    motion: &dyn SourceMotion,
    found: &[Option<usize>; JOINT_COUNT],
    rest: &[DVec3],
    shortest: f64,
) -> Option<usize> {
    let above = |joint: Joint| Some(ancestry(motion, found[joint as usize]?));
    let pelvis = found[Joint::Pelvis as usize]?;
    let [right_leg, trunk] = [above(Joint::RightHip)?, above(Joint::LeftShoulder)?];
    above(Joint::LeftHip)?
        .into_iter()
        .take_while(|joint| *joint != pelvis)
        .find(|joint| {
            right_leg.contains(joint)
                && trunk.contains(joint)
                && ancestry(motion, *joint).contains(&pelvis)
                && rest[*joint].distance(rest[pelvis]) <= shortest
        })
}

/// Ancestors of `joint` and itself, from the joint to the root.
fn ancestry(motion: &dyn SourceMotion, joint: usize) -> Vec<usize> {
    std::iter::successors(Some(joint), |joint| motion.parent(*joint)).collect()
}

/// The joints from the pelvis (excluded) to the last joint that carries both arms (included).
fn spine_chain(motion: &dyn SourceMotion, pelvis: usize, left: usize, right: usize) -> Vec<usize> {
    let left = ancestry(motion, left);
    let right = ancestry(motion, right);
    let Some(chest) = left.iter().skip(1).find(|joint| right.contains(joint)) else {
        return Vec::new();
    };
    let mut chain: Vec<usize> = ancestry(motion, *chest);
    match chain.iter().position(|joint| *joint == pelvis) {
        Some(pelvis) => chain.truncate(pelvis),
        // Legs and trunk on sibling joints, as in Daz skeletons (`hip` carries `pelvis` and
        // `abdomen`): the spine starts where both meet.
        None => {
            let below = ancestry(motion, pelvis);
            let meeting = chain.iter().position(|joint| below.contains(joint));
            chain.truncate(meeting.unwrap_or(0));
        }
    }
    chain.reverse();
    chain
}

/// Spreads a spine of any length over the body's three spine joints. The world rotation at the end
/// of each third carries over; joints between fold into it.
fn spine_drives(pelvis: usize, chain: &[usize]) -> [Drive; 3] {
    match chain {
        [] => [Drive::Parent; 3],
        [only] => [
            Drive::Between(pelvis, *only, 1.0 / 3.0),
            Drive::Between(pelvis, *only, 2.0 / 3.0),
            Drive::Joint(*only),
        ],
        [low, high] => [
            Drive::Joint(*low),
            Drive::Between(*low, *high, 0.5),
            Drive::Joint(*high),
        ],
        _ => [1, 2, 3].map(|third| Drive::Joint(chain[(third * chain.len()).div_ceil(3) - 1])),
    }
}

/// The unit in which a file seems to give lengths, judged by the length of the legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LengthUnit {
    /// Metres.
    Metre,
    /// Inches.
    Inch,
    /// Centimetres.
    Centimetre,
    /// Millimetres.
    Millimetre,
    /// None of these: a scale of the file's own.
    Other,
}

impl LengthUnit {
    /// Judges by the leg (hip to knee to ankle), which measures 0.5 to 1.2 m.
    pub fn of_leg(leg: f64) -> Self {
        match leg {
            0.4..1.4 => Self::Metre,
            15.0..46.0 => Self::Inch,
            46.0..140.0 => Self::Centimetre,
            400.0..1400.0 => Self::Millimetre,
            _ => Self::Other,
        }
    }

    /// Name of the unit in English.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Inch => "inches",
            Self::Centimetre => "centimetres",
            Self::Millimetre => "millimetres",
            Self::Other => "a unit of its own",
        }
    }
}

/// What became of the joints of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct JointReport {
    /// The body's joints and the file's joint that turns each, in SMPL's order.
    pub mapped: Vec<(Joint, String)>,
    /// The body's joints that no joint of the file turns; they follow their neighbours.
    pub missing: Vec<Joint>,
    /// The file's joints that turn nothing here, such as fingers. Not those within a chain (a
    /// second neck joint, say): their rotations are contained in those of the joints after them.
    pub unmapped: Vec<String>,
    /// The file's unit of length, as its legs suggest.
    pub unit: LengthUnit,
    /// Metres on the body per unit of the file: the ratio of the leg lengths.
    pub metres_per_unit: f64,
    /// The file's time step in seconds.
    pub frame_seconds: f64,
    /// What was found other than usual and how it was taken, and what could not be made out: a
    /// sentence each.
    pub notes: Vec<String>,
}

impl JointReport {
    pub(super) fn new(
        motion: &dyn SourceMotion,
        mapping: &Mapping,
        source_leg: f64,
        scale: f64,
        notes: Vec<String>,
    ) -> Self {
        let source_names = |joint: Joint| match mapping.drives[joint as usize] {
            Drive::Joint(source) => Some(motion.name(source).to_owned()),
            Drive::Between(low, high, _) => {
                Some(format!("{} + {}", motion.name(low), motion.name(high)))
            }
            Drive::Parent => None,
        };
        let is_used = mapping.used(motion);
        Self {
            mapped: Joint::ALL
                .into_iter()
                .filter_map(|joint| Some((joint, source_names(joint)?)))
                .collect(),
            missing: Joint::ALL
                .into_iter()
                .filter(|joint| mapping.drives[*joint as usize] == Drive::Parent)
                .collect(),
            unmapped: (0..motion.joint_count())
                .filter(|joint| !is_used[*joint] && !motion.name(*joint).is_empty())
                .map(|joint| motion.name(joint).to_owned())
                .collect(),
            unit: LengthUnit::of_leg(source_leg),
            metres_per_unit: scale,
            frame_seconds: motion.frame_seconds(),
            notes,
        }
    }
}
