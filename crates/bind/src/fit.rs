//! Size and shape of the body that lies closest under an avatar's skin.

use dynaskin_body::{BodyModel, Joint};
use glam::{DQuat, Vec3};
use nalgebra::{SMatrix, SVector};

use crate::basis::{BASIS_COUNT, Basis, Placement, UNKNOWNS};
use crate::bones::Bones;
use crate::samples::{Match, Samples};
use crate::{BindError, JOINT_COUNT};

/// Rounds of closest points.
const ROUNDS: usize = 8;
/// Square metres per squared standard deviation.
const SHAPE_PRIOR: f64 = 0.002;
/// Weight of a joint's distance over that of a surface point.
const JOINT_WEIGHT: f64 = 1.5;
/// Largest shape coefficient.
const MOST_SHAPE: f64 = 3.5;
/// Sizes between which a fit is one, for avatars in metres.
const SIZES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// The joints that skeletons agree on within centimetres.
const AGREED: [Joint; 12] = [
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
    Joint::LeftWrist,
    Joint::RightWrist,
];

type Gram = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Right = SVector<f64, UNKNOWNS>;

/// Fits the body in the pose `turns`: by the joints, then by closest points.
///
/// # Errors
/// [`BindError::NoFit`].
pub fn fit_shape(
    body: &BodyModel,
    bones: &Bones,
    samples: &Samples,
    turns: &[DQuat; JOINT_COUNT],
) -> Result<Placement, BindError> {
    let basis = Basis::new(body, turns, &samples.wanted);
    let start = Equations::of_joints(&basis, bones, 1.0);
    let mut placement = start.solved(&Placement {
        size: 1.0,
        shape: [0.0; BASIS_COUNT - 1],
        translation_m: [0.0; 3],
    })?;
    for _ in 0..ROUNDS {
        let positions_m = basis.placed(&placement);
        let mut equations = Equations::of_joints(&basis, bones, JOINT_WEIGHT);
        for found in samples.matches(&positions_m) {
            equations.add_point(&basis, &found);
        }
        placement = equations.solved(&placement)?;
    }
    Ok(placement.with_stature(body, MOST_SHAPE))
}

/// Normal equations of the fit.
struct Equations {
    gram: Gram,
    right: Right,
}

impl Equations {
    fn of_joints(basis: &Basis, bones: &Bones, weight: f64) -> Self {
        let mut equations = Self {
            gram: Gram::zeros(),
            right: Right::zeros(),
        };
        for joint in AGREED {
            if let Some(place_m) = bones.place_m(joint) {
                let row = &basis.joints[joint as usize];
                for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                    let along = place_m.dot(axis.as_dvec3());
                    equations.add(|k| row[k].dot(axis), axis, along, weight);
                }
            }
        }
        equations
    }

    fn add_point(&mut self, basis: &Basis, found: &Match) {
        let rows = found
            .at
            .corners
            .map(|corner| &basis.vertices[corner as usize]);
        let along = |k: usize| {
            let corners = rows.iter().zip(found.at.shares);
            let mixed: Vec3 = corners.map(|(row, share)| row[k] * share).sum();
            mixed.dot(found.normal)
        };
        let target = f64::from(found.position_m.dot(found.normal));
        self.add(along, found.normal, target, f64::from(found.weight));
    }

    /// Adds a plane: `axis` · the posed place is `target`.
    fn add(&mut self, along: impl Fn(usize) -> f32, axis: Vec3, target: f64, weight: f64) {
        let row = Right::from_fn(|idx, _| match idx.checked_sub(BASIS_COUNT) {
            None => f64::from(along(idx)),
            Some(component) => f64::from(axis[component]),
        });
        self.gram.ger(weight, &row, &row, 1.0);
        self.right.axpy(weight * target, &row, 1.0);
    }

    fn solved(mut self, before: &Placement) -> Result<Placement, BindError> {
        // The unknowns are size times β.
        let prior = SHAPE_PRIOR / (before.size * before.size);
        for k in 1..BASIS_COUNT {
            self.gram[(k, k)] += prior;
        }
        let factor = nalgebra::linalg::Cholesky::new(self.gram);
        let solution = factor.ok_or(BindError::NoFit("its joints stand at one place"))?;
        let solution = solution.solve(&self.right);
        let unknowns: [f64; UNKNOWNS] = std::array::from_fn(|idx| solution[idx]);
        let placement = Placement::from_unknowns(&unknowns, MOST_SHAPE);
        let is_finite = unknowns.iter().all(|x| x.is_finite());
        if is_finite && SIZES.contains(&placement.size) {
            Ok(placement)
        } else {
            Err(BindError::NoFit(
                "its bones have not the lengths of a person's",
            ))
        }
    }
}
