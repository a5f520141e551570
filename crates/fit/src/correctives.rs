//! Pose correctives in the normal equations.
//!
//! A corrective moves a vertex by `Σ f(θ) D`, one direction D for each of nine entries of a joint's local rotation.
//! As columns of their own they would be 69 dense ones, which cost many times the rest of the equations. Their part
//! of the gradient is a sum over the vertices for each direction, and exact. The Hessian comes from sums that are
//! made once: of the directions with each other, and with the motion of each bone. There a vertex is where the average
//! body has it, each of its bones carries it rigidly, and no vertex is a stray: steps are a little off, their end is not.

use std::borrow::Cow;

use bytemuck::cast_slice;
use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, add_correctives};
use glam::{DMat3, DVec3, Vec3};
use nalgebra::DMatrix;

use crate::twists::{Slope, Twists, skew};

/// Vertices that count.
pub(crate) struct Chosen {
    pub vertices: Vec<u32>,
    /// Their corrective directions, `[direction][vertex]`, side by side so that memory is read in order.
    dirs_m: Vec<Vec<Vec3>>,
}

impl Chosen {
    pub fn new(body: &BodyModel, vertices: Vec<u32>) -> Self {
        let of = |dirs: &Vec<Vec3>| vertices.iter().map(|&v| dirs[v as usize]).collect();
        Self {
            dirs_m: body.pose_dirs_m.iter().map(of).collect(),
            vertices,
        }
    }

    /// Rest positions `shaped_m` with the correctives of the vertices that count.
    pub fn corrected_m<'m>(&self, shaped_m: &'m [Vec3], pose: &Pose) -> Cow<'m, [Vec3]> {
        if self.dirs_m.is_empty() {
            return Cow::Borrowed(shaped_m);
        }
        let vertices = self.vertices.iter().map(|&vertex| vertex as usize);
        let mut some_m: Vec<Vec3> = vertices.clone().map(|vertex| shaped_m[vertex]).collect();
        add_correctives(pose, &self.dirs_m, &mut some_m);
        let mut rest_m = shaped_m.to_vec();
        for (vertex, corrected_m) in vertices.zip(some_m) {
            rest_m[vertex] = corrected_m;
        }
        Cow::Owned(rest_m)
    }

    /// The gradient along turns of all joints but the pelvis, of what their correctives change; `pulls_m` are the
    /// weighted residuals of the vertices in the rest pose.
    pub fn gradient(&self, turns: &[Turn], pulls_m: &[Vec3]) -> Vec<f64> {
        let fields = self.dirs_m.chunks_exact(ENTRIES).zip(turns);
        let slopes = fields.flat_map(|(fields, turn)| {
            let slopes: [f64; ENTRIES] =
                std::array::from_fn(|entry| along(&fields[entry], pulls_m));
            // The residual is the scan less the model.
            turn.map(|entries| -dot(&entries, &slopes))
        });
        slopes.collect()
    }
}

/// `Σ D · p`, several numbers at once; blocks are short enough that single precision loses nothing.
fn along(dirs_m: &[Vec3], pulls_m: &[Vec3]) -> f64 {
    let (dirs, pulls): (&[f32], &[f32]) = (cast_slice(dirs_m), cast_slice(pulls_m));
    let blocks = dirs.chunks(BLOCK).zip(pulls.chunks(BLOCK));
    let sums = blocks.map(|(dirs, pulls)| {
        let mut sums = [0.0_f32; LANES];
        let (dirs, dirs_left) = dirs.as_chunks::<LANES>();
        let (pulls, pulls_left) = pulls.as_chunks::<LANES>();
        for (dirs, pulls) in dirs.iter().zip(pulls) {
            for ((sum, dir), pull) in sums.iter_mut().zip(dirs).zip(pulls) {
                *sum += dir * pull;
            }
        }
        let left: f32 = dirs_left
            .iter()
            .zip(pulls_left)
            .map(|(dir, pull)| dir * pull)
            .sum();
        f64::from(sums.iter().sum::<f32>() + left)
    });
    sums.sum()
}

/// Numbers of a block that is summed in single precision, and how many are summed side by side.
const BLOCK: usize = 512;
const LANES: usize = 16;
/// Entries of a rotation.
const ENTRIES: usize = 9;

/// Products of a body's corrective directions under the weights of its vertices.
pub(crate) struct Correctives {
    /// `Σ w D_a · D_b` in m², `[direction][direction]`.
    products: DMatrix<f64>,
    /// Of each bone j with its share s of each vertex y: `Σ w s y × D` in m² and `Σ w s D` in metres,
    /// `[direction][joint]`.
    slopes: Vec<[Slope; JOINT_COUNT]>,
    /// Sum of the weights.
    weight: f64,
}

/// Change of the entries of a joint's local rotation, rows first, with a turn in the world about each axis.
pub(crate) type Turn = [[f64; ENTRIES]; 3];

impl Correctives {
    /// None where the body has no correctives; `weights` is `[vertex]`.
    pub fn new(body: &BodyModel, weights: &[f64]) -> Option<Self> {
        if body.pose_dirs_m.is_empty() {
            return None;
        }
        let roots: Vec<f32> = weights.iter().map(|weight| weight.sqrt() as f32).collect();
        let columns = body.pose_dirs_m.iter().flat_map(|dirs| {
            let scaled = dirs.iter().zip(&roots);
            scaled.flat_map(|(dir, root)| (*dir * *root).to_array())
        });
        let shape = (3 * weights.len(), body.pose_dirs_m.len());
        let scaled_m = DMatrix::from_iterator(shape.0, shape.1, columns);
        let slopes = body.pose_dirs_m.iter().map(|dirs| {
            let mut slopes = [Slope::default(); JOINT_COUNT];
            for (vertex, dir) in dirs.iter().enumerate() {
                let pull = dir.as_dvec3() * weights[vertex];
                let turn = body.template_m[vertex].as_dvec3().cross(pull);
                let skin = &body.skin[vertex];
                for (&joint, &share) in skin.joints.iter().zip(&skin.weights) {
                    slopes[usize::from(joint)] += Slope { turn, shift: pull } * f64::from(share);
                }
            }
            slopes
        });
        Some(Self {
            slopes: slopes.collect(),
            products: (scaled_m.transpose() * scaled_m).cast(),
            weight: weights.iter().sum(),
        })
    }

    /// Adds the turns of all joints but the pelvis as unknowns that move no bones, with this `gradient`; `weight` is the
    /// sum of the weights of the vertices that count.
    pub fn add_to(
        &self,
        twists: &mut Twists,
        turns: &[Turn],
        bones: &[Bone; JOINT_COUNT],
        weight: f64,
        gradient: &[f64],
    ) {
        let share = weight / self.weight.max(f64::MIN_POSITIVE);
        let count = 3 * turns.len();
        let mut products = DMatrix::zeros(count, count);
        for (a, one) in turns.iter().enumerate() {
            for (b, other) in turns[..=a].iter().enumerate() {
                let block = (self.products).view((ENTRIES * a, ENTRIES * b), (ENTRIES, ENTRIES));
                for (j, other) in other.iter().enumerate() {
                    let along: [f64; ENTRIES] = std::array::from_fn(|e| {
                        (0..ENTRIES).map(|f| block[(e, f)] * other[f]).sum()
                    });
                    for (i, one) in one.iter().enumerate() {
                        products[(3 * a + i, 3 * b + j)] = share * dot(one, &along);
                    }
                }
            }
        }
        let slopes = self.slopes.chunks_exact(ENTRIES).zip(turns);
        let slopes = slopes.flat_map(|(slopes, turn)| {
            turn.map(|entries| {
                std::array::from_fn(|joint| {
                    let mut rest = Slope::default();
                    for (slopes, entry) in slopes.iter().zip(entries) {
                        rest += slopes[joint] * entry;
                    }
                    bones[joint].carried(rest) * share
                })
            })
        });
        twists.extend(slopes.collect(), &products, gradient);
    }
}

/// Where a bone has carried its rest frame.
#[derive(Clone, Copy)]
pub(crate) struct Bone {
    /// From rest to world.
    pub rotation: DMat3,
    /// The centre of the twists, in the rest frame, in metres.
    pub centre_rest_m: DVec3,
}

impl Bone {
    /// Products with its motion about the origin of the rest pose as those with its motion about the centre, in the
    /// world.
    fn carried(&self, rest: Slope) -> Slope {
        Slope {
            turn: self.rotation * (rest.turn - self.centre_rest_m.cross(rest.shift)),
            shift: self.rotation * rest.shift,
        }
    }
}

fn dot(a: &[f64; ENTRIES], b: &[f64; ENTRIES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// How the local rotations of all joints but the pelvis change. A world turn ω is the turn `Wᵀ ω` in the joint's own
/// frame, and `d(R) = R skew(Wᵀ ω)`.
pub(crate) fn turns(rotation: &[DMat3; JOINT_COUNT]) -> Vec<Turn> {
    let joints = Joint::ALL.into_iter();
    let turned = joints.filter_map(|joint| {
        let world = rotation[joint as usize];
        let local = rotation[joint.parent()? as usize].transpose() * world;
        Some(DVec3::AXES.map(|axis| {
            let change = local * skew(world.transpose() * axis);
            std::array::from_fn(|entry| change.col(entry % 3)[entry / 3])
        }))
    });
    turned.collect()
}
