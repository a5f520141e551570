//! Poses as flat arrays: translation, then 24 quaternions x, y, z, w.

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::{DQuat, DVec3};

use crate::error::Thrown;

/// Numbers of a pose.
pub(crate) const POSE_LENGTH: usize = 3 + 4 * JOINT_COUNT;

/// The pose of a flat array.
pub(crate) fn from_numbers(numbers: &[f64]) -> Result<Pose, Thrown> {
    check_length(numbers.len())?;
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::from_slice(numbers);
    for (rotation, quaternion) in pose
        .parent_from_joint
        .iter_mut()
        .zip(numbers[3..].chunks_exact(4))
    {
        *rotation = DQuat::from_slice(quaternion);
    }
    Ok(pose)
}

/// Writes `pose` into a flat array.
pub(crate) fn to_numbers(pose: &Pose, numbers: &mut [f64]) -> Result<(), Thrown> {
    check_length(numbers.len())?;
    pose.root_translation_m.write_to_slice(numbers);
    for (rotation, quaternion) in pose
        .parent_from_joint
        .iter()
        .zip(numbers[3..].chunks_exact_mut(4))
    {
        rotation.write_to_slice(quaternion);
    }
    Ok(())
}

fn check_length(length: usize) -> Result<(), Thrown> {
    if length == POSE_LENGTH {
        Ok(())
    } else {
        Err(Thrown::argument(format!(
            "A pose has {POSE_LENGTH} numbers (3 for the translation, then 4 for each of \
             {JOINT_COUNT} joints), this array has {length}."
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_round_trip_and_wrong_lengths_are_refused() {
        let numbers: Vec<f64> = (0..POSE_LENGTH).map(|n| n as f64 * 0.01).collect();
        let Ok(pose) = from_numbers(&numbers) else {
            panic!("99 numbers are a pose");
        };
        assert_eq!(pose.root_translation_m, DVec3::new(0.0, 0.01, 0.02));
        let mut back = vec![0.0; POSE_LENGTH];
        assert!(to_numbers(&pose, &mut back).is_ok());
        assert_eq!(numbers, back);
        assert!(from_numbers(&numbers[1..]).is_err());
        assert!(to_numbers(&pose, &mut back[..98]).is_err());
    }
}
