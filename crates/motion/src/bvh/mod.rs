//! Biovision Hierarchy files: skeleton and motion as text.
//!
//! The format has no standard. Read here is what the exporters of motion-capture suites write:
//! `HIERARCHY` with nested `ROOT`/`JOINT`/`End Site` blocks of `OFFSET` and `CHANNELS`, then
//! `MOTION` with one line of values per frame.

mod parse;
mod text;

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DQuat, DVec3};

use crate::clip::check_range;
use crate::options::{ReadOptions, find_named};
use crate::{MotionError, SourceMotion, World};

/// Largest number of joints read from a file.
pub const MAX_BVH_JOINTS: usize = 1024;
/// Largest number of channels of one joint.
pub const MAX_JOINT_CHANNELS: usize = 12;

/// One animated degree of freedom of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Position along x, y or z (0, 1, 2), in the file's unit of length, relative to the parent;
    /// takes the place of that component of the offset.
    Position(u8),
    /// Rotation about x, y or z (0, 1, 2), in degrees.
    Rotation(u8),
}

/// A joint of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// Name as written, trimmed.
    pub name: String,
    /// Index of the parent; none for a root. Parents come before their children.
    pub parent: Option<usize>,
    /// Rest position relative to the parent, in the file's unit of length.
    pub offset: DVec3,
    /// Channels in the order in which their values stand in a frame and their rotations multiply.
    pub channels: Vec<Channel>,
    /// Position of the first channel's value within a frame.
    pub first_channel: usize,
    /// Offset of the joint's first `End Site`, which tells where its bone points.
    pub end_site: Option<DVec3>,
}

/// A BVH file: skeleton and frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// Joints, parents first.
    pub joints: Vec<BvhJoint>,
    /// Time step in seconds.
    pub frame_seconds: f64,
    /// Values per frame: the sum of all joints' channels, at least 1.
    channel_count: usize,
    /// Frame after frame, `[frame][channel]`.
    values: Vec<f64>,
    /// Where the file breaks off, if it does.
    break_off: Option<BreakOff>,
    /// The joints that the caller named.
    named: [Option<usize>; JOINT_COUNT],
}

/// A file that ends before all its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BreakOff {
    /// Last line, counted from 1.
    pub line: usize,
    /// Whole frames, which were kept.
    pub whole_frames: usize,
    /// Frames that the file announced.
    pub announced_frames: usize,
}

impl std::fmt::Display for BreakOff {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "the file breaks off at line {}: {} of {} frames are whole and were kept",
            self.line, self.whole_frames, self.announced_frames
        )
    }
}

impl Bvh {
    /// Reads a file. Unknown rotation orders, position channels anywhere, any line ends and cases
    /// of keywords are taken; lengths stay in the file's unit.
    ///
    /// A file that ends early keeps its whole frames ([`Self::break_off`]); UTF-16 is recognised by
    /// its byte order mark; lines before `HIERARCHY` that begin with `#`, `//` or `;` are passed over.
    /// A frame time that is a usual rate, rounded (0.0333), counts as that rate.
    ///
    /// # Errors
    /// [`MotionError`] naming the line and what was expected there.
    pub fn parse(bytes: &[u8]) -> Result<Self, MotionError> {
        match text::utf8_from_utf16(bytes) {
            Some(text) => parse::parse(text.as_bytes()),
            None => parse::parse(bytes),
        }
    }

    /// Reads a file of which the caller knows more.
    ///
    /// # Errors
    /// As [`Self::parse`]; [`MotionError::NamedJoint`], [`MotionError::OptionNotForFile`],
    /// [`MotionError::Parameter`] for a rate outside 0.1 to 10,000 Hz.
    pub fn parse_with(bytes: &[u8], options: &ReadOptions) -> Result<Self, MotionError> {
        options.check_unused("BVH", &["animation", "up axis"])?;
        let mut bvh = Self::parse(bytes)?;
        if let Some(rate_hz) = options.rate_hz {
            check_range("the rate", rate_hz, 0.1, 1e4)?;
            bvh.frame_seconds = 1.0 / rate_hz;
        }
        let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
        bvh.named = find_named(&options.joints, &names)?;
        Ok(bvh)
    }

    /// Whether a file begins as BVH does.
    pub(crate) fn begins(bytes: &[u8]) -> bool {
        match text::utf8_from_utf16(bytes) {
            Some(text) => parse::begins(text.as_bytes()),
            None => parse::begins(bytes),
        }
    }

    /// Where the file breaks off; none for a whole file.
    pub fn break_off(&self) -> Option<BreakOff> {
        self.break_off
    }

    /// The channel values of a frame in the file's order. `frame` is below [`SourceMotion::frame_count`].
    pub fn frame_values(&self, frame: usize) -> &[f64] {
        &self.values[frame * self.channel_count..(frame + 1) * self.channel_count]
    }

    /// The joint's rotation relative to its parent: the product of its rotation channels from the
    /// first to the last (column vectors: `Zrotation Xrotation Yrotation` is `Rz Rx Ry`).
    pub fn parent_from_joint(&self, frame: usize, joint: usize) -> DQuat {
        let mut rotation = DQuat::IDENTITY;
        for (channel, value) in self.channels(frame, joint) {
            if let Channel::Rotation(axis) = channel {
                rotation *= DQuat::from_axis_angle(DVec3::AXES[axis as usize], value.to_radians());
            }
        }
        rotation
    }

    /// The joint's position relative to its parent, in the file's unit.
    pub fn joint_in_parent(&self, frame: usize, joint: usize) -> DVec3 {
        let mut position = self.joints[joint].offset;
        for (channel, value) in self.channels(frame, joint) {
            if let Channel::Position(axis) = channel {
                position[axis as usize] = value;
            }
        }
        position
    }

    fn channels(&self, frame: usize, joint: usize) -> impl Iterator<Item = (Channel, f64)> {
        let joint = &self.joints[joint];
        let values = &self.frame_values(frame)[joint.first_channel..];
        joint.channels.iter().copied().zip(values.iter().copied())
    }
}

impl SourceMotion for Bvh {
    fn joint_count(&self) -> usize {
        self.joints.len()
    }

    fn name(&self, joint: usize) -> &str {
        &self.joints[joint].name
    }

    fn named_by_caller(&self, joint: Joint) -> Option<usize> {
        self.named[joint as usize]
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        self.joints[joint].parent
    }

    fn bone_end(&self, joint: usize) -> Option<DVec3> {
        self.joints[joint].end_site
    }

    fn frame_count(&self) -> usize {
        self.values.len() / self.channel_count
    }

    fn frame_seconds(&self) -> f64 {
        self.frame_seconds
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let all: Vec<usize> = (0..self.joints.len()).collect();
        let mut world = World::default();
        self.world_of(frame, &all, &mut world);
        world.joints
    }

    fn world_of(&self, frame: usize, joints: &[usize], world: &mut World) {
        let world = &mut world.joints;
        world.resize(self.joints.len(), (DQuat::IDENTITY, DVec3::ZERO));
        for &idx in joints {
            let rotation = self.parent_from_joint(frame, idx);
            let position = self.joint_in_parent(frame, idx);
            world[idx] = match self.joints[idx].parent {
                None => (rotation, position),
                Some(parent) => {
                    let (parent_rotation, parent_position) = world[parent];
                    (
                        (parent_rotation * rotation).normalize(),
                        parent_position + parent_rotation * position,
                    )
                }
            };
        }
    }

    /// Every rotation of the rest pose is zero.
    fn rest_positions(&self) -> Vec<DVec3> {
        let mut rest: Vec<DVec3> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let parent = joint.parent.map_or(DVec3::ZERO, |parent| rest[parent]);
            rest.push(parent + joint.offset);
        }
        rest
    }
}
