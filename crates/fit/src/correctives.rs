//! Pose correctives in the normal equations.
//!
//! A corrective moves a vertex by `Σ f(θ) D`, one direction D for each of nine entries of a joint's local rotation: 69
//! dense columns, which cost many times the rest of the equations. Their part of the gradient is a sum over the vertices
//! for each direction, which is cheap. The Hessian takes the columns, so it is summed over a part of the vertices alone:
//! steps are a little off, their end is not. It has to be the square of *one* linear model of the residuals. Cheaper sums
//! that mix models give a matrix that is not positive definite; poses then stop early, and joints are not found at all.

use std::borrow::Cow;

use bytemuck::cast_slice;
use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, add_correctives};
use glam::{DMat3, DVec3, Vec3};

use crate::twists::skew;

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

    /// Whether the body has correctives.
    pub fn has_correctives(&self) -> bool {
        !self.dirs_m.is_empty()
    }

    /// What the correctives of turns of all joints but the pelvis change in the rest position of the vertex at
    /// `index` of those that count, in metres.
    pub fn changes_m(&self, index: usize, turns: &[Turn], changes_m: &mut [DVec3]) {
        let fields = self.dirs_m.chunks_exact(ENTRIES).zip(turns);
        for ((fields, turn), changes_m) in fields.zip(changes_m.as_chunks_mut::<3>().0) {
            for (entries, change_m) in turn.iter().zip(changes_m) {
                let parts = fields.iter().zip(entries);
                *change_m = parts
                    .map(|(dirs, entry)| dirs[index].as_dvec3() * *entry)
                    .sum();
            }
        }
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

/// Change of the entries of a joint's local rotation, rows first, with a turn in the world about each axis.
pub(crate) type Turn = [[f64; ENTRIES]; 3];

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
