//! Skeletons with other zero poses, axes, names and joints that move as a known one does.

use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{Clip, SourceMotion};
use glam::{DQuat, DVec3, Vec3};

/// A clip of the body's own as a file would have it.
pub struct OfBody<'a> {
    pub clip: &'a Clip,
    pub rest_m: [Vec3; JOINT_COUNT],
}

impl SourceMotion for OfBody<'_> {
    fn joint_count(&self) -> usize {
        JOINT_COUNT
    }

    fn name(&self, joint: usize) -> &str {
        Joint::ALL[joint].name()
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        Joint::ALL[joint].parent().map(|parent| parent as usize)
    }

    fn bone_end(&self, _joint: usize) -> Option<DVec3> {
        None
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        self.rest_m.map(|joint| joint.as_dvec3()).to_vec()
    }

    fn frame_count(&self) -> usize {
        self.clip.frames.len()
    }

    fn frame_seconds(&self) -> f64 {
        1.0 / self.clip.rate_hz
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let world = self.clip.frames[frame].world_joints(&self.rest_m);
        Joint::ALL
            .map(|joint| {
                (
                    world.rotation[joint as usize],
                    world.position_m[joint as usize],
                )
            })
            .to_vec()
    }
}

/// The same motion with another zero pose.
pub struct Rezeroed<'a> {
    pub inner: &'a dyn SourceMotion,
    /// World rotations of the joints in the new zero pose, from the old one.
    pub zero: Vec<DQuat>,
    /// Left is called right, and the other way round.
    pub is_swapped: bool,
    /// Turns the world of the motion, not of the zero pose, and then shifts it.
    pub world: DQuat,
    pub shift: DVec3,
}

impl<'a> Rezeroed<'a> {
    /// A zero pose of these world rotations.
    pub fn new(inner: &'a dyn SourceMotion, zero: Vec<DQuat>) -> Self {
        Self {
            inner,
            zero,
            is_swapped: false,
            world: DQuat::IDENTITY,
            shift: DVec3::ZERO,
        }
    }

    /// A zero pose in which joints are turned against their parents, about axes of the old one.
    pub fn posed(inner: &'a dyn SourceMotion, turns: &[(usize, DQuat)]) -> Self {
        let mut zero: Vec<DQuat> = Vec::new();
        for joint in 0..inner.joint_count() {
            let parent = inner
                .parent(joint)
                .map_or(DQuat::IDENTITY, |parent| zero[parent]);
            let own = turns.iter().find(|(turned, _)| *turned == joint);
            zero.push(parent * own.map_or(DQuat::IDENTITY, |(_, turn)| *turn));
        }
        Self::new(inner, zero)
    }
}

impl SourceMotion for Rezeroed<'_> {
    fn joint_count(&self) -> usize {
        self.inner.joint_count()
    }

    fn name(&self, joint: usize) -> &str {
        let name = self.inner.name(joint);
        let mirrored = Joint::ALL
            .into_iter()
            .find(|joint| joint.name() == name)
            .map(|joint| joint.mirrored().name());
        mirrored.filter(|_| self.is_swapped).unwrap_or(name)
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        self.inner.parent(joint)
    }

    fn bone_end(&self, joint: usize) -> Option<DVec3> {
        Some(self.zero[joint] * self.inner.bone_end(joint)?)
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        let rest = self.inner.rest_positions();
        let mut zero: Vec<DVec3> = Vec::new();
        for joint in 0..rest.len() {
            zero.push(match self.parent(joint) {
                None => rest[joint],
                Some(parent) => zero[parent] + self.zero[parent] * (rest[joint] - rest[parent]),
            });
        }
        zero
    }

    fn frame_count(&self) -> usize {
        self.inner.frame_count()
    }

    fn frame_seconds(&self) -> f64 {
        self.inner.frame_seconds()
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let world = self.inner.world_joints(frame).into_iter();
        world
            .zip(&self.zero)
            .map(|((rotation, position), zero)| {
                (
                    self.world * rotation * zero.inverse(),
                    self.world * position + self.shift,
                )
            })
            .collect()
    }
}

/// The same motion by three joints at each place, of which the last one turns the bone as the only one
/// did and the first two turn as they like.
pub struct InThree<'a> {
    pub inner: &'a dyn SourceMotion,
}

/// Joints at one place.
const AT_ONE_PLACE: usize = 3;

impl SourceMotion for InThree<'_> {
    fn joint_count(&self) -> usize {
        AT_ONE_PLACE * self.inner.joint_count()
    }

    fn name(&self, joint: usize) -> &str {
        if joint.is_multiple_of(AT_ONE_PLACE) {
            self.inner.name(joint / AT_ONE_PLACE)
        } else {
            ""
        }
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        if joint.is_multiple_of(AT_ONE_PLACE) {
            let parent = self.inner.parent(joint / AT_ONE_PLACE)?;
            Some(AT_ONE_PLACE * parent + AT_ONE_PLACE - 1)
        } else {
            Some(joint - 1)
        }
    }

    fn bone_end(&self, joint: usize) -> Option<DVec3> {
        let is_last = (joint + 1).is_multiple_of(AT_ONE_PLACE);
        self.inner
            .bone_end(joint / AT_ONE_PLACE)
            .filter(|_| is_last)
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        let rest = self.inner.rest_positions().into_iter();
        rest.flat_map(|position| [position; AT_ONE_PLACE]).collect()
    }

    fn frame_count(&self) -> usize {
        self.inner.frame_count()
    }

    fn frame_seconds(&self) -> f64 {
        self.inner.frame_seconds()
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let world = self.inner.world_joints(frame).into_iter();
        let phase = 0.1 * frame as f64;
        let [first, second] = [
            DQuat::from_rotation_x(phase.sin()),
            DQuat::from_rotation_y(phase.cos()),
        ];
        world
            .flat_map(|(rotation, position)| {
                [
                    (rotation * first, position),
                    (rotation * second, position),
                    (rotation, position),
                ]
            })
            .collect()
    }
}
