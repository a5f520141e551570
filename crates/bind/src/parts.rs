//! The fourteen parts of a person that skin belongs to.

use dynaskin_body::SkinWeights;
use dynaskin_skeleton::Joint;

use crate::avatar::{Avatar, Influences, SkinnedMesh};
use crate::bones::Bones;

/// Number of parts.
pub const PART_COUNT: usize = 14;

/// A part of a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Part {
    Head,
    Trunk,
    LeftUpperArm,
    LeftForearm,
    LeftHand,
    LeftThigh,
    LeftShin,
    LeftFoot,
    RightUpperArm,
    RightForearm,
    RightHand,
    RightThigh,
    RightShin,
    RightFoot,
}

impl Part {
    pub const ALL: [Self; PART_COUNT] = [
        Self::Head,
        Self::Trunk,
        Self::LeftUpperArm,
        Self::LeftForearm,
        Self::LeftHand,
        Self::LeftThigh,
        Self::LeftShin,
        Self::LeftFoot,
        Self::RightUpperArm,
        Self::RightForearm,
        Self::RightHand,
        Self::RightThigh,
        Self::RightShin,
        Self::RightFoot,
    ];

    /// The part whose skin a joint moves.
    pub const fn of_joint(joint: Joint) -> Self {
        match joint {
            Joint::Head => Self::Head,
            Joint::LeftShoulder => Self::LeftUpperArm,
            Joint::LeftElbow => Self::LeftForearm,
            Joint::LeftWrist | Joint::LeftHand => Self::LeftHand,
            Joint::LeftHip => Self::LeftThigh,
            Joint::LeftKnee => Self::LeftShin,
            Joint::LeftAnkle | Joint::LeftFoot => Self::LeftFoot,
            Joint::RightShoulder => Self::RightUpperArm,
            Joint::RightElbow => Self::RightForearm,
            Joint::RightWrist | Joint::RightHand => Self::RightHand,
            Joint::RightHip => Self::RightThigh,
            Joint::RightKnee => Self::RightShin,
            Joint::RightAnkle | Joint::RightFoot => Self::RightFoot,
            _ => Self::Trunk,
        }
    }

    pub fn is_foot(self) -> bool {
        matches!(self, Self::LeftFoot | Self::RightFoot)
    }

    /// Whether no tissue of it moves: head, hands and feet.
    pub fn is_still(self) -> bool {
        matches!(self, Self::Head | Self::LeftHand | Self::RightHand) || self.is_foot()
    }
}

/// How much of a vertex belongs to each part; sums to at most 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartWeights(pub [f32; PART_COUNT]);

impl PartWeights {
    /// Of a vertex of the body.
    pub fn of_body(skin: &SkinWeights) -> Self {
        let mut parts = Self::default();
        for (joint, weight) in skin.joints.iter().zip(skin.weights) {
            parts.0[Part::of_joint(Joint::ALL[usize::from(*joint)]) as usize] += weight;
        }
        parts
    }

    /// Of a vertex of an avatar.
    pub fn of_avatar(mesh: &SkinnedMesh, influences: &Influences, bones: &Bones) -> Self {
        let mut parts = Self::default();
        for (slot, weight) in influences.joints.iter().zip(influences.weights) {
            if weight > 0.0
                && let Some(joint) = bones.joint_of_node[mesh.joints[usize::from(*slot)]]
            {
                parts.0[Part::of_joint(joint) as usize] += weight;
            }
        }
        parts
    }

    /// Of all vertices of an avatar, mesh by mesh.
    pub fn of_all(avatar: &Avatar, bones: &Bones) -> Vec<Self> {
        let meshes = avatar.meshes.iter();
        meshes
            .flat_map(|mesh| {
                let influences = mesh.influences.iter();
                influences.map(|influences| Self::of_avatar(mesh, influences, bones))
            })
            .collect()
    }

    /// What two places have in common, 0..=1.
    pub fn in_common(&self, other: &Self) -> f32 {
        let pairs = self.0.iter().zip(&other.0);
        pairs.map(|(a, b)| a.min(*b)).sum()
    }

    /// The part with the most weight; none for what belongs to nobody.
    pub fn largest(&self) -> Option<Part> {
        let parts = Part::ALL.into_iter().zip(self.0);
        let (part, weight) = parts.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (weight > 0.0).then_some(part)
    }

    /// How much belongs to parts that stay still.
    pub fn still(&self) -> f32 {
        let parts = Part::ALL.into_iter().zip(self.0);
        parts
            .filter(|(part, _)| part.is_still())
            .map(|(_, weight)| weight)
            .sum()
    }

    /// The mix of three places.
    pub fn mixed(corners: [&Self; 3], shares: [f32; 3]) -> Self {
        Self(std::array::from_fn(|part| {
            corners
                .iter()
                .zip(shares)
                .map(|(corner, share)| corner.0[part] * share)
                .sum()
        }))
    }
}

/// How well two parts that touch go together, 0..=1: rigs paint the border between them at other places.
const TOUCHING: f32 = 0.6;

impl PartWeights {
    /// As [`Self::in_common`], where what differs counts in part if its parts touch.
    pub fn compatible(&self, other: &Self) -> f32 {
        let common = self.in_common(other);
        let rest = 1.0 - common;
        if rest < 1e-3 {
            return common;
        }
        let (mut own, mut others, mut touching) = (0.0, 0.0, 0.0);
        for (a, (mine, theirs)) in self.0.iter().zip(&other.0).enumerate() {
            let left = (mine - theirs).max(0.0);
            own += left;
            others += (theirs - mine).max(0.0);
            if left > 0.0 {
                for (b, (mine, theirs)) in self.0.iter().zip(&other.0).enumerate() {
                    if touches(Part::ALL[a], Part::ALL[b]) {
                        touching += left * (theirs - mine).max(0.0);
                    }
                }
            }
        }
        let share = touching / (own * others).max(1e-6);
        common + rest * TOUCHING * share.min(1.0)
    }
}

/// Whether two parts border on each other.
fn touches(a: Part, b: Part) -> bool {
    let is_pair = |x: Part, y: Part| match x {
        Part::Trunk => matches!(
            y,
            Part::Head
                | Part::LeftUpperArm
                | Part::RightUpperArm
                | Part::LeftThigh
                | Part::RightThigh
        ),
        Part::LeftForearm => matches!(y, Part::LeftUpperArm | Part::LeftHand),
        Part::RightForearm => matches!(y, Part::RightUpperArm | Part::RightHand),
        Part::LeftShin => matches!(y, Part::LeftThigh | Part::LeftFoot),
        Part::RightShin => matches!(y, Part::RightThigh | Part::RightFoot),
        _ => false,
    };
    is_pair(a, b) || is_pair(b, a)
}
