//! What retargeting asks of a file's motion.

use dynaskin_body::Joint;
use glam::{DQuat, DVec3};

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
}
