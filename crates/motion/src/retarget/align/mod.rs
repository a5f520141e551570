//! Constant rotations between the rest poses of source and body.
//!
//! A file's zero pose may be anything. What its joints keep in their own frames over the motion may
//! not: the bones, the axes of knees and elbows, the mean way a neighbour stands to them. Each part
//! compares its zero pose with that. A zero pose that agrees within a few degrees is kept, because it
//! is drawn and exact; any other is replaced by what the motion tells.

mod arms;
mod feet;
mod frames;
mod legs;
mod trunk;
mod twist;

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DQuat, DVec3};

use super::evidence::Evidence;
use super::skeleton::Source;
use crate::MotionError;
pub use feet::SoleReference;

/// Rest alignments: `world rotation of the body's joint = world rotation of the source's joint *
/// source_from_target`.
#[derive(Clone)]
pub struct Alignment {
    pub source_from_target: [DQuat; JOINT_COUNT],
    /// The same for the joints of the source that the spine is mixed from.
    pub of_source: Vec<DQuat>,
    /// How far down the source's bone from ankle to toes points from the body's sole, left and right,
    /// in radians; none without toes.
    toes_down: [Option<f64>; 2],
}

/// What all parts of an alignment are made of.
struct Builder<'a> {
    source: &'a Source<'a>,
    evidence: &'a Evidence,
    target_m: &'a [DVec3; JOINT_COUNT],
    /// Whether the zero pose stands with a straight trunk.
    is_upright: bool,
    notes: Vec<String>,
}

impl Alignment {
    /// Also says what differs from a usual zero pose and what cannot be made out.
    pub fn new(
        source: &Source<'_>,
        evidence: &Evidence,
        target_m: &[DVec3; JOINT_COUNT],
        reference: SoleReference,
    ) -> Result<(Self, Vec<String>), MotionError> {
        let mut builder = Builder {
            source,
            evidence,
            target_m,
            is_upright: true,
            notes: Vec::new(),
        };
        let mut alignment = builder.trunk()?;
        builder.head(&mut alignment);
        for side in [Side::Left, Side::Right] {
            builder.arm(&mut alignment, side);
            builder.leg(&mut alignment, side);
            builder.foot(&mut alignment, side, reference);
        }
        Ok((alignment, builder.notes))
    }

    fn of(&self, joint: Joint) -> DQuat {
        self.source_from_target[joint as usize]
    }

    fn set(&mut self, joint: Joint, turn: DQuat) {
        self.source_from_target[joint as usize] = turn;
    }

    /// The chest's source joint and its alignment.
    fn chest(&self, source: &Source<'_>) -> (usize, DQuat) {
        let chest = source.mapping.spine.last().copied().unwrap_or_default();
        let turn = self.of_source.get(chest).copied();
        (chest, turn.unwrap_or(DQuat::IDENTITY))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

impl Side {
    /// The joint of this side for one of the left.
    fn of(self, left: Joint) -> Joint {
        match self {
            Self::Left => left,
            Self::Right => left.mirrored(),
        }
    }

    /// 1 on the left, where x of the body points, -1 on the right.
    fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

impl Builder<'_> {
    fn at(&self, joint: Joint) -> Option<usize> {
        self.source.mapping.source(joint)
    }

    fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// The body's bone at rest.
    fn target_bone(&self, from: Joint, to: Joint) -> DVec3 {
        self.target_m[to as usize] - self.target_m[from as usize]
    }

    /// The source's bone in its zero pose, to the end of the first joint where the file lacks the second.
    fn zero_bone(&self, from: Joint, to: Joint) -> Option<DVec3> {
        let end = self.source.rest_of(to);
        Some(end.or_else(|| self.source.end_of(from))? - self.source.rest_of(from)?)
    }

    /// `turn` with the smallest rotation added that brings the body's bone onto the source's.
    fn along_bone(&self, turn: DQuat, from: Joint, to: Joint) -> DQuat {
        let target = (turn * self.target_bone(from, to)).try_normalize();
        let source = self.zero_bone(from, to).and_then(DVec3::try_normalize);
        match (target, source) {
            (Some(target), Some(source)) => DQuat::from_rotation_arc(target, source) * turn,
            _ => turn,
        }
    }
}
