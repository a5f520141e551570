//! Vertices summed as products of small rigid motions of the bones they hang on.
//!
//! A skin vertex has at most four bones, but up to ten joints above them turn it. So vertices are summed over
//! bones, `Σ w_j w_k P_jᵀ A P_k` with `P_j (ω, v) = ω × x_j + v`, and only the sums are added up the tree:
//! what moves a joint moves all bones below it alike.

use dynaskin_body::{JOINT_COUNT, Joint, SkinWeights};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};

/// Three unknowns that move the bones at and below a joint as one body: by the turn `turn z` about the centre
/// and the shift `shift z` for unknowns z.
pub(crate) struct Branch {
    pub joint: usize,
    /// Number of the first of the three unknowns.
    pub unknown: usize,
    pub turn: DMat3,
    pub shift: DMat3,
}

/// A vertex's residual, and how it changes.
pub(crate) struct Linear<'a> {
    pub residual_m: DVec3,
    /// From differences in the world to differences of residuals.
    pub rest_from_world: DMat3,
    /// Weight in the sum of squares.
    pub weight: f64,
    /// Its derivative by unknowns that move no bones.
    pub own: &'a [DVec3],
}

/// Products of the twists of two bones.
#[derive(Clone, Copy)]
struct Product {
    turn_turn: DMat3,
    turn_shift: DMat3,
    shift_turn: DMat3,
    shift_shift: DMat3,
}

impl std::ops::AddAssign for Product {
    fn add_assign(&mut self, other: Self) {
        self.turn_turn += other.turn_turn;
        self.turn_shift += other.turn_shift;
        self.shift_turn += other.shift_turn;
        self.shift_shift += other.shift_shift;
    }
}

/// A product of a bone's twist with something else.
#[derive(Clone, Copy, Default)]
pub(crate) struct Slope {
    pub turn: DVec3,
    pub shift: DVec3,
}

impl std::ops::Mul<f64> for Slope {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            turn: self.turn * factor,
            shift: self.shift * factor,
        }
    }
}

impl std::ops::AddAssign for Slope {
    fn add_assign(&mut self, other: Self) {
        self.turn += other.turn;
        self.shift += other.shift;
    }
}

/// One bone of a vertex.
#[derive(Clone, Copy)]
struct Bone {
    joint: usize,
    weight: f64,
    /// Where it carries the vertex, from the centre, in metres.
    at_m: DVec3,
    /// `skew(at_m) A`.
    arm: DMat3,
}

/// The sums over vertices.
pub(crate) struct Twists {
    /// `[first][second]`; of vertices, only where the second bone is not after the first.
    products: Vec<[Product; JOINT_COUNT]>,
    slopes: [Slope; JOINT_COUNT],
    /// Of each own unknown with each bone.
    own_slopes: Vec<[Slope; JOINT_COUNT]>,
    /// The vertices' changes by the roots of their weights, `[vertex][axis][own]`.
    own_changes: Vec<f64>,
    own_gradient: DVector<f64>,
}

/// `a × b = skew(a) b`.
pub(crate) fn skew(a: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, a.z, -a.y),
        DVec3::new(-a.z, 0.0, a.x),
        DVec3::new(a.y, -a.x, 0.0),
    )
}

/// `skew(a) b`, column by column.
#[inline]
fn crossed(a: DVec3, b: &DMat3) -> DMat3 {
    DMat3::from_cols(a.cross(b.x_axis), a.cross(b.y_axis), a.cross(b.z_axis))
}

impl Twists {
    /// No vertices, with `own` unknowns that move no bones.
    pub fn new(own: usize) -> Self {
        Self {
            products: vec![[Product::ZERO; JOINT_COUNT]; JOINT_COUNT],
            slopes: [Slope::default(); JOINT_COUNT],
            own_slopes: vec![[Slope::default(); JOINT_COUNT]; own],
            own_changes: Vec::new(),
            own_gradient: DVector::zeros(own),
        }
    }

    /// Adds a vertex, which each of its bones carries to `carried_by`, in metres from the centre.
    #[inline]
    pub fn add(
        &mut self,
        skin: &SkinWeights,
        carried_by: impl Fn(usize) -> DVec3,
        linear: &Linear<'_>,
    ) {
        let to_rest = linear.rest_from_world * linear.weight;
        // Symmetric: between small motions in the world.
        let between = linear.rest_from_world.transpose() * to_rest;
        let pull = to_rest.transpose() * linear.residual_m;
        let mut bones = [Bone::NONE; 4];
        let mut count = 0;
        for (&joint, &weight) in skin.joints.iter().zip(&skin.weights) {
            if weight > 0.0 {
                let (joint, weight) = (usize::from(joint), f64::from(weight));
                let at_m = carried_by(joint);
                bones[count] = Bone {
                    joint,
                    weight,
                    at_m,
                    arm: crossed(at_m, &between),
                };
                count += 1;
                self.slopes[joint] += slope(&bones[count - 1], pull);
            }
        }
        let bones = &bones[..count];
        for one in bones {
            // Transposed, so that its columns are what `crossed` goes through.
            let arm = one.arm.transpose();
            for other in bones {
                if other.joint <= one.joint {
                    let weight = one.weight * other.weight;
                    let product = &mut self.products[one.joint][other.joint];
                    product.turn_turn += crossed(other.at_m, &arm) * weight;
                    product.turn_shift += one.arm * weight;
                    product.shift_turn += other.arm * weight;
                    product.shift_shift += between * weight;
                }
            }
        }
        for (own, (&change, slopes)) in linear.own.iter().zip(&mut self.own_slopes).enumerate() {
            let change = change * linear.weight;
            let pull = linear.rest_from_world.transpose() * change;
            for bone in bones {
                slopes[bone.joint] += slope(bone, pull);
            }
            self.own_gradient[own] += change.dot(linear.residual_m);
        }
        let root = linear.weight.sqrt();
        for axis in 0..3 {
            let changes = linear.own.iter().map(|change| change[axis] * root);
            self.own_changes.extend(changes);
        }
    }

    /// Hessian and gradient of `unknowns` unknowns: those of the branches, and the own ones, whose numbers are
    /// given.
    pub fn normal(
        mut self,
        branches: &[Branch],
        own: &[usize],
        unknowns: usize,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let mut hessian = DMatrix::zeros(unknowns, unknowns);
        let mut gradient = DVector::zeros(unknowns);
        self.sum_up_the_tree();
        for (index, one) in branches.iter().enumerate() {
            let along = one.along(&self.slopes);
            for axis in 0..3 {
                gradient[one.unknown + axis] += along[axis];
            }
            for other in &branches[..=index] {
                let product = &self.products[one.joint][other.joint];
                let block = one.turn.transpose()
                    * (product.turn_turn * other.turn + product.turn_shift * other.shift)
                    + one.shift.transpose()
                        * (product.shift_turn * other.turn + product.shift_shift * other.shift);
                for column in 0..3 {
                    for row in 0..3 {
                        let value = block.col(column)[row];
                        let (row, column) = (one.unknown + row, other.unknown + column);
                        hessian[(row, column)] = value;
                        hessian[(column, row)] = value;
                    }
                }
            }
        }
        let changes = std::mem::take(&mut self.own_changes);
        let rows = changes.len() / own.len().max(1);
        let changes = DMatrix::from_vec(own.len(), rows, changes);
        let products = &changes * changes.transpose();
        for (index, (&unknown, slopes)) in own.iter().zip(&self.own_slopes).enumerate() {
            gradient[unknown] += self.own_gradient[index];
            for branch in branches {
                let with = branch.along(slopes);
                for axis in 0..3 {
                    // A turn of a joint may be both, a branch and an own unknown.
                    let other = branch.unknown + axis;
                    hessian[(unknown, other)] += with[axis];
                    hessian[(other, unknown)] += with[axis];
                }
            }
            for (other, &other_unknown) in own[..=index].iter().enumerate() {
                let product = products[(index, other)];
                hessian[(unknown, other_unknown)] += product;
                if other != index {
                    hessian[(other_unknown, unknown)] += product;
                }
            }
        }
        (hessian, gradient)
    }

    /// Replaces what is of bones by sums over the bones at and below each joint.
    fn sum_up_the_tree(&mut self) {
        for first in 0..JOINT_COUNT {
            for second in 0..=first {
                // Summed as their transposes.
                let product = &mut self.products[first][second];
                product.turn_turn = product.turn_turn.transpose();
                product.shift_turn = product.shift_turn.transpose();
                self.products[second][first] = self.products[first][second].transpose();
            }
        }
        // Children come after their parents.
        for joint in Joint::ALL.into_iter().rev() {
            let Some(parent) = joint.parent() else {
                continue;
            };
            let (own, parent) = (joint as usize, parent as usize);
            for other in 0..JOINT_COUNT {
                let product = self.products[own][other];
                self.products[parent][other] += product;
            }
            let slopes = std::iter::once(&mut self.slopes).chain(&mut self.own_slopes);
            for slopes in slopes {
                let slope = slopes[own];
                slopes[parent] += slope;
            }
        }
        for joint in Joint::ALL.into_iter().rev() {
            if let Some(parent) = joint.parent() {
                for products in &mut self.products {
                    let product = products[joint as usize];
                    products[parent as usize] += product;
                }
            }
        }
    }
}

impl Bone {
    const NONE: Self = Self {
        joint: 0,
        weight: 0.0,
        at_m: DVec3::ZERO,
        arm: DMat3::ZERO,
    };
}

impl Product {
    const ZERO: Self = Self {
        turn_turn: DMat3::ZERO,
        turn_shift: DMat3::ZERO,
        shift_turn: DMat3::ZERO,
        shift_shift: DMat3::ZERO,
    };

    fn transpose(&self) -> Self {
        Self {
            turn_turn: self.turn_turn.transpose(),
            turn_shift: self.shift_turn.transpose(),
            shift_turn: self.turn_shift.transpose(),
            shift_shift: self.shift_shift.transpose(),
        }
    }
}

impl Branch {
    /// The slope along the three unknowns.
    fn along(&self, slopes: &[Slope; JOINT_COUNT]) -> DVec3 {
        let slope = slopes[self.joint];
        self.turn.transpose() * slope.turn + self.shift.transpose() * slope.shift
    }
}

/// The product of a bone's motion of its vertex with a pull on the vertex.
#[inline]
fn slope(bone: &Bone, pull: DVec3) -> Slope {
    // The residual is the scan less the model.
    Slope {
        turn: bone.at_m.cross(pull) * -bone.weight,
        shift: pull * -bone.weight,
    }
}
