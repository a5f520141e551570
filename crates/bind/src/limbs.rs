//! Limbs stretched to an avatar's joints, and each joint's skin shifted to the avatar's.
//!
//! Linear shapes have one thigh length per stature; people and rigs have many. Hips and shoulders
//! stay where the body has them, because the conventions of rigs for them differ by centimetres.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, ShapedBody};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use nalgebra::{DMatrix, DVector};

use crate::BindError;
use crate::basis::{Basis, Placement};
use crate::bones::Bones;
use crate::samples::{Match, Samples};

/// Rounds of closest points in which the joints' skin shifts.
const ROUNDS: usize = 4;
/// Weight of the difference between the shifts of a joint and of its parent.
const SHIFT_PRIOR: f64 = 2.0;
/// How much longer and shorter than the fitted body's a bone may be.
const STRETCHES: (f64, f64) = (0.7, 1.4);

const LIMBS: [[Joint; 3]; 4] = [
    [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
    [Joint::RightHip, Joint::RightKnee, Joint::RightAnkle],
    [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist],
    [Joint::RightShoulder, Joint::RightElbow, Joint::RightWrist],
];

/// The body as it lies under the avatar's skin.
#[derive(Clone, Debug)]
pub struct FittedBody {
    /// Metres, the avatar's bind pose, `[vertex]`.
    pub positions_m: Vec<Vec3>,
    /// World rotations of the joints, from the body's rest pose.
    pub turns: [DQuat; JOINT_COUNT],
}

/// # Errors
/// [`BindError::NoFit`].
pub fn fit_limbs(
    body: &BodyModel,
    bones: &Bones,
    samples: &Samples,
    placement: &Placement,
    mut turns: [DQuat; JOINT_COUNT],
) -> Result<FittedBody, BindError> {
    let shaped = body.shaped(&placement.shape.map(|beta| beta as f32));
    let posed = Basis::new(body, &turns, &vec![false; body.vertex_count()]).joints_m(placement);
    let mut parts = stretched(bones, &shaped, placement, &posed, &mut turns);
    let mut positions_m = skinned(body, &shaped, &parts);
    for _ in 0..ROUNDS {
        let matches = samples.matches(&positions_m);
        let shifts = shifts(body, &matches, &positions_m)?;
        for (part, shift) in parts.iter_mut().zip(shifts) {
            part.translation += shift;
        }
        positions_m = skinned(body, &shaped, &parts);
    }
    Ok(FittedBody { positions_m, turns })
}

/// Where each joint takes the shaped body, with limbs stretched to the avatar's joints.
fn stretched(
    bones: &Bones,
    shaped: &ShapedBody,
    placement: &Placement,
    posed_m: &[Vec3; JOINT_COUNT],
    turns: &mut [DQuat; JOINT_COUNT],
) -> [DAffine3; JOINT_COUNT] {
    let rest = |joint: Joint| shaped.joints_m[joint as usize].as_dvec3();
    let moved = |linear: DMat3, joint: Joint, to: DVec3| DAffine3 {
        matrix3: linear,
        translation: to - linear * rest(joint),
    };
    let rigid = |turn: DQuat| DMat3::from_quat(turn) * placement.size;
    let mut parts = Joint::ALL.map(|joint| {
        let idx = joint as usize;
        moved(rigid(turns[idx]), joint, posed_m[idx].as_dvec3())
    });
    for limb in LIMBS {
        let mut from = posed_m[limb[0] as usize].as_dvec3();
        for [joint, next] in [[limb[0], limb[1]], [limb[1], limb[2]]] {
            let idx = joint as usize;
            let bone = rest(next) - rest(joint);
            let Some(along) = bone.try_normalize() else {
                continue;
            };
            let own = turns[idx] * bone * placement.size;
            let wanted = bones.place_m(next).map_or(own, |place_m| place_m - from);
            let stretch = wanted.length() / own.length();
            let stretch = stretch.clamp(STRETCHES.0, STRETCHES.1);
            if let (Some(own), Some(wanted)) = (own.try_normalize(), wanted.try_normalize()) {
                turns[idx] = DQuat::from_rotation_arc(own, wanted) * turns[idx];
            }
            let outer = DMat3::from_cols(along * along.x, along * along.y, along * along.z);
            let linear = rigid(turns[idx]) * (DMat3::IDENTITY + outer * (stretch - 1.0));
            parts[idx] = moved(linear, joint, from);
            from = parts[idx].transform_point3(rest(next));
            parts[next as usize] = moved(rigid(turns[next as usize]), next, from);
        }
        // What hangs on the limb's end goes with it, as stiff as it was.
        let end = limb[2];
        let last = match end {
            Joint::LeftAnkle => Joint::LeftFoot,
            Joint::RightAnkle => Joint::RightFoot,
            Joint::LeftWrist => Joint::LeftHand,
            _ => Joint::RightHand,
        };
        if matches!(end, Joint::LeftWrist | Joint::RightWrist) {
            // A hand is turned as its forearm is.
            turns[end as usize] = turns[limb[1] as usize];
            turns[last as usize] = turns[limb[1] as usize];
            parts[end as usize] = moved(rigid(turns[end as usize]), end, from);
        }
        let at = parts[end as usize].transform_point3(rest(last));
        parts[last as usize] = moved(rigid(turns[last as usize]), last, at);
    }
    parts
}

fn skinned(body: &BodyModel, shaped: &ShapedBody, parts: &[DAffine3; JOINT_COUNT]) -> Vec<Vec3> {
    let parts = parts.map(|part| glam::Affine3A {
        matrix3: glam::Mat3A::from_cols(
            part.matrix3.x_axis.as_vec3().into(),
            part.matrix3.y_axis.as_vec3().into(),
            part.matrix3.z_axis.as_vec3().into(),
        ),
        translation: part.translation.as_vec3().into(),
    });
    let matrices = dynaskin_body::SkinMatrices {
        world_from_rest: parts,
    };
    let mut positions_m = vec![Vec3::ZERO; body.vertex_count()];
    dynaskin_body::skin_linear(&shaped.positions_m, &body.skin, &matrices, &mut positions_m);
    positions_m
}

/// Shifts of the joints' skin that bring the body closer to the avatar's, metres.
fn shifts(
    body: &BodyModel,
    matches: &[Match],
    positions_m: &[Vec3],
) -> Result<[DVec3; JOINT_COUNT], BindError> {
    const SIZE: usize = 3 * JOINT_COUNT;
    let mut gram = DMatrix::<f64>::zeros(SIZE, SIZE);
    let mut right = DVector::<f64>::zeros(SIZE);
    for found in matches {
        let normal = found.normal.as_dvec3();
        let miss = f64::from(found.height_m(positions_m));
        let weight = f64::from(found.weight);
        let shares = joint_shares(body, found);
        for (row, a) in &shares {
            for axis in 0..3 {
                let own = weight * a * normal[axis];
                right[3 * row + axis] += own * miss;
                for (column, b) in &shares {
                    for other in 0..3 {
                        gram[(3 * row + axis, 3 * column + other)] += own * b * normal[other];
                    }
                }
            }
        }
    }
    for joint in Joint::ALL {
        let own = 3 * joint as usize;
        for axis in 0..3 {
            gram[(own + axis, own + axis)] += SHIFT_PRIOR;
            if let Some(parent) = joint.parent() {
                let parent = 3 * parent as usize + axis;
                gram[(parent, parent)] += SHIFT_PRIOR;
                gram[(own + axis, parent)] -= SHIFT_PRIOR;
                gram[(parent, own + axis)] -= SHIFT_PRIOR;
            }
        }
    }
    let factor = gram.cholesky();
    let factor = factor.ok_or(BindError::NoFit("its skin lies nowhere near the body's"))?;
    let solution = factor.solve(&right);
    Ok(std::array::from_fn(|joint| {
        DVec3::from_array(std::array::from_fn(|axis| solution[3 * joint + axis]))
    }))
}

/// How much each joint moves a place of the body.
fn joint_shares(body: &BodyModel, found: &Match) -> Vec<(usize, f64)> {
    let mut shares = [0.0_f64; JOINT_COUNT];
    for (corner, share) in found.at.corners.iter().zip(found.at.shares) {
        let skin = &body.skin[*corner as usize];
        for (joint, weight) in skin.joints.iter().zip(skin.weights) {
            shares[usize::from(*joint)] += f64::from(share * weight);
        }
    }
    let shares = shares.into_iter().enumerate();
    shares.filter(|(_, share)| *share > 0.0).collect()
}
