//! A file's skeleton as the body's joints see it.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DQuat, DVec3};

use super::mapping::Mapping;
use super::source::{SourceMotion, World};

/// A source skeleton with +Y up.
pub struct Source<'a> {
    pub motion: &'a dyn SourceMotion,
    pub mapping: Mapping,
    /// The joints that turn the body's and all their ancestors, ascending.
    pub needed: Vec<usize>,
    /// Rest positions turned to +Y up, file unit.
    pub rest: Vec<DVec3>,
    /// Takes the file's axes to +Y up.
    pub up_from_file: DQuat,
    /// What is to be said of the file's up.
    pub note: Option<&'static str>,
}

impl<'a> Source<'a> {
    /// As the file has it, whatever is up there.
    pub fn new(motion: &'a dyn SourceMotion, mapping: &Mapping) -> Self {
        Self {
            motion,
            mapping: mapping.clone(),
            needed: mapping.needed(motion),
            rest: motion.rest_positions(),
            up_from_file: DQuat::IDENTITY,
            note: None,
        }
    }

    /// The same skeleton with its rest pose turned.
    pub fn turned(mut self, up_from_file: DQuat, note: Option<&'static str>) -> Self {
        self.up_from_file = up_from_file;
        self.note = note;
        for position in &mut self.rest {
            *position = up_from_file * *position;
        }
        self
    }

    /// World rotations and positions at a frame, with +Y up.
    pub fn world(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let mut world = self.motion.world_joints(frame);
        for joint in &mut world {
            self.turn_up(joint);
        }
        world
    }

    /// As [`Self::world`] for the joints that are needed.
    pub fn needed_world(&self, frame: usize, world: &mut World) {
        self.motion.world_of(frame, &self.needed, world);
        for joint in &self.needed {
            self.turn_up(&mut world.joints[*joint]);
        }
    }

    /// Turns a joint's rotation and position to +Y up.
    fn turn_up(&self, (rotation, position): &mut (DQuat, DVec3)) {
        if self.up_from_file != DQuat::IDENTITY {
            *rotation = self.up_from_file * *rotation * self.up_from_file.inverse();
            *position = self.up_from_file * *position;
        }
    }

    pub fn source_joint(&self, joint: Joint) -> usize {
        self.mapping.source(joint).unwrap_or(0)
    }

    /// Rest position of the source joint of `joint`.
    pub fn rest_of(&self, joint: Joint) -> Option<DVec3> {
        Some(self.rest[self.mapping.source(joint)?])
    }

    /// Rest position of the end of a joint's bone where no joint of ours ends it.
    pub fn end_of(&self, joint: Joint) -> Option<DVec3> {
        let source = self.mapping.source(joint)?;
        let end = self.motion.bone_end(source)?;
        Some(self.rest[source] + self.up_from_file * end)
    }

    pub fn leg_length(&self) -> f64 {
        leg_length(&Joint::ALL.map(|joint| self.rest_of(joint).unwrap_or_default()))
    }
}

/// Hip to knee to ankle on the left.
pub fn leg_length(rest: &[DVec3; JOINT_COUNT]) -> f64 {
    let [hip, knee, ankle] =
        [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle].map(|joint| rest[joint as usize]);
    hip.distance(knee) + knee.distance(ankle)
}
