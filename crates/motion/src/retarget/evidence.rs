//! What the motion itself tells of a skeleton, whatever its zero pose: directions that joints keep in
//! their own frames, the axes that knees and elbows bend about, and mean turns of neighbours.

use glam::{DQuat, DVec3, DVec4};

use super::skeleton::Source;

/// Frames looked at, at most; and joints of them all, for the memory of rigs with thousands.
const MAX_FRAMES: usize = 400;
const MAX_JOINTS: usize = 400_000;

/// A knee or an elbow bends at least by this sine in the frames that count: straight ones are a few
/// degrees off to the side, which tells nothing.
const LEAST_BEND: f64 = 0.25;
/// Mean sine of the bend over all frames that makes a hinge, and the part of it about one axis.
const LEAST_MEAN_BEND: f64 = 0.03;
const ONE_AXIS: f64 = 0.8;

/// World rotations and positions of all source joints at a frame, with +Y up.
pub type World = [(DQuat, DVec3)];

/// Frames all over the motion.
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
        let most = MAX_FRAMES.min(MAX_JOINTS / source.motion.joint_count().max(1));
        let frames = (0..count).step_by(count.div_ceil(most.max(1)).max(1));
        Self {
            frames: frames.map(|frame| source.world(frame)).collect(),
        }
    }

    /// The half of the frames in which `length` is greatest.
    pub fn longest(&self, length: impl Fn(&World) -> f64) -> Self {
        let mut frames: Vec<_> = self
            .frames
            .iter()
            .map(|world| (length(world), world))
            .collect();
        frames.sort_by(|a, b| b.0.total_cmp(&a.0));
        frames.truncate(frames.len().div_ceil(2));
        Self {
            frames: frames.into_iter().map(|(_, world)| world.clone()).collect(),
        }
    }

    /// Mean of what `value` finds in each frame.
    fn mean<T: std::iter::Sum + std::ops::Div<f64, Output = T>>(
        &self,
        value: impl Fn(&World) -> T,
    ) -> T {
        let sum: T = self.frames.iter().map(|world| value(world)).sum();
        sum / self.frames.len().max(1) as f64
    }

    /// Mean of a direction of the world in the rest space of `joint`. Its length tells how much the
    /// frames agree, if they give unit vectors.
    pub fn mean_in(&self, joint: usize, direction: impl Fn(&World) -> DVec3) -> DVec3 {
        self.mean(|world| world[joint].0.inverse() * direction(world))
    }

    /// Mean direction from `joint` to another in the rest space of `joint`.
    pub fn mean_bone(&self, joint: usize, to: usize) -> DVec3 {
        self.mean_in(joint, |world| bone(world, joint, to))
    }

    /// Mean over the frames of what `vote` finds in each.
    pub fn votes(&self, vote: impl Fn(&World) -> f64) -> f64 {
        self.mean(vote)
    }

    /// The mean turn from `from` to `to` relative to `from`, and how far frames are from it
    /// (radians, root mean square).
    pub fn mean_turn(&self, from: usize, to: usize) -> (DQuat, f64) {
        let turn = |world: &World| world[from].0.inverse() * world[to].0;
        let Some(mut mean) = self.frames.first().map(|world| turn(world)) else {
            return (DQuat::IDENTITY, 0.0);
        };
        // The sign of a quaternion says nothing: it follows the mean, which a few rounds settle.
        for _ in 0..3 {
            let sum = self.frames.iter().fold(DVec4::ZERO, |sum, world| {
                let turn = DVec4::from(turn(world));
                sum + turn * turn.dot(DVec4::from(mean)).signum()
            });
            if sum.length() > 1e-6 {
                mean = DQuat::from_vec4(sum.normalize());
            }
        }
        let square = self.mean(|world| {
            let apart = turn(world).dot(mean).abs().min(1.0);
            (2.0 * apart.acos()).powi(2)
        });
        (mean, square.sqrt())
    }

    /// The hinge between three source joints of a limb; none where it hardly bends or bends about
    /// many axes.
    pub fn hinge(&self, [start, middle, end]: [usize; 3]) -> Option<Hinge> {
        let bend = |world: &World| {
            let bend = bone(world, start, middle).cross(bone(world, middle, end));
            if bend.length() < LEAST_BEND {
                DVec3::ZERO
            } else {
                bend
            }
        };
        let total = self.mean(|world| bend(world).length());
        let in_upper = self.mean_in(start, bend);
        let in_lower = self.mean_in(middle, bend);
        let is_one_axis = in_upper.length() > ONE_AXIS * total && total > LEAST_MEAN_BEND;
        Some(Hinge {
            in_upper: in_upper.try_normalize().filter(|_| is_one_axis)?,
            in_lower: in_lower.try_normalize()?,
        })
    }

    /// An axis of the body's limb in the rest space of its source joint, if the limb is least twisted
    /// against `parent` (its source joint and alignment) on average: from rest to every frame it takes
    /// the shortest way.
    pub fn untwisted(
        &self,
        [joint, to]: [usize; 2],
        (parent, parent_turn): (usize, DQuat),
        target_bone: DVec3,
        axis: DVec3,
    ) -> DVec3 {
        let target_bone = target_bone.normalize_or_zero();
        self.mean_in(joint, |world| {
            let turn = world[parent].0 * parent_turn;
            let bone = turn.inverse() * bone(world, joint, to);
            if bone == DVec3::ZERO || target_bone == DVec3::ZERO {
                return DVec3::ZERO;
            }
            turn * DQuat::from_rotation_arc(target_bone, bone) * axis
        })
    }
}

/// Direction from source joint to source joint at a frame.
pub fn bone(world: &World, from: usize, to: usize) -> DVec3 {
    (world[to].1 - world[from].1).normalize_or_zero()
}
