//! What the compared methods take as input: poses themselves.

use dynaskin_skeleton::{JOINT_COUNT, Joint, Pose, rotation_vector};

/// Joints in DSNet's pose vector: SMPL's but for the hands.
pub(super) const POSE_SHAPE_JOINTS: usize = 22;

/// Numbers of a pose in `pose-shape`: root translation, and a rotation vector for each joint.
pub(super) const POSE_SHAPE_POSE_COUNT: usize = 3 + 3 * POSE_SHAPE_JOINTS;

/// Numbers of a pose in `pose-window`: root translation, and a rotation vector for each joint.
pub(super) const WINDOW_POSE_COUNT: usize = 3 + 3 * JOINT_COUNT;

/// Poses in `pose-window`.
pub(super) const WINDOW_POSES: usize = 3;

/// Writes DSNet's pose vector to the start of `features`.
pub(super) fn write_pose_shape(pose: &Pose, features: &mut [f32]) {
    write_pose(pose, POSE_SHAPE_JOINTS, features);
}

/// Writes `pose` and the `past` poses (newest first) to the start of `features`; where there are
/// fewer, the oldest is repeated.
pub(super) fn write_window(pose: &Pose, past: [Option<&Pose>; 2], features: &mut [f32]) {
    let [before, earlier] = past;
    let before = before.unwrap_or(pose);
    let poses: [&Pose; WINDOW_POSES] = [pose, before, earlier.unwrap_or(before)];
    for (pose, target) in poses
        .into_iter()
        .zip(features.chunks_exact_mut(WINDOW_POSE_COUNT))
    {
        write_pose(pose, JOINT_COUNT, target);
    }
}

/// Root translation in metres, then the rotation vectors of the first `joints` joints in radians.
fn write_pose(pose: &Pose, joints: usize, target: &mut [f32]) {
    target[..3].copy_from_slice(&pose.root_translation_m.as_vec3().to_array());
    let rotations = pose.parent_from_joint.iter().take(joints);
    for (rotation, target) in rotations.zip(target[3..].chunks_exact_mut(3)) {
        target.copy_from_slice(&rotation_vector(*rotation).as_vec3().to_array());
    }
}

/// Names of the numbers of one pose.
pub(super) fn pose_names(suffix: &str, joints: usize) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z"]
        .map(|axis| format!("root_translation{suffix}.{axis}"))
        .into();
    for joint in Joint::ALL.into_iter().take(joints) {
        names.extend(["x", "y", "z"].map(|a| format!("{}.rotation{suffix}.{a}", joint.name())));
    }
    names
}
