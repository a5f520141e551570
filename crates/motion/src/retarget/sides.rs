//! Whether left and right of a file are what their names say.

use dynaskin_body::Joint;
use glam::DVec3;

use super::evidence::{Evidence, World, bone};
use super::skeleton::Source;

/// Where a person faces, judged by the body against the names of its sides.
pub enum Facing {
    Ahead,
    Back,
    Disputed,
    Unknown,
}

/// Mean sine, summed over both sides, below which a vote says nothing.
const LEAST_VOTE: f64 = 0.1;

impl Facing {
    pub fn new(source: &Source<'_>, evidence: &Evidence) -> Self {
        Self::of_votes(votes(source, evidence))
    }

    /// Two of three that speak up decide. Toes count double: hardly anybody's point back.
    fn of_votes([toes, knees, elbows]: [f64; 3]) -> Self {
        let say = |vote: f64| {
            if vote.abs() < LEAST_VOTE {
                0.0
            } else {
                vote.signum()
            }
        };
        let [toes, knees, elbows] = [2.0 * say(toes), say(knees), say(elbows)];
        let sum = toes + knees + elbows;
        if toes == 0.0 && knees == 0.0 && elbows == 0.0 {
            Self::Unknown
        } else if sum > 0.0 {
            Self::Ahead
        } else if sum <= -2.0 && knees <= 0.0 {
            Self::Back
        } else {
            Self::Disputed
        }
    }

    /// What is to be said of it.
    pub fn note(&self) -> Option<&'static str> {
        match self {
            Self::Ahead => None,
            Self::Back => Some(
                "left and right are exchanged in the file, as toes, knees and elbows say: taken the \
                 other way round",
            ),
            Self::Disputed => Some(
                "toes, knees and elbows do not agree where ahead is: left and right are as named",
            ),
            Self::Unknown => Some(
                "neither toes nor knees nor elbows tell where ahead is: left and right are as named",
            ),
        }
    }
}

/// Toes, knees and elbows say where ahead is, hips and shoulders where left is. Positive votes say that
/// the names are right; 0 that nothing tells.
fn votes(source: &Source<'_>, evidence: &Evidence) -> [f64; 3] {
    let at = |joint: Joint| source.mapping.source(joint);
    let (Some(left_hip), Some(right_hip), Some(left_arm), Some(right_arm)) = (
        at(Joint::LeftHip),
        at(Joint::RightHip),
        at(Joint::LeftShoulder),
        at(Joint::RightShoulder),
    ) else {
        return [0.0; 3];
    };
    let left = |world: &World| bone(world, right_hip, left_hip);
    let ahead = |world: &World| {
        let up = world[left_arm].1 + world[right_arm].1 - world[left_hip].1 - world[right_hip].1;
        left(world).cross(up).normalize_or_zero()
    };
    // Sines between two bones that follow each other, against a direction of the trunk.
    let limb = |joints: [Joint; 3], vote: &dyn Fn(&World, DVec3, DVec3) -> f64| -> f64 {
        [joints, joints.map(Joint::mirrored)]
            .into_iter()
            .filter_map(|[start, middle, end]| Some([at(start)?, at(middle)?, at(end)?]))
            .map(|[start, middle, end]| {
                evidence.votes(|world| {
                    vote(world, bone(world, start, middle), bone(world, middle, end))
                })
            })
            .sum()
    };
    let bends_ahead =
        |world: &World, upper: DVec3, lower: DVec3| lower.reject_from(upper).dot(ahead(world));
    [
        limb(
            [Joint::LeftKnee, Joint::LeftAnkle, Joint::LeftFoot],
            &bends_ahead,
        ),
        limb(
            [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
            &|world, thigh, shin| thigh.cross(shin).dot(left(world)),
        ),
        limb(
            [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist],
            &bends_ahead,
        ),
    ]
}
