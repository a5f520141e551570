//! What retargeting asks of a file's motion.

use dynaskin_body::Joint;
use glam::{DAffine3, DQuat, DVec3};

/// World rotations and positions of joints at a frame, in memory that one frame leaves to the next.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Rotation from the rest pose and position of each joint.
    pub joints: Vec<(DQuat, DVec3)>,
    /// What readers keep beside it.
    pub(crate) affine: Vec<DAffine3>,
}

/// A moving skeleton as a file describes it, in the file's unit of length and axes.
pub trait SourceMotion {
    /// Number of joints.
    fn joint_count(&self) -> usize;

    /// Name of a joint; empty where it must not be taken for a part of a person.
    fn name(&self, joint: usize) -> &str;

    /// The joint that the caller says is the body's `joint`, whatever its name.
    fn named_by_caller(&self, _joint: Joint) -> Option<usize> {
        None
    }

    /// Parent of a joint, which comes before it; none for a root.
    fn parent(&self, joint: usize) -> Option<usize>;

    /// Where the bone of a joint without children ends, relative to the joint in the rest pose, if
    /// the file tells.
    fn bone_end(&self, joint: usize) -> Option<DVec3>;

    /// Positions of all joints in the rest pose.
    fn rest_positions(&self) -> Vec<DVec3>;

    /// Number of frames, at least 1.
    fn frame_count(&self) -> usize;

    /// Time from a frame to the next, in seconds.
    fn frame_seconds(&self) -> f64;

    /// Rotation from the rest pose and position of every joint at a frame, in the file's world.
    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)>;

    /// As [`Self::world_joints`] for some joints: `joints` are ascending, each with all its ancestors.
    /// What stands in `world` for others means nothing.
    fn world_of(&self, frame: usize, joints: &[usize], world: &mut World) {
        let _ = joints;
        world.joints = self.world_joints(frame);
    }
}
