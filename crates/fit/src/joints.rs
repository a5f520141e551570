//! Where a person's joints lie: fitted to frames of many poses at once.
//!
//! β puts the joints where an average body of that surface has them. Real ones lie a centimetre aside, and
//! then every pose is wrong by the angle that hides it. A joint's place shows where the joint bends: it moves
//! what is below it by `(R_parent - R) dJ`. So the places are found by Gauss-Newton over frames whose poses
//! differ most. Each frame's own pose is eliminated from its normal equations (Schur complement), which leaves
//! 69 equations; then the poses are fitted again. The distance of a joint along the axis of a hinge shows
//! nowhere, and neither does the place of a joint that never bends: a weak prior keeps them where β puts them.

use dynaskin_body::{BodyModel, JOINT_COUNT, Pose};
use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::problem::{Beside, Estimate, Normal, PLACES, POSE, Problem};
use crate::sequence::{Fitter, Known, Weights};
use crate::solve::damped;
use crate::start::{Parts, pose_by_parts};
use crate::{FitError, Scans};

/// Frames that the joints are fitted to.
const FRAMES: usize = 60;
/// Weight of a joint's squared distance from where β puts it, against the sum of all frames' rigidity.
const PRIOR: f64 = 1e-5;
/// Power of a vertex's largest skin weight that it counts by.
const ON_BONE: i32 = 4;
/// Rounds of shape, then joints.
const ROUNDS: usize = 4;
/// Steps of the joints in a round.
const STEPS: usize = 6;
/// A step that lowers the cost by less than this part ends a round.
const ENOUGH: f64 = 1e-4;
/// Movement of all joints in a round, in metres, below which no further round is needed.
const STILL_M: f64 = 1e-4;
/// How often a step is halved before it is given up.
const HALVINGS: usize = 4;
/// Farthest that given joints may lie from where β puts them, in metres.
const FARTHEST_M: f32 = 0.3;

/// Where the joints lie.
#[expect(
    clippy::large_enum_variant,
    reason = "three hundred bytes, a few times a fit"
)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Joints {
    /// Where β puts them.
    Body,
    /// Where the scans' movement shows them: a person's joints lie about a centimetre from where β puts them.
    Fitted,
    /// Given: from where β puts them, in metres in the rest pose, `[joint]`.
    Given([Vec3; JOINT_COUNT]),
}

impl Joints {
    /// Offsets to begin with, in metres.
    pub(crate) fn offsets_m(&self) -> Result<[DVec3; JOINT_COUNT], FitError> {
        match self {
            Self::Body | Self::Fitted => Ok([DVec3::ZERO; JOINT_COUNT]),
            Self::Given(offsets_m) => {
                // Written so that what is no number is refused.
                if offsets_m.iter().all(|offset| offset.length() <= FARTHEST_M) {
                    Ok(offsets_m.map(|offset| offset.as_dvec3()))
                } else {
                    Err(FitError::Parameter {
                        name: "the joints' offsets",
                        got: format!("{offsets_m:?}"),
                        expected: "places at most 0.3 m from where the shape puts the joints",
                    })
                }
            }
        }
    }
}

/// Frames of a person to fit the joints to: some of each sequence, of which those are used whose poses differ
/// most.
pub struct JointFrames<'b> {
    body: &'b BodyModel,
    parts: Parts,
    scans_m: Vec<Vec<Vec3>>,
    poses: Vec<Pose>,
}

impl<'b> JointFrames<'b> {
    /// Frames that one person needs at most, over all sequences. One takes 12 bytes a vertex.
    pub const MOST: usize = 240;

    /// No frames yet.
    pub fn new(body: &'b BodyModel) -> Self {
        Self {
            body,
            parts: Parts::new(body),
            scans_m: Vec::new(),
            poses: Vec::new(),
        }
    }

    /// Adds at most so many frames of a sequence, evenly spaced.
    ///
    /// # Errors
    /// As [`Scans::frames_m`].
    pub fn add(&mut self, scans: &Scans<'_>, most: usize) -> Result<(), FitError> {
        let stride = scans.frame_count().div_ceil(most.max(1));
        let mean_shape = self.body.shaped(&Default::default());
        let weights = vec![1.0; self.body.vertex_count()];
        for scan_m in scans.every_nth_m(stride)? {
            let pose = pose_by_parts(&mean_shape, &scan_m, &weights, &self.parts);
            self.scans_m.push(scan_m);
            self.poses.push(pose);
        }
        Ok(())
    }

    /// Those whose poses differ most: each next one is farthest from all before it.
    fn chosen(&self) -> Vec<&[Vec3]> {
        let mut nearest = vec![f64::INFINITY; self.poses.len()];
        let mut chosen: Vec<&[Vec3]> = Vec::new();
        let mut next = 0;
        while chosen.len() < FRAMES.min(self.poses.len()) {
            chosen.push(&self.scans_m[next]);
            nearest[next] = f64::NEG_INFINITY;
            let mut farthest = f64::NEG_INFINITY;
            let last = next;
            for (index, nearest) in nearest.iter_mut().enumerate() {
                *nearest = nearest.min(difference(&self.poses[last], &self.poses[index]));
                if *nearest > farthest {
                    (farthest, next) = (*nearest, index);
                }
            }
        }
        chosen
    }
}

/// Sum of the squared angles between two poses' joints.
fn difference(first: &Pose, second: &Pose) -> f64 {
    // The pelvis' own rotation shows no joint.
    let joints = 1..JOINT_COUNT;
    joints
        .map(|joint| {
            let (a, b) = (
                first.parent_from_joint[joint],
                second.parent_from_joint[joint],
            );
            a.angle_between(b).powi(2)
        })
        .sum()
}

/// `first` with fitted joints, and with a shape that goes with them unless it is known.
pub(crate) fn fitted(
    fitter: &Fitter<'_>,
    first_m: &[Vec3],
    frames: &JointFrames<'_>,
    all: &Weights,
    known: &Known,
    mut first: Estimate,
) -> Result<Estimate, FitError> {
    let scans_m = frames.chosen();
    let weights = &on_bones(fitter.body, all);
    let mut poses: Vec<Vec<Pose>> = vec![Vec::new(); scans_m.len()];
    for _ in 0..ROUNDS {
        let mut fit = Fit {
            fitter,
            weights,
            scans_m: &scans_m,
            state: State::new(fitter, weights, &scans_m, &first, &poses),
        };
        let before_m = first.joint_offsets_m;
        fit.solve();
        poses = fit.state.poses();
        let found = Known {
            shape: known.shape,
            joint_offsets_m: fit.state.joint_offsets_m,
        };
        first = fitter.first(first_m, all, &found)?;
        let moved_m = (before_m.iter().zip(&first.joint_offsets_m))
            .map(|(before, after)| before.distance(*after))
            .fold(0.0, f64::max);
        // A known shape needs no round to follow the joints.
        if known.shape.is_some() || moved_m < STILL_M {
            break;
        }
    }
    Ok(first)
}

/// Weights of the vertices that move as a bone does: between bones skin bends in its own way, not about a
/// joint.
fn on_bones(body: &BodyModel, weights: &Weights) -> Weights {
    let values = weights.values.iter().zip(&body.skin);
    let on_bones = values.map(|(weight, skin)| weight * f64::from(skin.weights[0]).powi(ON_BONE));
    Weights::new(body, on_bones.collect())
}

/// Joints, and the poses that go with them.
struct State {
    joint_offsets_m: [DVec3; JOINT_COUNT],
    frames: Vec<Estimate>,
    cost: f64,
}

impl State {
    fn new(
        fitter: &Fitter<'_>,
        weights: &Weights,
        scans_m: &[&[Vec3]],
        first: &Estimate,
        poses: &[Vec<Pose>],
    ) -> Self {
        let frames = scans_m
            .par_iter()
            .zip(poses)
            .map(|(scan_m, pose)| fitter.pose(scan_m, weights, first, pose))
            .collect();
        Self::of(fitter, weights, scans_m, first.joint_offsets_m, frames)
    }

    fn of(
        fitter: &Fitter<'_>,
        weights: &Weights,
        scans_m: &[&[Vec3]],
        joint_offsets_m: [DVec3; JOINT_COUNT],
        frames: Vec<Estimate>,
    ) -> Self {
        let costs: Vec<f64> = (frames.par_iter().zip(scans_m))
            .map(|(frame, scan_m)| fitter.problem(scan_m, weights).cost(frame))
            .collect();
        let squares = joint_offsets_m.iter().map(|offset| offset.length_squared());
        let prior = prior(weights, scans_m.len());
        Self {
            joint_offsets_m,
            cost: costs.iter().sum::<f64>() + 0.5 * prior * squares.sum::<f64>(),
            frames,
        }
    }

    fn poses(&self) -> Vec<Vec<Pose>> {
        let frames = self.frames.iter();
        frames.map(|frame| vec![frame.pose.clone()]).collect()
    }
}

fn prior(weights: &Weights, frames: usize) -> f64 {
    PRIOR * frames as f64 * weights.values.iter().sum::<f64>()
}

struct Fit<'a> {
    fitter: &'a Fitter<'a>,
    weights: &'a Weights,
    scans_m: &'a [&'a [Vec3]],
    state: State,
}

/// A frame's equations with its pose eliminated.
struct Reduced {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Fit<'_> {
    /// Moves the joints until the cost falls no more.
    fn solve(&mut self) {
        for _ in 0..STEPS {
            let Some(step) = self.step() else {
                return;
            };
            let before = self.state.cost;
            let mut share = 1.0;
            for _ in 0..HALVINGS {
                let tried = self.moved(&step, share);
                if tried.cost < before {
                    self.state = tried;
                    break;
                }
                share *= 0.5;
            }
            if before - self.state.cost <= ENOUGH * before {
                return;
            }
        }
    }

    /// The Gauss-Newton step of the joints.
    fn step(&self) -> Option<DVector<f64>> {
        let reduced: Vec<Reduced> = (self.state.frames.par_iter().zip(self.scans_m))
            .filter_map(|(frame, scan_m)| {
                let problem = Problem {
                    beside: Beside::Joints,
                    ..self.fitter.problem(scan_m, self.weights)
                };
                reduced(&problem.normal(frame))
            })
            .collect();
        let prior = prior(self.weights, self.scans_m.len());
        let mut hessian = DMatrix::identity(PLACES, PLACES) * prior;
        let places = self.state.joint_offsets_m[1..].iter();
        let mut gradient = DVector::from_iterator(
            PLACES,
            places.flat_map(|offset| offset.to_array().map(|m| prior * m)),
        );
        for frame in &reduced {
            hessian += &frame.hessian;
            gradient += &frame.gradient;
        }
        let step = -hessian.cholesky()?.solve(&gradient);
        step.iter().all(|m| m.is_finite()).then_some(step)
    }

    /// The joints moved by a share of a step, and the poses fitted again.
    fn moved(&self, step: &DVector<f64>, share: f64) -> State {
        let mut joint_offsets_m = self.state.joint_offsets_m;
        for (joint, offset_m) in joint_offsets_m.iter_mut().skip(1).enumerate() {
            *offset_m +=
                share * DVec3::new(step[3 * joint], step[3 * joint + 1], step[3 * joint + 2]);
        }
        let body = self.fitter.body;
        let Some(first) = self.state.frames.first() else {
            return State::of(self.fitter, self.weights, &[], joint_offsets_m, Vec::new());
        };
        let moved = Estimate::new(body, Pose::REST, first.shape, joint_offsets_m);
        let frames = self
            .state
            .frames
            .par_iter()
            .zip(self.scans_m)
            .map(|(frame, scan_m)| {
                self.fitter
                    .refined(scan_m, self.weights, moved.posed(frame.pose.clone()))
            })
            .collect();
        State::of(
            self.fitter,
            self.weights,
            self.scans_m,
            joint_offsets_m,
            frames,
        )
    }
}

/// The equations of the joints alone, where the pose goes along; none where they determine no pose.
fn reduced(normal: &Normal) -> Option<Reduced> {
    let pose = normal.hessian.view((0, 0), (POSE, POSE)).into_owned();
    let cross = normal.hessian.view((0, POSE), (POSE, PLACES)).into_owned();
    let places = normal.hessian.view((POSE, POSE), (PLACES, PLACES));
    // Joints that move no vertex with weight stay where they are.
    let factors = damped(&pose, 0.0).cholesky()?;
    let along = factors.solve(&cross);
    let reduced = Reduced {
        hessian: places - cross.transpose() * &along,
        gradient: normal.gradient.rows(POSE, PLACES)
            - along.transpose() * normal.gradient.rows(0, POSE),
    };
    let is_finite = reduced.gradient.iter().all(|m| m.is_finite());
    is_finite.then_some(reduced)
}
