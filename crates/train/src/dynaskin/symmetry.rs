//! Left and right: what a mirror image (x to -x) does to the predictor's inputs, units and latents.
//!
//! A body is symmetric, so the mirror image of a motion has the mirror image of its offsets. A network
//! whose weights are tied by these permutations has that by construction: each matrix of weights is the
//! mean of itself and of itself with rows and columns mirrored. It needs no mirrored clips, and half of
//! its weights are free.

use dynaskin_body::Joint;
use dynaskin_runtime::features::INERTIAL_JOINTS;

use super::inputs::KIND;
use super::spin::FACTORS;

/// Signs under a mirror image of a vector along x, y and z.
const VECTOR: [f32; 3] = [-1.0, 1.0, 1.0];
/// The same of an axis of rotation.
const AXIAL: [f32; 3] = [1.0, -1.0, -1.0];

/// Where each number of a row goes in its mirror image, and with which sign.
#[derive(Clone, Debug, PartialEq)]
pub struct SignedPermutation {
    /// `mirrored[i] = sign[i] · row[partner[i]]`. It is its own inverse.
    pub partner: Vec<usize>,
    /// 1 or -1.
    pub sign: Vec<f32>,
}

impl SignedPermutation {
    /// Nothing changes.
    pub fn identity(count: usize) -> Self {
        Self {
            partner: (0..count).collect(),
            sign: vec![1.0; count],
        }
    }

    /// Number of a row's numbers.
    pub fn count(&self) -> usize {
        self.partner.len()
    }

    /// The rows of several, end to end.
    pub fn concat(parts: &[&Self]) -> Self {
        let mut all = Self::identity(0);
        for part in parts {
            let first = all.count();
            all.partner.extend(part.partner.iter().map(|p| first + p));
            all.sign.extend_from_slice(&part.sign);
        }
        all
    }

    /// The same places without a change of sign: of numbers that only scale others.
    pub fn unsigned(&self) -> Self {
        Self {
            partner: self.partner.clone(),
            sign: vec![1.0; self.count()],
        }
    }

    /// The same row several times.
    pub fn repeat(&self, times: usize) -> Self {
        Self::concat(&vec![self; times])
    }

    /// Of the numbers about the motion ([`super::PredictorInputs::motion`]).
    pub fn of_motion() -> Self {
        Self::concat(&[&Self::of_features(), &Self::of_spins()])
    }

    /// Of the runtime's motion features.
    pub(super) fn of_features() -> Self {
        let rotation = |row: usize, column: usize| VECTOR[row] * VECTOR[column];
        let columns = [0, 1].map(|column| [0, 1, 2].map(|row| rotation(row, column)));
        Self::concat(&[
            &of_joints(&INERTIAL_JOINTS, &[VECTOR, AXIAL, AXIAL].concat()),
            &of_joints(KIND.rotation_joints(), columns.as_flattened()),
        ])
    }

    /// Of the products of angular velocities.
    pub(super) fn of_spins() -> Self {
        let signs = FACTORS.map(|(a, b)| AXIAL[a] * AXIAL[b]);
        of_joints(&INERTIAL_JOINTS, &signs)
    }
}

/// Of numbers of each of `joints`, which have these signs.
fn of_joints(joints: &[Joint], signs: &[f32]) -> SignedPermutation {
    let mut all = SignedPermutation::identity(0);
    for joint in joints {
        let mirrored = joint.mirrored();
        let place = joints.iter().position(|other| *other == mirrored);
        // Features list joints in pairs.
        let first = place.unwrap_or(0) * signs.len();
        all.partner.extend((0..signs.len()).map(|i| first + i));
        all.sign.extend_from_slice(signs);
    }
    all
}

/// Scales, each one over a deviation, of which a number and its mirror image have the same: one over the
/// root of the mean of their squares.
pub(super) fn tied_scale(scales: &[f32], mirror: &SignedPermutation) -> Vec<f32> {
    let pairs = scales.iter().zip(&mirror.partner);
    pairs
        .map(|(scale, partner)| {
            let squares = scale.powi(-2) + scales[*partner].powi(-2);
            (0.5 * squares).sqrt().recip()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use dynaskin_body::{Pose, SHAPE_COUNT};
    use dynaskin_runtime::features::{FeatureKind, MotionFeatures};
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::dynaskin::PredictorInputs;
    use crate::dynaskin::spin::{SPIN_COUNT, Spin};
    use crate::fixture;

    fn mirrored(pose: &Pose) -> Pose {
        let clip = dynaskin_motion::Clip {
            name: String::new(),
            rate_hz: 60.0,
            frames: vec![pose.clone()],
        };
        clip.mirrored().frames.remove(0)
    }

    #[test]
    fn features_of_a_mirrored_motion_are_the_mirrored_features() {
        let permutation = SignedPermutation::of_motion();
        assert_eq!(permutation.count(), PredictorInputs::MOTION_COUNT);
        let body = fixture::symmetric_body(4).shaped(&[0.0; SHAPE_COUNT]);
        let kind = FeatureKind::InertialMaterials;
        let features = || MotionFeatures::new(kind, &body.joints_m, &[0.0; SHAPE_COUNT]);
        let (mut left, mut right) = (features(), features());
        let spin = Spin {
            scale: vec![1.0; SPIN_COUNT],
        };
        for tick in 0..5 {
            let mut pose = Pose::REST;
            let t = f64::from(tick);
            pose.root_translation_m = DVec3::new(0.02 * t * t, 0.9, -0.01 * t * t);
            for joint in Joint::ALL {
                let axis = DVec3::new(1.0, 0.3 * joint as usize as f64, -0.7).normalize();
                pose.parent_from_joint[joint as usize] =
                    DQuat::from_axis_angle(axis, 0.02 * t * (1.0 + joint as usize as f64).sin());
            }
            let all =
                |features: &[f32]| [&features[..kind.motion_count()], &spin.of(features)].concat();
            let (left, right) = (all(left.push(&pose)), all(right.push(&mirrored(&pose))));
            for (i, got) in right.iter().enumerate() {
                let expected = permutation.sign[i] * left[permutation.partner[i]];
                assert!(
                    (got - expected).abs() < 1e-3,
                    "{tick} {i}: {got} {expected}"
                );
            }
        }
    }
}
