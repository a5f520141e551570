//! What the motion itself tells of a skeleton, whatever its zero pose: directions that joints keep in
//! their own frames, the axes that knees and elbows bend about, and mean turns of neighbours.

use dynaskin_body::Joint;
use glam::{DQuat, DVec3};

use super::Source;

/// Frames looked at, at most.
const MAX_FRAMES: usize = 400;

/// A knee or an elbow bends at least by this sine in the frames that count.
const LEAST_BEND: f64 = 0.15;

/// World rotations and positions of all source joints, with +Y up, at frames all over the motion.
pub struct Evidence {
    frames: Vec<Vec<(DQuat, DVec3)>>,
}

/// The axis a limb bends about, unit vectors in the rest space of the bone before and after it: upper
/// bone times lower bone, so that it points to the left for knees.
pub struct Hinge {
    pub in_upper: DVec3,
    pub in_lower: DVec3,
}

impl Evidence {
    pub fn new(source: &Source<'_>) -> Self {
        let count = source.motion.frame_count();
        let frames = (0..count).step_by(count.div_ceil(MAX_FRAMES).max(1));
        Self {
            frames: frames.map(|frame| source.world(frame)).collect(),
        }
    }

    /// Mean of a direction of the world in the rest space of `joint`. Its length tells how much the
    /// frames agree, if they give unit vectors.
    pub fn mean_in(&self, joint: usize, direction: impl Fn(&[(DQuat, DVec3)]) -> DVec3) -> DVec3 {
        let sum: DVec3 = self
            .frames
            .iter()
            .map(|world| world[joint].0.inverse() * direction(world))
            .sum();
        sum / self.frames.len().max(1) as f64
    }

    /// The mean turn from `from` to `to` relative to `from`, and how far frames are from it
    /// (radians, root mean square).
    pub fn mean_turn(&self, from: usize, to: usize) -> (DQuat, f64) {
        let turn = |world: &[(DQuat, DVec3)]| world[from].0.inverse() * world[to].0;
        let Some(mut mean) = self.frames.first().map(|world| turn(world)) else {
            return (DQuat::IDENTITY, 0.0);
        };
        for _ in 0..3 {
            let sum = self.frames.iter().fold(glam::DVec4::ZERO, |sum, world| {
                let turn = turn(world);
                let turn = glam::DVec4::from(turn);
                sum + turn * turn.dot(glam::DVec4::from(mean)).signum()
            });
            if sum.length() > 1e-6 {
                mean = DQuat::from_vec4(sum.normalize());
            }
        }
        let squares: f64 = self
            .frames
            .iter()
            .map(|world| {
                let apart = turn(world).dot(mean).abs().min(1.0);
                (2.0 * apart.acos()).powi(2)
            })
            .sum();
        (mean, (squares / self.frames.len() as f64).sqrt())
    }

    /// The hinge between three source joints of a limb; none where it hardly bends or bends about
    /// many axes.
    pub fn hinge(&self, [start, middle, end]: [usize; 3]) -> Option<Hinge> {
        let bend = |world: &[(DQuat, DVec3)]| {
            let upper = (world[middle].1 - world[start].1).normalize_or_zero();
            let lower = (world[end].1 - world[middle].1).normalize_or_zero();
            let bend = upper.cross(lower);
            if bend.length() < LEAST_BEND {
                DVec3::ZERO
            } else {
                bend
            }
        };
        let total: f64 = self.frames.iter().map(|world| bend(world).length()).sum();
        let in_upper = self.mean_in(start, bend);
        let in_lower = self.mean_in(middle, bend);
        let count = self.frames.len().max(1) as f64;
        let is_one_axis = in_upper.length() > 0.8 * total / count && total / count > 0.03;
        Some(Hinge {
            in_upper: in_upper.try_normalize().filter(|_| is_one_axis)?,
            in_lower: in_lower.try_normalize()?,
        })
    }

    /// Sums over the frames what `vote` finds in each.
    pub fn votes(&self, vote: impl Fn(&[(DQuat, DVec3)]) -> f64) -> f64 {
        let sum: f64 = self.frames.iter().map(|world| vote(world)).sum();
        sum / self.frames.len().max(1) as f64
    }
}

/// From source joint to source joint at a frame.
pub fn bone(world: &[(DQuat, DVec3)], from: usize, to: usize) -> DVec3 {
    (world[to].1 - world[from].1).normalize_or_zero()
}

/// Whether left and right of the file are exchanged: toes, knees and elbows say where ahead is, hips
/// and shoulders where left is. Positive votes say that all is well; 0 that nothing tells.
pub fn sides_vote(source: &Source<'_>, evidence: &Evidence) -> [f64; 3] {
    let at = |joint: Joint| source.mapping.source(joint);
    let (Some(left_hip), Some(right_hip), Some(left_arm), Some(right_arm)) = (
        at(Joint::LeftHip),
        at(Joint::RightHip),
        at(Joint::LeftShoulder),
        at(Joint::RightShoulder),
    ) else {
        return [0.0; 3];
    };
    let frame = |world: &[(DQuat, DVec3)]| {
        let up = world[left_arm].1 + world[right_arm].1 - world[left_hip].1 - world[right_hip].1;
        let left = bone(world, right_hip, left_hip);
        (left, left.cross(up.normalize_or_zero()).normalize_or_zero())
    };
    let mut votes = [0.0; 3];
    for side in [false, true] {
        let of = |joint: Joint| at(if side { joint.mirrored() } else { joint });
        if let (Some(knee), Some(ankle), Some(foot)) = (
            of(Joint::LeftKnee),
            of(Joint::LeftAnkle),
            of(Joint::LeftFoot),
        ) {
            votes[0] += evidence.votes(|world| {
                let shin = bone(world, knee, ankle);
                let toes = bone(world, ankle, foot);
                toes.reject_from(shin).dot(frame(world).1)
            });
        }
        if let (Some(hip), Some(knee), Some(ankle)) = (
            of(Joint::LeftHip),
            of(Joint::LeftKnee),
            of(Joint::LeftAnkle),
        ) {
            votes[1] += evidence.votes(|world| {
                bone(world, hip, knee)
                    .cross(bone(world, knee, ankle))
                    .dot(frame(world).0)
            });
        }
        if let (Some(arm), Some(elbow), Some(wrist)) = (
            of(Joint::LeftShoulder),
            of(Joint::LeftElbow),
            of(Joint::LeftWrist),
        ) {
            votes[2] += evidence.votes(|world| {
                let upper = bone(world, arm, elbow);
                bone(world, elbow, wrist)
                    .reject_from(upper)
                    .dot(frame(world).1)
            });
        }
    }
    votes
}
