//! The body model's data and the equations that turn shape coefficients into a rest surface.

use glam::Vec3;

use crate::correctives::factors;
use crate::{JOINT_COUNT, Joint, Pose, REGION_COUNT};

/// Number of shape coefficients β.
pub const SHAPE_COUNT: usize = 10;

/// Largest magnitude of a shape coefficient, in standard deviations: beyond it, linear shapes do not look
/// like bodies.
pub const MAX_SHAPE_COEFFICIENT: f32 = 5.0;

/// Largest distance of a vertex or a joint from the origin at any shape, in metres. Bodies are a few
/// metres large; far outside, single precision becomes coarse and then overflows.
pub const MAX_EXTENT_M: f64 = 100.0;

/// Least thickness of soft tissue in metres: skin and the layer under it (skin alone measures
/// 1.5 to 2 mm). The linear thickness of very lean shapes would fall below 0.
pub const LEAST_THICKNESS_M: f32 = 0.003;

/// Number of vertices of SMPL's mesh and of the default bodies.
pub const SMPL_VERTEX_COUNT: usize = 6_890;

/// Number of pose corrective fields: the nine entries of `R - I` of every joint but the pelvis.
pub const POSE_DIR_COUNT: usize = 9 * (JOINT_COUNT - 1);

/// Up to four joints and their weights for one vertex; weights sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinWeights {
    /// Joint indices; unused slots repeat joint 0 with weight 0.
    pub joints: [u8; 4],
    /// Weights, largest first, non-negative, summing to 1.
    pub weights: [f32; 4],
}

/// A parametric body: SMPL's equations over any template of that skeleton.
#[derive(Clone, Debug)]
pub struct BodyModel {
    /// Name of the model, such as `female`.
    pub name: String,
    /// Copyright as stated in the body's file; empty if it states none.
    pub copyright: String,
    /// Rest positions at β = 0 in metres, `[vertex]`.
    pub template_m: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside, `[face][corner]`.
    pub faces: Vec<[u32; 3]>,
    /// Metres per standard deviation, `[coefficient][vertex]`; [`SHAPE_COUNT`] coefficients.
    pub shape_dirs_m: Vec<Vec<Vec3>>,
    /// SMPL's pose correctives in metres, `[207][vertex]`, over the row-major entries of
    /// `R(joint) - I` of joints 1..24; empty if the model has none.
    pub pose_dirs_m: Vec<Vec<Vec3>>,
    /// Rest joint positions at β = 0 in metres.
    pub joint_template_m: [Vec3; JOINT_COUNT],
    /// Metres per standard deviation, `[coefficient][joint]`.
    pub joint_shape_dirs_m: Vec<[Vec3; JOINT_COUNT]>,
    /// Skin weights, `[vertex]`.
    pub skin: Vec<SkinWeights>,
    /// Soft-tissue thickness over bone at β = 0 in metres, `[vertex]`; empty if unknown
    /// (SMPL-family files do not have it).
    pub thickness_template_m: Vec<f32>,
    /// Change of thickness in metres per standard deviation, `[coefficient][vertex]`; empty where
    /// unknown.
    pub thickness_shape_dirs_m: Vec<Vec<f32>>,
    /// Membership of each soft region, `[region][vertex]`, smooth, 0..=1, summing to at most 1
    /// over the regions; 0 everywhere means bone-like skin that never moves. Empty where unknown.
    pub region_weights: Vec<Vec<f32>>,
    /// Display colour per vertex, sRGB and opacity; painted sportswear. Empty where unknown.
    pub colors_srgba: Vec<[u8; 4]>,
}

/// A part of a [`BodyModel`] that holds places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Template,
    ShapeDirs,
    PoseDirs,
    Joints,
}

/// What lies where no body is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Misplaced {
    pub part: Part,
    /// Which vertex or joint, and how far from the origin.
    pub place: String,
}

/// What a place must be instead, for error messages.
pub(crate) fn expected_extent() -> String {
    format!(
        "metres, at most {MAX_EXTENT_M} m from the origin at every shape within \
         ±{MAX_SHAPE_COEFFICIENT}"
    )
}

/// A body at one shape, in the rest pose.
#[derive(Clone, Debug)]
pub struct ShapedBody {
    /// Rest positions in metres, `[vertex]`.
    pub positions_m: Vec<Vec3>,
    /// Rest joint positions in metres.
    pub joints_m: [Vec3; JOINT_COUNT],
    /// Tissue thickness in metres, at least [`LEAST_THICKNESS_M`], `[vertex]`; empty if the
    /// model has none.
    pub thickness_m: Vec<f32>,
}

impl BodyModel {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.template_m.len()
    }

    /// Template plus shape blend shapes, joints and thickness at `shape` (β, in standard
    /// deviations).
    pub fn shaped(&self, shape: &[f32; SHAPE_COUNT]) -> ShapedBody {
        let mut positions_m = self.template_m.clone();
        let mut joints_m = self.joint_template_m;
        let mut thickness_m = self.thickness_template_m.clone();
        for (beta, dirs) in shape.iter().zip(&self.shape_dirs_m) {
            for (position, dir) in positions_m.iter_mut().zip(dirs) {
                *position += *beta * *dir;
            }
        }
        for (beta, dirs) in shape.iter().zip(&self.joint_shape_dirs_m) {
            for (joint, dir) in joints_m.iter_mut().zip(dirs) {
                *joint += *beta * *dir;
            }
        }
        for (beta, dirs) in shape.iter().zip(&self.thickness_shape_dirs_m) {
            for (thickness, dir) in thickness_m.iter_mut().zip(dirs) {
                *thickness += *beta * *dir;
            }
        }
        for thickness in &mut thickness_m {
            *thickness = thickness.max(LEAST_THICKNESS_M);
        }
        ShapedBody {
            positions_m,
            joints_m,
            thickness_m,
        }
    }

    /// What lies outside [`MAX_EXTENT_M`] at some shape within [`MAX_SHAPE_COEFFICIENT`], or is moved
    /// that far by one pose corrective; none in a sound body.
    pub(crate) fn misplaced(&self) -> Option<Misplaced> {
        // Written so that what is not a number counts as outside.
        let is_outside = |reach_m: f64| !matches!(reach_m, 0.0..=MAX_EXTENT_M);
        let length_m = |place: Vec3| place.as_dvec3().length();
        let reach_m = |template: Vec3, dirs: &mut dyn Iterator<Item = Vec3>| {
            length_m(template) + f64::from(MAX_SHAPE_COEFFICIENT) * dirs.map(length_m).sum::<f64>()
        };
        let found = |part, what: String, reach_m: f64| {
            is_outside(reach_m).then(|| Misplaced {
                part,
                place: format!("{what} at up to {reach_m:.0} m"),
            })
        };
        let vertices = self.template_m.iter().enumerate();
        let in_template = vertices.clone().find_map(|(vertex, place)| {
            let what = format!("vertex {vertex}");
            found(Part::Template, what, length_m(*place))
        });
        let in_shape = || {
            vertices.clone().find_map(|(vertex, place)| {
                let mut dirs = self.shape_dirs_m.iter().map(|dirs| dirs[vertex]);
                let what = format!("vertex {vertex}");
                found(Part::ShapeDirs, what, reach_m(*place, &mut dirs))
            })
        };
        let in_pose = || {
            let dirs = self
                .pose_dirs_m
                .iter()
                .flat_map(|dirs| dirs.iter().enumerate());
            dirs.map(|(vertex, dir)| (vertex, length_m(*dir)))
                .find_map(|(vertex, m)| found(Part::PoseDirs, format!("vertex {vertex}"), m))
        };
        let in_joints = || {
            Joint::ALL.into_iter().find_map(|joint| {
                let idx = joint as usize;
                let mut dirs = self.joint_shape_dirs_m.iter().map(|dirs| dirs[idx]);
                let what = format!("joint {}", joint.name());
                let reach_m = reach_m(self.joint_template_m[idx], &mut dirs);
                found(Part::Joints, what, reach_m)
            })
        };
        in_template
            .or_else(in_shape)
            .or_else(in_pose)
            .or_else(in_joints)
    }

    /// Adds SMPL's pose correctives to rest positions (metres); nothing where the model has none.
    ///
    /// Eq. 3 of Casas & Otaduy 2018: each entry of `R - I` of every joint but the pelvis scales
    /// one displacement field. For every frame of an avatar there is [`crate::PoseCorrectives`].
    pub fn add_pose_correctives(&self, pose: &Pose, rest_m: &mut [Vec3]) {
        add_correctives(pose, &self.pose_dirs_m, rest_m);
    }

    /// How soft a vertex is, 0..=1: the sum of its region weights.
    pub fn softness(&self, vertex: usize) -> f32 {
        debug_assert!(self.region_weights.is_empty() || self.region_weights.len() == REGION_COUNT);
        self.region_weights
            .iter()
            .map(|weights| weights[vertex])
            .sum::<f32>()
            .min(1.0)
    }
}

/// Adds the pose correctives of some vertices, whose directions are `dirs_m`, `[direction][vertex]` as in
/// [`BodyModel::pose_dirs_m`], to their rest positions in metres.
pub fn add_correctives(pose: &Pose, dirs_m: &[Vec<Vec3>], rest_m: &mut [Vec3]) {
    // As flat numbers, of which several are worked on at once.
    let numbers_m: &mut [f32] = bytemuck::cast_slice_mut(rest_m);
    for (factor, dirs) in factors(pose).flatten().zip(dirs_m) {
        // A joint that does not turn corrects nothing.
        if factor == 0.0 {
            continue;
        }
        let dirs: &[f32] = bytemuck::cast_slice(dirs);
        for (number, dir) in numbers_m.iter_mut().zip(dirs) {
            *number += factor * dir;
        }
    }
}

impl SkinWeights {
    /// The four largest of a vertex's dense weights, renormalised to sum to 1.
    pub fn largest_four(dense: &[f32; JOINT_COUNT]) -> Self {
        let mut order: [u8; JOINT_COUNT] = std::array::from_fn(|joint| joint as u8);
        order.sort_by(|&a, &b| dense[b as usize].total_cmp(&dense[a as usize]));
        let mut skin = Self {
            joints: [0; 4],
            weights: [0.0; 4],
        };
        let sum: f32 = order[..4]
            .iter()
            .map(|&joint| dense[joint as usize].max(0.0))
            .sum();
        for slot in 0..4 {
            let weight = dense[order[slot] as usize].max(0.0) / sum.max(f32::MIN_POSITIVE);
            if weight > 0.0 {
                skin.joints[slot] = order[slot];
                skin.weights[slot] = weight;
            }
        }
        skin
    }
}
