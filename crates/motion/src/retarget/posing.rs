//! The body's poses from the source's frames, by an alignment.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3};

use super::align::Alignment;
use super::mapping::Drive;
use super::skeleton::Source;
use super::source::World;

/// Frames from a word about the progress to the next: some milliseconds.
const FRAMES_BETWEEN_NEWS: usize = 1_000;

/// Poses of every `every`-th frame; `progress` is told the fraction that is done.
pub fn poses(
    source: &Source<'_>,
    alignment: &Alignment,
    target_m: &[DVec3; JOINT_COUNT],
    scale: f64,
    every: usize,
    progress: &mut dyn FnMut(f64),
) -> Vec<Pose> {
    let mut world = World::default();
    let count = source.motion.frame_count();
    (0..count)
        .step_by(every.max(1))
        .map(|frame| {
            if frame.is_multiple_of(FRAMES_BETWEEN_NEWS) {
                progress(frame as f64 / count as f64);
            }
            source.needed_world(frame, &mut world);
            pose(source, &world.joints, alignment, target_m, scale)
        })
        .collect()
}

fn pose(
    source: &Source<'_>,
    world: &[(DQuat, DVec3)],
    alignment: &Alignment,
    target_m: &[DVec3; JOINT_COUNT],
    scale: f64,
) -> Pose {
    let rotation = |joint: usize| world[joint].0;
    let mut target_rotation = [DQuat::IDENTITY; JOINT_COUNT];
    let mut pose = Pose::REST;
    for joint in Joint::ALL {
        let idx = joint as usize;
        let parent = joint
            .parent()
            .map_or(DQuat::IDENTITY, |parent| target_rotation[parent as usize]);
        target_rotation[idx] = match source.mapping.drives[idx] {
            Drive::Joint(own) => rotation(own) * alignment.source_from_target[idx],
            Drive::Between(low, high, fraction) => {
                let [low, high] =
                    [low, high].map(|joint| rotation(joint) * alignment.of_source[joint]);
                low.slerp(high, fraction)
            }
            Drive::Parent => parent,
        };
        pose.parent_from_joint[idx] = (parent.inverse() * target_rotation[idx]).normalize();
    }
    // Pelvis joints sit at different heights in different skeletons; the hips do not.
    let hips = |position: &dyn Fn(Joint) -> DVec3| {
        (position(Joint::LeftHip) + position(Joint::RightHip)) / 2.0
    };
    let source_hips = hips(&|joint| world[source.source_joint(joint)].1);
    let pelvis_m = target_m[Joint::Pelvis as usize];
    let hips_from_pelvis_m = hips(&|joint| target_m[joint as usize]) - pelvis_m;
    pose.root_translation_m =
        scale * source_hips - target_rotation[0] * hips_from_pelvis_m - pelvis_m;
    pose
}
