//! The least-squares problem of one frame and its analytic normal equations.
//!
//! With rest positions `v(β, θ)`, scan `s` and the blended skinning map `x = B v + b` of a vertex,
//! the two residuals are
//!
//! - posed: `r = s - (B v + b)`,
//! - unposed: `r = B⁻¹ (s - b) - v` (Casas & Otaduy 2018, Eq. 4).
//!
//! Every unknown but β moves a whole branch of the skeleton: it gives the bones at and below a joint one
//! small rigid motion, a twist `(ω, v)` about a fixed point. A vertex that hangs on bones j with weights
//! `w_j` then moves by `Σ w_j (ω × x_j + v)`, where `x_j = G_j y`, and y is `v` in the posed residual and the
//! unposed scan `u = B⁻¹ (s - b)` in the other. Because `B u + b = s` is constant, the unposed residual
//! changes by `-B⁻¹` times that. So vertices are summed into products of the twists of the bones they hang
//! on, and sums over branches give the normal equations (`twists.rs`). β changes rest positions itself, which
//! are columns of their own, and so do pose correctives (`correctives.rs`).

use std::borrow::Cow;
use std::sync::Arc;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Pose, SHAPE_COUNT, ShapedBody, SkinMatrices};
use glam::{DMat3, DQuat, DVec3, Vec3};
use nalgebra::{DMatrix, DVector};

use crate::correctives::{Chosen, turns};
use crate::twists::{Branch, Linear, Twists, skew};

/// Where the difference between model and scan is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// In the rest pose, after unposing the scan (Casas & Otaduy 2018, Eq. 4).
    Unposed,
    /// In the world, after posing the model (Kim et al. 2017).
    Posed,
}

/// Position of the rotations among the unknowns: after the root translation.
const ROTATION: usize = 3;
/// Number of unknowns of a pose; what is fitted beside it follows.
pub(crate) const POSE: usize = ROTATION + 3 * JOINT_COUNT;
/// Number of unknowns of the joints' places. The pelvis has none: wherever it is, a translation of the root
/// makes up for it.
pub(crate) const PLACES: usize = 3 * (JOINT_COUNT - 1);
/// Weight of β² against the mean rigidity: decides only where the scan says nothing.
const SHAPE_PRIOR: f64 = 1e-10;

/// What is fitted beside the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    Nothing,
    /// β.
    Shape,
    /// The rest places of all joints but the pelvis, three unknowns each.
    Joints,
}

/// What is being fitted to one scan.
pub(crate) struct Problem<'a> {
    pub body: &'a BodyModel,
    pub objective: Objective,
    /// Scan positions in metres, `[vertex]`.
    pub scan_m: &'a [Vec3],
    /// Weight of each vertex, `[vertex]`, at least 0.
    pub weights: &'a [f64],
    /// The vertices that count.
    pub chosen: &'a Chosen,
    pub beside: Beside,
    /// Those of which the Hessian is made where the body has correctives, by their share of the weights.
    pub coarse: &'a Chosen,
    /// Scale in metres of the robust loss (Cauchy's): residuals far above it, stray vertices, pull
    /// less and less.
    pub robust_m: f64,
}

/// An estimate of one frame's parameters.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub pose: Pose,
    pub shape: [f64; SHAPE_COUNT],
    /// The body of this shape, its joints moved by `joint_offsets_m`.
    pub shaped: Arc<ShapedBody>,
    /// How far each joint lies from where β puts it, in metres, in the rest pose.
    pub joint_offsets_m: [DVec3; JOINT_COUNT],
}

/// The normal equations of a linearised problem.
pub(crate) struct Normal {
    /// The weighted robust sum of squares, in m².
    pub cost: f64,
    pub hessian: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl Normal {
    /// By how much these equations say that a change of the parameters lowers the cost, in m².
    pub fn gain(&self, change: &DVector<f64>) -> f64 {
        -(self.gradient.dot(change) + 0.5 * change.dot(&(&self.hessian * change)))
    }
}

impl Estimate {
    pub fn new(
        body: &BodyModel,
        pose: Pose,
        shape: [f64; SHAPE_COUNT],
        joint_offsets_m: [DVec3; JOINT_COUNT],
    ) -> Self {
        let mut shaped = body.shaped(&shape.map(|beta| beta as f32));
        for (joint_m, offset_m) in shaped.joints_m.iter_mut().zip(joint_offsets_m) {
            *joint_m = (joint_m.as_dvec3() + offset_m).as_vec3();
        }
        Self {
            pose,
            shape,
            shaped: Arc::new(shaped),
            joint_offsets_m,
        }
    }

    /// The same body in another pose.
    pub fn posed(&self, pose: Pose) -> Self {
        Self {
            pose,
            ..self.clone()
        }
    }

    /// The estimate moved by `step`: translation, world rotation of each joint about itself, and β if there
    /// is more.
    pub fn moved(&self, body: &BodyModel, step: &DVector<f64>) -> Self {
        let world = self.pose.world_joints(&self.shaped.joints_m);
        let mut pose = self.pose.clone();
        pose.root_translation_m += vector(step, 0);
        for joint in 0..JOINT_COUNT {
            let turn = world.rotation[joint].conjugate() * vector(step, ROTATION + 3 * joint);
            let local = pose.parent_from_joint[joint] * DQuat::from_scaled_axis(turn);
            pose.parent_from_joint[joint] = local.normalize();
        }
        if step.len() == POSE {
            return self.posed(pose);
        }
        let shape = std::array::from_fn(|i| self.shape[i] + step[POSE + i]);
        Self::new(body, pose, shape, self.joint_offsets_m)
    }

    /// Rest positions with pose correctives, in metres.
    pub fn rest_m(&self, body: &BodyModel) -> Cow<'_, [Vec3]> {
        if body.pose_dirs_m.is_empty() {
            return Cow::Borrowed(&self.shaped.positions_m);
        }
        let mut rest_m = self.shaped.positions_m.clone();
        body.add_pose_correctives(&self.pose, &mut rest_m);
        Cow::Owned(rest_m)
    }
}

fn vector(step: &DVector<f64>, at: usize) -> DVec3 {
    DVec3::new(step[at], step[at + 1], step[at + 2])
}

/// Everything of an estimate that the vertices share.
struct Frame<'e> {
    rest_m: Cow<'e, [Vec3]>,
    matrices: SkinMatrices,
    joint_rotation: [DMat3; JOINT_COUNT],
    joint_position_m: [DVec3; JOINT_COUNT],
}

/// A vertex's residual.
struct Residual {
    value_m: DVec3,
    /// From differences in the world to differences of residuals.
    rest_from_world: DMat3,
    /// What the bones carry, in the rest pose, in metres.
    carried_m: DVec3,
}

impl Problem<'_> {
    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        match self.beside {
            Beside::Nothing => POSE,
            Beside::Shape => POSE + SHAPE_COUNT,
            Beside::Joints => POSE + PLACES,
        }
    }

    fn frame<'e>(&self, estimate: &'e Estimate) -> Frame<'e> {
        let joints_rest_m = &estimate.shaped.joints_m;
        let world = estimate.pose.world_joints(joints_rest_m);
        Frame {
            rest_m: self
                .chosen
                .corrected_m(&estimate.shaped.positions_m, &estimate.pose),
            matrices: SkinMatrices::new(&estimate.pose, joints_rest_m),
            joint_rotation: world.rotation.map(DMat3::from_quat),
            joint_position_m: world.position_m,
        }
    }

    #[inline]
    fn residual(&self, frame: &Frame<'_>, vertex: usize) -> Residual {
        let skin = &self.body.skin[vertex];
        let rest_m = frame.rest_m[vertex];
        match self.objective {
            Objective::Unposed => {
                let unposing = frame.matrices.unposing(skin);
                let carried_m = unposing.rest_m(self.scan_m[vertex]);
                Residual {
                    value_m: carried_m - rest_m.as_dvec3(),
                    rest_from_world: unposing.linear,
                    carried_m,
                }
            }
            Objective::Posed => {
                let world_m = frame.matrices.blended(skin).transform_point3(rest_m);
                Residual {
                    value_m: (self.scan_m[vertex] - world_m).as_dvec3(),
                    rest_from_world: DMat3::IDENTITY,
                    carried_m: rest_m.as_dvec3(),
                }
            }
        }
    }

    /// The weighted robust sum of squares at an estimate, in m².
    pub fn cost(&self, estimate: &Estimate) -> f64 {
        let frame = self.frame(estimate);
        let sum: f64 = (self.chosen.vertices.iter().map(|&vertex| vertex as usize))
            .map(|vertex| {
                let size_m = self.residual(&frame, vertex).value_m.length();
                self.weights[vertex] * self.loss(size_m)
            })
            .sum();
        sum + self.prior_cost(estimate)
    }

    /// Sum of the weights of the vertices that count.
    pub fn weight_sum(&self) -> f64 {
        let vertices = self.chosen.vertices.iter();
        vertices.map(|&vertex| self.weights[vertex as usize]).sum()
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
        if self.beside == Beside::Shape {
            SHAPE_PRIOR * self.weight_sum()
        } else {
            0.0
        }
    }

    fn prior_cost(&self, estimate: &Estimate) -> f64 {
        0.5 * self.prior() * estimate.shape.iter().map(|beta| beta * beta).sum::<f64>()
    }

    /// Gauss-Newton normal equations at an estimate, with the robust weights of its residuals.
    pub fn normal(&self, estimate: &Estimate) -> Normal {
        let mut normal = self.without_prior(estimate);
        normal.cost += self.prior_cost(estimate);
        if self.beside == Beside::Shape {
            for (i, beta) in estimate.shape.iter().enumerate() {
                normal.hessian[(POSE + i, POSE + i)] += self.prior();
                normal.gradient[POSE + i] += self.prior() * beta;
            }
        }
        normal
    }

    /// The same of the residuals alone, without the prior of β.
    fn without_prior(&self, estimate: &Estimate) -> Normal {
        let frame = self.frame(estimate);
        let shape_maps_m = self.shape_maps_m(&frame);
        // Near the body, so that products of distances lose no digits.
        let centre_m = frame.joint_position_m[Joint::Pelvis as usize];
        let turns = if self.chosen.has_correctives() {
            turns(&frame.joint_rotation)
        } else {
            Vec::new()
        };
        // Columns of pose correctives, which follow those of β.
        let has_columns = std::ptr::eq(self.chosen, self.coarse);
        let columns = if has_columns { 3 * turns.len() } else { 0 };
        let mut twists = Twists::new(shape_maps_m.len() + columns);
        let mut own = vec![DVec3::ZERO; shape_maps_m.len() + columns];
        let mut pulls_m = Vec::new();
        let mut cost = 0.0;
        for (index, &vertex) in self.chosen.vertices.iter().enumerate() {
            let vertex = vertex as usize;
            let residual = self.residual(&frame, vertex);
            let size_m = residual.value_m.length();
            cost += self.weights[vertex] * self.loss(size_m);
            let weight = self.weights[vertex] * self.robust_weight(size_m);
            let by_rest = self.by_rest(&frame, vertex);
            self.shape_changes(&shape_maps_m, vertex, &residual, &by_rest, &mut own);
            let corrective_columns = &mut own[shape_maps_m.len()..];
            if !corrective_columns.is_empty() {
                self.chosen.changes_m(index, &turns, corrective_columns);
                for column in corrective_columns {
                    *column = -(by_rest * *column);
                }
            }
            if !turns.is_empty() && !has_columns {
                let pull_m = by_rest.transpose() * residual.value_m * weight;
                pulls_m.push(pull_m.as_vec3());
            }
            let carried_m = residual.carried_m.as_vec3();
            let carried_by = |joint: usize| {
                let map = &frame.matrices.world_from_rest[joint];
                map.transform_point3(carried_m).as_dvec3() - centre_m
            };
            let linear = Linear {
                residual_m: residual.value_m,
                rest_from_world: residual.rest_from_world,
                weight,
                own: &own,
            };
            twists.add(&self.body.skin[vertex], carried_by, &linear);
        }
        let mut own_unknowns: Vec<usize> = (POSE..POSE + shape_maps_m.len()).collect();
        // The pelvis has no correctives.
        let turned = ROTATION + 3..POSE;
        if columns > 0 {
            own_unknowns.extend(turned.clone());
        }
        let branches = self.branches(&frame, centre_m);
        let (mut hessian, mut gradient) = twists.normal(&branches, &own_unknowns, self.unknowns());
        if !pulls_m.is_empty() {
            for (unknown, slope) in turned.zip(self.chosen.gradient(&turns, &pulls_m)) {
                gradient[unknown] += slope;
            }
            let few = Problem {
                chosen: self.coarse,
                ..*self
            };
            hessian = few.without_prior(estimate).hessian * (self.weight_sum() / few.weight_sum());
        }
        Normal {
            cost,
            hessian,
            gradient,
        }
    }

    /// The unknowns that move branches.
    fn branches(&self, frame: &Frame<'_>, centre_m: DVec3) -> Vec<Branch> {
        let root = Branch {
            joint: Joint::Pelvis as usize,
            unknown: 0,
            turn: DMat3::ZERO,
            shift: DMat3::IDENTITY,
        };
        let turns = (0..JOINT_COUNT).map(|joint| Branch {
            joint,
            unknown: ROTATION + 3 * joint,
            turn: DMat3::IDENTITY,
            // A turn ω about the joint at p moves the centre by -ω × p = p × ω.
            shift: skew(frame.joint_position_m[joint] - centre_m),
        });
        let mut branches: Vec<Branch> = std::iter::once(root).chain(turns).collect();
        if self.beside == Beside::Joints {
            // A joint that moves by dJ moves the map of itself and of all below it by (R_parent - R) dJ.
            let places = Joint::ALL.into_iter().filter_map(|joint| {
                let (own, parent) = (joint as usize, joint.parent()? as usize);
                Some(Branch {
                    joint: own,
                    unknown: POSE + 3 * (own - 1),
                    turn: DMat3::ZERO,
                    shift: frame.joint_rotation[parent] - frame.joint_rotation[own],
                })
            });
            branches.extend(places);
        }
        branches
    }

    /// Change of each joint's world map `y = R rest + t` with each β: that of `t`, in metres. Empty where β is
    /// not fitted.
    fn shape_maps_m(&self, frame: &Frame<'_>) -> Vec<[DVec3; JOINT_COUNT]> {
        if self.beside != Beside::Shape {
            return Vec::new();
        }
        let dirs = self.body.joint_shape_dirs_m.iter();
        dirs.map(|dirs| map_change(dirs, &frame.joint_rotation))
            .collect()
    }

    /// Derivative of a vertex's residual by its rest position in the model, but for the sign.
    fn by_rest(&self, frame: &Frame<'_>, vertex: usize) -> DMat3 {
        match self.objective {
            Objective::Unposed => DMat3::IDENTITY,
            Objective::Posed => {
                let blended = frame.matrices.blended(&self.body.skin[vertex]).matrix3;
                DMat3::from_cols_array(&blended.to_cols_array().map(f64::from))
            }
        }
    }

    /// What β changes in a vertex's residual.
    fn shape_changes(
        &self,
        maps_m: &[[DVec3; JOINT_COUNT]],
        vertex: usize,
        residual: &Residual,
        by_rest: &DMat3,
        own: &mut [DVec3],
    ) {
        let skin = &self.body.skin[vertex];
        let dirs = maps_m.iter().zip(&self.body.shape_dirs_m);
        for (own, (maps_m, dirs)) in own.iter_mut().zip(dirs) {
            let bones = skin.joints.iter().zip(&skin.weights);
            let carried_m: DVec3 = bones
                .map(|(&joint, &weight)| f64::from(weight) * maps_m[usize::from(joint)])
                .sum();
            *own = -(residual.rest_from_world * carried_m + *by_rest * dirs[vertex].as_dvec3());
        }
    }

    /// Root mean square distance in metres between posed model and scan, by weight.
    pub fn distance_m(&self, estimate: &Estimate) -> f64 {
        let frame = self.frame(estimate);
        let (mut sum, mut weights) = (0.0, 0.0);
        for &vertex in &self.chosen.vertices {
            let vertex = vertex as usize;
            let weight = self.weights[vertex];
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

#[cfg(test)]
mod tests {
    use super::*;

    fn female() -> BodyModel {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/female/body.glb");
        BodyModel::from_glb(&std::fs::read(path).expect("the body")).expect("a body")
    }

    /// With correctives as SMPL has.
    fn corrected(mut body: BodyModel) -> BodyModel {
        body.pose_dirs_m = (0..9 * (JOINT_COUNT - 1))
            .map(|row| {
                let waves = (0..body.vertex_count()).map(|vertex| {
                    let k = (row * 31 + vertex * 7) as f32;
                    Vec3::new(k.sin(), (k * 1.3).cos(), (k * 0.7).sin()) * 0.003
                });
                waves.collect()
            })
            .collect();
        body
    }

    fn pose(phase: f64, far: f64) -> Pose {
        let mut pose = Pose::REST;
        for (joint, turn) in pose.parent_from_joint.iter_mut().enumerate() {
            let k = joint as f64 + phase;
            let axis = DVec3::new((k * 1.7).sin(), (k * 2.3).cos(), (k * 3.1).sin());
            *turn = DQuat::from_scaled_axis(far * axis);
        }
        pose.root_translation_m = DVec3::new(1.0, 0.3, -2.0);
        pose
    }

    /// An estimate moved by a step, whatever is fitted.
    fn moved(problem: &Problem<'_>, estimate: &Estimate, step: &DVector<f64>) -> Estimate {
        if problem.beside != Beside::Joints {
            return estimate.moved(problem.body, step);
        }
        let places = step.rows(POSE, PLACES);
        let mut offsets_m = estimate.joint_offsets_m;
        for (joint, offset_m) in offsets_m.iter_mut().skip(1).enumerate() {
            *offset_m += DVec3::from_array(std::array::from_fn(|axis| places[3 * joint + axis]));
        }
        let turned = estimate.moved(problem.body, &step.rows(0, POSE).into_owned());
        Estimate::new(problem.body, turned.pose, estimate.shape, offsets_m)
    }

    /// Where residuals vanish, Gauss-Newton is exact: the gradient changes by the Hessian times the step.
    #[test]
    fn the_equations_are_the_derivatives_of_the_cost() {
        for body in [female(), corrected(female())] {
            let shape: [f64; SHAPE_COUNT] = std::array::from_fn(|i| (i as f64 * 1.1).sin());
            let offsets_m = std::array::from_fn(|joint| {
                let k = joint as f64;
                0.01 * DVec3::new((k * 2.0).sin(), (k * 1.4).cos(), (k * 0.6).sin())
            });
            let truth = Estimate::new(&body, pose(0.4, 0.4), shape, offsets_m);
            let matrices = SkinMatrices::new(&truth.pose, &truth.shaped.joints_m);
            let mut scan_m = vec![Vec3::ZERO; body.vertex_count()];
            let rest_m = truth.rest_m(&body).into_owned();
            dynaskin_body::skin_linear(&rest_m, &body.skin, &matrices, &mut scan_m);
            let weights: Vec<f64> = (0..scan_m.len()).map(|i| 0.2 + (i % 5) as f64).collect();
            let every = |stride| (0..scan_m.len() as u32).step_by(stride).collect();
            let chosen = Chosen::new(&body, every(3));
            let fewer = Chosen::new(&body, every(9));
            for objective in [Objective::Unposed, Objective::Posed] {
                for beside in [Beside::Nothing, Beside::Shape, Beside::Joints] {
                    let problem = Problem {
                        body: &body,
                        objective,
                        scan_m: &scan_m,
                        weights: &weights,
                        chosen: &chosen,
                        beside,
                        coarse: &chosen,
                        robust_m: 10.0,
                    };
                    let normal = problem.normal(&truth);
                    assert!(
                        (normal.cost - problem.cost(&truth)).abs() < 1e-12,
                        "{objective:?} {beside:?}"
                    );
                    // A Hessian of fewer vertices goes with the same gradient, and is positive definite, too.
                    let aside = moved(
                        &problem,
                        &truth,
                        &DVector::from_element(problem.unknowns(), 0.01),
                    );
                    let few = Problem {
                        coarse: &fewer,
                        ..problem
                    };
                    let [whole, part] = [&problem, &few].map(|of| of.normal(&aside));
                    let error = (&whole.gradient - &part.gradient).norm() / whole.gradient.norm();
                    assert!(error < 1e-5, "{objective:?} {beside:?}: {error}");
                    let poses = part.hessian.view((0, 0), (POSE, POSE)).into_owned();
                    assert!(poses.cholesky().is_some(), "{objective:?} {beside:?}");
                    let step = DVector::from_fn(problem.unknowns(), |i, _| {
                        1e-3 * (i as f64 * 1.9 + 0.3).sin()
                    });
                    let there = problem.normal(&moved(&problem, &truth, &step)).gradient;
                    let back = problem.normal(&moved(&problem, &truth, &-&step)).gradient;
                    let found = (there - back) * 0.5;
                    let expected = &normal.hessian * &step;
                    let error = (&found - &expected).norm() / expected.norm();
                    assert!(error < 3e-3, "{objective:?} {beside:?}: {error}");
                    // And the gradient is that of the cost, away from the truth.
                    let aside = moved(&problem, &truth, &(&step * 20.0));
                    let slope = problem.normal(&aside).gradient.dot(&step);
                    let costs = [1.0, -1.0].map(|sign| {
                        problem.cost(&moved(&problem, &aside, &(&step * (0.2 * sign))))
                    });
                    let expected = (costs[0] - costs[1]) / 0.4;
                    assert!(
                        (slope - expected).abs() < 0.02 * expected.abs(),
                        "{objective:?} {beside:?}: {slope} {expected}"
                    );
                }
            }
        }
    }
}
