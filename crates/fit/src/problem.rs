//! The least-squares problem of one frame and its analytic Jacobian.
//!
//! With rest positions `v(β, θ)`, scan `s` and the blended skinning map `x = B v + b` of a vertex,
//! the two residuals are
//!
//! - posed: `r = s - (B v + b)`,
//! - unposed: `r = B⁻¹ (s - b) - v` (Casas & Otaduy 2018, Eq. 4).
//!
//! Let `ω` turn joint k about its own position `p_k`, measured in the world. A point carried by the
//! skin weights moves by `ω × c_k`, with `c_k = Σ w_j (G_j y - p_k)` over the joints j below k. In
//! the posed residual y is `v`; in the unposed one it is the unposed scan `u = B⁻¹ (s - b)`, and
//! because `B u + b = s` is constant, `du = -B⁻¹ (dB u + db)`: the same Jacobian, seen through
//! `B⁻¹`. Pose correctives and β add `dv`, β moves the joints, too.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, SHAPE_COUNT, ShapedBody, SkinMatrices};
use glam::{DMat3, DQuat, DVec3, Vec3};
use nalgebra::{DMatrix, DVector};

use crate::tree::{chain, joints_of, moving_joints};

/// Where the difference between model and scan is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// In the rest pose, after unposing the scan (Casas & Otaduy 2018, Eq. 4).
    Unposed,
    /// In the world, after posing the model (Kim et al. 2017).
    Posed,
}

/// Position of the root's columns: first, then three for every joint, then β.
const ROTATION: usize = 3;
const SHAPE: usize = ROTATION + 3 * JOINT_COUNT;
/// Weight of β² against the mean rigidity: decides only where the scan says nothing.
const SHAPE_PRIOR: f64 = 1e-10;

/// What is being fitted to one scan.
pub(crate) struct Problem<'a> {
    pub body: &'a BodyModel,
    pub objective: Objective,
    /// Scan positions in metres, `[vertex]`.
    pub scan_m: &'a [Vec3],
    /// Weight of each vertex, `[vertex]`, at least 0.
    pub weights: &'a [f64],
    /// Per vertex the joints that move it, as bits.
    pub moving: &'a [u32],
    /// Whether β is fitted, too.
    pub fit_shape: bool,
    /// Scale in metres of the robust loss (Cauchy's): residuals far above it, stray vertices, pull
    /// less and less.
    pub robust_m: f64,
}

/// An estimate of one frame's parameters.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub pose: Pose,
    pub shape: [f64; SHAPE_COUNT],
    /// The body of this shape.
    pub shaped: ShapedBody,
}

/// The normal equations of a linearised problem.
pub(crate) struct Normal {
    pub hessian: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl Estimate {
    pub fn new(body: &BodyModel, pose: Pose, shape: [f64; SHAPE_COUNT]) -> Self {
        let shaped = body.shaped(&shape.map(|beta| beta as f32));
        Self {
            pose,
            shape,
            shaped,
        }
    }

    /// The estimate moved by `step`: translation, world rotation of each joint about itself, β.
    pub fn moved(&self, body: &BodyModel, step: &DVector<f64>) -> Self {
        let world = self.pose.world_joints(&self.shaped.joints_m);
        let mut pose = self.pose.clone();
        pose.root_translation_m += vector(step, 0);
        for joint in 0..JOINT_COUNT {
            let turn = world.rotation[joint].conjugate() * vector(step, ROTATION + 3 * joint);
            let local = pose.parent_from_joint[joint] * DQuat::from_scaled_axis(turn);
            pose.parent_from_joint[joint] = local.normalize();
        }
        if step.len() == SHAPE {
            return Self {
                pose,
                shape: self.shape,
                shaped: self.shaped.clone(),
            };
        }
        let shape = std::array::from_fn(|i| self.shape[i] + step[SHAPE + i]);
        Self::new(body, pose, shape)
    }

    /// Rest positions with pose correctives, in metres.
    pub fn rest_m(&self, body: &BodyModel) -> Vec<Vec3> {
        let mut rest_m = self.shaped.positions_m.clone();
        body.add_pose_correctives(&self.pose, &mut rest_m);
        rest_m
    }
}

fn vector(step: &DVector<f64>, at: usize) -> DVec3 {
    DVec3::new(step[at], step[at + 1], step[at + 2])
}

/// `a × b = skew(a) b`.
fn skew(a: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, a.z, -a.y),
        DVec3::new(-a.z, 0.0, a.x),
        DVec3::new(a.y, -a.x, 0.0),
    )
}

/// Everything of an estimate that the vertices share.
struct Frame {
    rest_m: Vec<Vec3>,
    matrices: SkinMatrices,
    joint_rotation: [DMat3; JOINT_COUNT],
    joint_position_m: [DVec3; JOINT_COUNT],
    /// Change of each joint's world map `y = R rest + t` with β: that of `t`.
    map_shape_m: Vec<[DVec3; JOINT_COUNT]>,
}

/// One vertex linearised.
struct Row {
    residual: DVec3,
    /// Derivative of the residual by the root translation.
    root: DMat3,
    /// By the world rotation of each joint in the mask.
    turns: [DMat3; JOINT_COUNT],
    /// By each β.
    shape: [DVec3; SHAPE_COUNT],
}

impl Problem<'_> {
    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        SHAPE + if self.fit_shape { SHAPE_COUNT } else { 0 }
    }

    fn frame(&self, estimate: &Estimate) -> Frame {
        let joints_rest_m = &estimate.shaped.joints_m;
        let world = estimate.pose.world_joints(joints_rest_m);
        let joint_rotation = world.rotation.map(DMat3::from_quat);
        let map_shape_m = if self.fit_shape {
            self.body
                .joint_shape_dirs_m
                .iter()
                .map(|dirs| map_change(dirs, &joint_rotation))
                .collect()
        } else {
            Vec::new()
        };
        Frame {
            rest_m: estimate.rest_m(self.body),
            matrices: SkinMatrices::new(&estimate.pose, joints_rest_m),
            joint_rotation,
            joint_position_m: world.position_m,
            map_shape_m,
        }
    }

    /// The residual of a vertex and the map from world differences to residuals.
    fn residual(&self, frame: &Frame, vertex: usize) -> (DVec3, DMat3, DVec3) {
        let skin = &self.body.skin[vertex];
        let rest_m = frame.rest_m[vertex].as_dvec3();
        match self.objective {
            Objective::Unposed => {
                let unposing = frame.matrices.unposing(skin);
                let unposed_m = unposing.rest_m(self.scan_m[vertex]);
                (unposed_m - rest_m, unposing.linear, unposed_m)
            }
            Objective::Posed => {
                let posed = frame.matrices.blended(skin);
                let world_m = posed.transform_point3(frame.rest_m[vertex]);
                let difference_m = (self.scan_m[vertex] - world_m).as_dvec3();
                (difference_m, DMat3::IDENTITY, rest_m)
            }
        }
    }

    /// The weighted robust sum of squares at an estimate, in m².
    pub fn cost(&self, estimate: &Estimate) -> f64 {
        let frame = self.frame(estimate);
        let vertices = self.weights.iter().enumerate();
        let sum: f64 = vertices
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(vertex, weight)| {
                let size_m = self.residual(&frame, vertex).0.length();
                weight * self.loss(size_m)
            })
            .sum();
        sum + 0.5 * self.prior() * estimate.shape.iter().map(|beta| beta * beta).sum::<f64>()
    }

    /// Cauchy's loss, half the square for small residuals.
    fn loss(&self, size_m: f64) -> f64 {
        let scale = self.robust_m;
        0.5 * scale * scale * (size_m / scale).powi(2).ln_1p()
    }

    /// Weight of a residual in the least squares whose gradient is that of [`Self::loss`].
    fn robust_weight(&self, size_m: f64) -> f64 {
        1.0 / (1.0 + (size_m / self.robust_m).powi(2))
    }

    fn prior(&self) -> f64 {
        if self.fit_shape {
            SHAPE_PRIOR * self.weights.iter().sum::<f64>()
        } else {
            0.0
        }
    }

    /// Gauss-Newton normal equations at an estimate, with the robust weights of its residuals.
    pub fn normal(&self, estimate: &Estimate) -> Normal {
        let frame = self.frame(estimate);
        let unknowns = self.unknowns();
        let mut normal = Normal {
            hessian: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
        };
        for (vertex, &weight) in self.weights.iter().enumerate() {
            if weight > 0.0 {
                let bits = if self.body.pose_dirs_m.is_empty() {
                    self.moving[vertex]
                } else {
                    (1 << JOINT_COUNT) - 1
                };
                let row = self.row(&frame, vertex, bits);
                let weight = weight * self.robust_weight(row.residual.length());
                self.add(&mut normal, &row, bits, weight);
            }
        }
        if self.fit_shape {
            for (i, beta) in estimate.shape.iter().enumerate() {
                normal.hessian[(SHAPE + i, SHAPE + i)] += self.prior();
                normal.gradient[SHAPE + i] += self.prior() * beta;
            }
        }
        normal.hessian.fill_upper_triangle_with_lower_triangle();
        normal
    }

    fn row(&self, frame: &Frame, vertex: usize, bits: u32) -> Row {
        let skin = &self.body.skin[vertex];
        let (residual, rest_from_world, carried_m) = self.residual(frame, vertex);
        // Derivative of the residual by the rest position of the model.
        let by_rest = match self.objective {
            Objective::Unposed => DMat3::IDENTITY,
            Objective::Posed => blended_linear(&frame.matrices, skin),
        };
        let mut arms_m = [DVec3::ZERO; JOINT_COUNT];
        let mut shape = [DVec3::ZERO; SHAPE_COUNT];
        for (&joint, &weight) in skin.joints.iter().zip(&skin.weights) {
            let (joint, weight) = (usize::from(joint), f64::from(weight));
            if weight == 0.0 {
                continue;
            }
            let map = &frame.matrices.world_from_rest[joint];
            let world_m = map.transform_point3(carried_m.as_vec3()).as_dvec3();
            for above in chain(joint) {
                arms_m[above] += weight * (world_m - frame.joint_position_m[above]);
            }
            for (shape, maps) in shape.iter_mut().zip(&frame.map_shape_m) {
                *shape -= weight * (rest_from_world * maps[joint]);
            }
        }
        if self.fit_shape {
            for (shape, dirs) in shape.iter_mut().zip(&self.body.shape_dirs_m) {
                *shape -= by_rest * dirs[vertex].as_dvec3();
            }
        }
        let mut turns = [DMat3::ZERO; JOINT_COUNT];
        for joint in joints_of(bits & self.moving[vertex]) {
            // -(ω × c) = c × ω.
            turns[joint] = rest_from_world * skew(arms_m[joint]);
        }
        if !self.body.pose_dirs_m.is_empty() {
            self.add_correctives(frame, vertex, &by_rest, &mut turns);
        }
        Row {
            residual,
            root: -rest_from_world,
            turns,
            shape,
        }
    }

    /// Adds what a turn of each joint changes in the vertex's pose correctives. A world turn ω is
    /// the turn `Wᵀ ω` in the joint's own frame, and `d(R) = R skew(Wᵀ ω)`.
    fn add_correctives(
        &self,
        frame: &Frame,
        vertex: usize,
        by_rest: &DMat3,
        turns: &mut [DMat3; JOINT_COUNT],
    ) {
        for joint in Joint::ALL.into_iter().skip(1) {
            let joint_index = joint as usize;
            let parent = joint.parent().map_or(0, |parent| parent as usize);
            let world = frame.joint_rotation[joint_index];
            let local = frame.joint_rotation[parent].transpose() * world;
            let mut by_own = [DVec3::ZERO; 3];
            for (axis, by_own) in by_own.iter_mut().enumerate() {
                let change = local * skew(DVec3::AXES[axis]);
                for entry in 0..9 {
                    let dirs = &self.body.pose_dirs_m[9 * (joint_index - 1) + entry];
                    *by_own += change.col(entry % 3)[entry / 3] * dirs[vertex].as_dvec3();
                }
            }
            let [x, y, z] = by_own;
            turns[joint_index] -= *by_rest * DMat3::from_cols(x, y, z) * world.transpose();
        }
    }

    /// Adds a row's products to the lower triangle and the gradient.
    fn add(&self, normal: &mut Normal, row: &Row, bits: u32, weight: f64) {
        let mut block = |first: usize, second: usize, product: DMat3| {
            for column in 0..3 {
                for line in 0..3 {
                    normal.hessian[(first + line, second + column)] += product.col(column)[line];
                }
            }
        };
        let root = row.root.transpose() * weight;
        block(0, 0, root * row.root);
        for joint in joints_of(bits) {
            let own = row.turns[joint].transpose() * weight;
            let at = ROTATION + 3 * joint;
            block(at, 0, own * row.root);
            for other in joints_of(bits & ((2 << joint) - 1)) {
                block(at, ROTATION + 3 * other, own * row.turns[other]);
            }
        }
        let mut slope = |at: usize, value: DVec3| {
            for axis in 0..3 {
                normal.gradient[at + axis] += value[axis];
            }
        };
        slope(0, root * row.residual);
        for joint in joints_of(bits) {
            let own = row.turns[joint].transpose() * weight;
            slope(ROTATION + 3 * joint, own * row.residual);
        }
        if !self.fit_shape {
            return;
        }
        for (i, &shape) in row.shape.iter().enumerate() {
            let line = SHAPE + i;
            let own = shape * weight;
            normal.gradient[line] += own.dot(row.residual);
            for (j, &other) in row.shape[..=i].iter().enumerate() {
                normal.hessian[(line, SHAPE + j)] += own.dot(other);
            }
            let mut against = |at: usize, columns: &DMat3| {
                for axis in 0..3 {
                    normal.hessian[(line, at + axis)] += own.dot(columns.col(axis));
                }
            };
            against(0, &row.root);
            for joint in joints_of(bits) {
                against(ROTATION + 3 * joint, &row.turns[joint]);
            }
        }
    }

    /// Root mean square distance in metres between posed model and scan, by weight.
    pub fn distance_m(&self, estimate: &Estimate) -> f64 {
        let frame = self.frame(estimate);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (vertex, weight) in self.weights.iter().enumerate() {
            let posed = frame.matrices.blended(&self.body.skin[vertex]);
            let world_m = posed.transform_point3(frame.rest_m[vertex]);
            // Bounded, so that a few stray vertices say nothing about the rest.
            let distance_m = f64::from(self.scan_m[vertex].distance(world_m)).min(0.5);
            sum += weight * distance_m * distance_m;
            weights += weight;
        }
        (sum / f64::max(weights, f64::MIN_POSITIVE)).sqrt()
    }
}

fn blended_linear(matrices: &SkinMatrices, skin: &dynaskin_body::SkinWeights) -> DMat3 {
    let blended = matrices.blended(skin).matrix3;
    DMat3::from_cols_array(&blended.to_cols_array().map(f64::from))
}

/// How the translation `t_j = p_j - R_j J_j` of each joint's map changes when the rest joints move
/// by `dirs`: `dp_j = dp_parent + R_parent (dJ_j - dJ_parent)`.
fn map_change(dirs: &[Vec3; JOINT_COUNT], rotation: &[DMat3; JOINT_COUNT]) -> [DVec3; JOINT_COUNT] {
    let mut position = [DVec3::ZERO; JOINT_COUNT];
    for joint in Joint::ALL {
        let index = joint as usize;
        let own = dirs[index].as_dvec3();
        position[index] = match joint.parent() {
            None => own,
            Some(parent) => {
                let parent = parent as usize;
                position[parent] + rotation[parent] * (own - dirs[parent].as_dvec3())
            }
        };
    }
    std::array::from_fn(|joint| position[joint] - rotation[joint] * dirs[joint].as_dvec3())
}

/// Per vertex the joints that move it.
pub(crate) fn moving(body: &BodyModel) -> Vec<u32> {
    body.skin.iter().map(moving_joints).collect()
}
