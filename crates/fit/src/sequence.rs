//! Fitting a whole sequence: β from the first frame, then every frame's pose, then Δ.

use std::sync::atomic::{AtomicUsize, Ordering};

use dynaskin_body::{BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT, SkinMatrices, unpose_linear};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::correctives::Chosen;
use crate::joints::{self, JointFrames, Joints};
use crate::problem::{Beside, Estimate, Objective, Problem};
use crate::rigidity::{self, Rigidity};
use crate::solve::solve;
use crate::start::{Parts, continued, pose_by_parts};
use crate::{FitError, Scans};

/// Frames fitted one after the other, each from the one before; such runs are fitted in parallel,
/// so that results do not depend on the number of threads.
const RUN_FRAMES: usize = 32;
/// Runs that each thread has in a batch, so that it waits little for others, and frames of the least batch.
const RUNS_A_THREAD: usize = 2;
const LEAST_BATCH: usize = 128;
/// Frames that rigidity is learned from, at most.
const RIGIDITY_FRAMES: usize = 60;
/// How often rigidity is learned, each time from a fit with the one before.
const RIGIDITY_PASSES: usize = 3;
/// Scale of the robust loss in metres, wide first: a narrow one sees no way from a far start.
const WIDE_M: f64 = 0.2;
const NARROW_M: f64 = 0.02;
/// Steps at most from a far start, and with the narrow loss.
const WIDE_STEPS: usize = 40;
const NARROW_STEPS: usize = 30;
/// Steps with the wide loss where a pose is near already.
const NEAR_STEPS: usize = 3;
/// Of so many vertices one tells roughly where the pose is; all of them tell the rest.
const COARSE: usize = 6;
/// A step with few vertices that lowers the cost by less than this part is the last one with few.
const ENOUGH_COARSE: f64 = 1e-3;
/// The same with all vertices: the step is then a thousandth of the residuals.
const ENOUGH: f64 = 1e-6;
/// The same while joints are looked for, which moves the poses anyway: a hundredth of the residuals.
const ENOUGH_FOR_JOINTS: f64 = 1e-4;
/// Farthest RMS distance of the rigid skin in the first frame that still is a fit, in metres.
const NO_FIT_M: f64 = 0.06;

/// How to fit.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Where differences are measured.
    pub objective: Objective,
    /// Where the rigidity weights come from.
    pub rigidity: Rigidity,
    /// Shape coefficients known beforehand, in standard deviations; none fits them to the first
    /// frame.
    pub shape: Option<[f32; SHAPE_COUNT]>,
    /// Whether the offsets are relative to the subject's own surface. The residual of the first
    /// frame after fitting β is then not soft tissue but a body outside the shape space, and is
    /// subtracted from every frame. The first frame must then be at rest.
    pub own_surface: bool,
    /// Where the joints lie.
    pub joints: Joints,
}

impl FitOptions {
    /// Unposed, with rigidity from the body where it has soft regions, else from the scans, and with fitted
    /// joints.
    pub fn for_body(body: &BodyModel) -> Self {
        Self {
            objective: Objective::Unposed,
            rigidity: if body.region_weights.is_empty() {
                Rigidity::Data
            } else {
                Rigidity::Body
            },
            shape: None,
            own_surface: false,
            joints: Joints::Fitted,
        }
    }
}

/// One fitted frame.
#[derive(Clone, Debug)]
pub struct FittedFrame {
    /// The pose, in the project's conventions.
    pub pose: Pose,
    /// Offsets Δ in the rest pose in metres, `[vertex]`, before skinning.
    pub offsets_rest_m: Vec<Vec3>,
    /// RMS distance of the rigid skin from the scan, in metres.
    pub rigid_distance_m: f32,
}

/// A fitted sequence.
#[derive(Clone, Debug)]
pub struct FittedSequence {
    /// Frames per second.
    pub rate_hz: f64,
    /// Shape coefficients β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// How far each joint lies from where β puts it, in metres in the rest pose, `[joint]`.
    pub joint_offsets_m: [Vec3; JOINT_COUNT],
    /// Rigidity weight of each vertex, 0 to 1.
    pub rigidity: Vec<f64>,
    /// The frames, at least one.
    pub frames: Vec<FittedFrame>,
}

/// What all frames of a sequence share.
pub(crate) struct Fitter<'a> {
    pub body: &'a BodyModel,
    objective: Objective,
    parts: Parts,
}

/// How much each vertex counts.
pub(crate) struct Weights {
    /// `[vertex]`, 0 to 1.
    pub values: Vec<f64>,
    /// The vertices that count at all.
    chosen: Chosen,
    /// Some of them.
    coarse: Chosen,
}

impl Weights {
    pub fn new(body: &BodyModel, values: Vec<f64>) -> Self {
        let counts = |vertex: &u32| values[*vertex as usize] > 0.0;
        let chosen: Vec<u32> = (0..values.len() as u32).filter(counts).collect();
        Self {
            coarse: Chosen::new(body, chosen.iter().copied().step_by(COARSE).collect()),
            chosen: Chosen::new(body, chosen),
            values,
        }
    }
}

/// A sequence whose shape is known, and whose frames are fitted when they are asked for.
pub struct SequenceFit<'a> {
    fitter: Fitter<'a>,
    scans: &'a Scans<'a>,
    weights: Weights,
    first: Estimate,
    own_surface: bool,
}

/// Fits `body` to `scans` on rayon's current pool and calls `done` with the number of frames done
/// so far, from any thread. All of it is held in memory; [`SequenceFit`] holds a few frames.
///
/// # Errors
/// As [`SequenceFit::begin`] and [`SequenceFit::frames`].
pub fn fit_sequence(
    body: &BodyModel,
    scans: &Scans<'_>,
    options: &FitOptions,
    done: impl Fn(usize) + Sync,
) -> Result<FittedSequence, FitError> {
    let fit = SequenceFit::begin(body, scans, options)?;
    let mut frames = Vec::with_capacity(fit.frame_count());
    fit.frames(done, |frame| {
        frames.push(frame);
        Ok(())
    })?;
    Ok(FittedSequence {
        rate_hz: scans.rate_hz,
        shape: fit.shape(),
        joint_offsets_m: fit.joint_offsets_m(),
        rigidity: fit.weights.values,
        frames,
    })
}

impl<'a> SequenceFit<'a> {
    /// Fits β to the first frame of `scans` and the joints to frames of all of it, unless they are given, and
    /// finds the rigidity weights.
    ///
    /// # Errors
    /// [`FitError::NoFit`] where the first frame is no mesh of this body in this order,
    /// [`FitError::Body`] for rigidity that the body does not tell, [`FitError::Parameter`] for β, joints or
    /// weights that are none, [`FitError::Topology`] for scans of another body, and what
    /// [`Scans::frames_m`] gives.
    pub fn begin(
        body: &'a BodyModel,
        scans: &'a Scans<'a>,
        options: &FitOptions,
    ) -> Result<Self, FitError> {
        let mut frames = JointFrames::new(body);
        if options.joints == Joints::Fitted {
            check_topology(body, scans)?;
            frames.add(scans, JointFrames::MOST)?;
        }
        Self::begin_with(body, scans, &frames, options)
    }

    /// As [`Self::begin`], with joints fitted to `frames`, which may be of several sequences of the person.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub fn begin_with(
        body: &'a BodyModel,
        scans: &'a Scans<'a>,
        frames: &JointFrames<'_>,
        options: &FitOptions,
    ) -> Result<Self, FitError> {
        check_topology(body, scans)?;
        let fitter = Fitter {
            body,
            objective: options.objective,
            parts: Parts::new(body),
        };
        let known = Known {
            shape: options.shape,
            joint_offsets_m: options.joints.offsets_m()?,
        };
        let mut weights = Weights::new(body, options.rigidity.weights(body)?);
        let first_m = scans.frames_m(0..1)?;
        let mut first = fitter.first(&first_m, &weights, &known)?;
        let learns = options.rigidity == Rigidity::Data;
        if learns {
            for _ in 0..RIGIDITY_PASSES {
                weights = fitter.learned(scans, &weights, &first)?;
                first = fitter.first(&first_m, &weights, &known)?;
            }
        }
        if options.joints == Joints::Fitted {
            first = joints::fitted(&fitter, &first_m, frames, &weights, &known, first)?;
            if learns {
                weights = fitter.learned(scans, &weights, &first)?;
                let known = Known {
                    joint_offsets_m: first.joint_offsets_m,
                    ..known
                };
                first = fitter.first(&first_m, &weights, &known)?;
            }
        }
        Ok(Self {
            fitter,
            scans,
            weights,
            first,
            own_surface: options.own_surface,
        })
    }

    /// Shape coefficients β in standard deviations.
    pub fn shape(&self) -> [f32; SHAPE_COUNT] {
        self.first.shape.map(|beta| beta as f32)
    }

    /// How far each joint lies from where β puts it, in metres in the rest pose, `[joint]`. The pelvis stays:
    /// the root's translation makes up for it.
    pub fn joint_offsets_m(&self) -> [Vec3; JOINT_COUNT] {
        self.first.joint_offsets_m.map(|offset| offset.as_vec3())
    }

    /// Rigidity weight of each vertex, 0 to 1.
    pub fn rigidity(&self) -> &[f64] {
        &self.weights.values
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.scans.rate_hz
    }

    /// Number of frames, at least 1.
    pub fn frame_count(&self) -> usize {
        self.scans.frame_count()
    }

    /// Fits all frames on rayon's current pool and hands them to `sink` in their order. `done` is called
    /// with the number of frames done so far, from any thread. A few dozen frames for each thread are held
    /// at a time, as scans and as offsets.
    ///
    /// # Errors
    /// What [`Scans::frames_m`] and `sink` give.
    pub fn frames(
        &self,
        done: impl Fn(usize) + Sync,
        mut sink: impl FnMut(FittedFrame) -> Result<(), FitError>,
    ) -> Result<(), FitError> {
        let finished = AtomicUsize::new(0);
        let least = (RUNS_A_THREAD * RUN_FRAMES * rayon::current_num_threads()).max(LEAST_BATCH);
        // Whole runs, so that results do not depend on how many frames are read at a time.
        let batch = self.scans.batch_frames(least).next_multiple_of(RUN_FRAMES);
        let mut own_m: Option<Vec<Vec3>> = None;
        for first in (0..self.frame_count()).step_by(batch) {
            let end = self.frame_count().min(first + batch);
            let scans_m = self.scans.frames_m(first..end)?;
            let runs: Vec<Vec<FittedFrame>> = scans_m
                .par_chunks(RUN_FRAMES * self.scans.vertex_count)
                .with_max_len(1)
                .map(|run| {
                    self.run(run, || {
                        done(finished.fetch_add(1, Ordering::Relaxed) + 1);
                    })
                })
                .collect();
            drop(scans_m);
            for mut frame in runs.into_iter().flatten() {
                if self.own_surface {
                    let own_m = own_m.get_or_insert_with(|| frame.offsets_rest_m.clone());
                    for (offset, own) in frame.offsets_rest_m.iter_mut().zip(own_m.iter()) {
                        *offset -= *own;
                    }
                }
                sink(frame)?;
            }
        }
        Ok(())
    }

    /// Frames one after the other, each from the one before.
    fn run(&self, scans_m: &[Vec3], done: impl Fn()) -> Vec<FittedFrame> {
        let fitter = &self.fitter;
        // The last pose, and where the movement of the last two leads.
        let mut near: Vec<Pose> = Vec::new();
        scans_m
            .chunks_exact(self.scans.vertex_count)
            .map(|scan_m| {
                let estimate = fitter.pose(scan_m, &self.weights, &self.first, &near);
                let problem = fitter.problem(scan_m, &self.weights);
                let fitted = FittedFrame {
                    offsets_rest_m: fitter.offsets_rest_m(scan_m, &estimate),
                    rigid_distance_m: problem.distance_m(&estimate) as f32,
                    pose: estimate.pose,
                };
                near = match near.first() {
                    None => vec![fitted.pose.clone()],
                    Some(before) => {
                        vec![fitted.pose.clone(), continued(before, &fitted.pose)]
                    }
                };
                done();
                fitted
            })
            .collect()
    }
}

/// What is known of a person before the fit.
pub(crate) struct Known {
    pub shape: Option<[f32; SHAPE_COUNT]>,
    pub joint_offsets_m: [DVec3; JOINT_COUNT],
}

fn check_topology(body: &BodyModel, scans: &Scans<'_>) -> Result<(), FitError> {
    if scans.vertex_count == body.vertex_count() {
        return Ok(());
    }
    Err(FitError::Topology {
        path: scans.path.clone(),
        what: "the number of vertices",
        expected: body.vertex_count().to_string(),
        got: scans.vertex_count.to_string(),
    })
}

impl Fitter<'_> {
    pub fn problem<'b>(&'b self, scan_m: &'b [Vec3], weights: &'b Weights) -> Problem<'b> {
        Problem {
            body: self.body,
            objective: self.objective,
            scan_m,
            weights: &weights.values,
            chosen: &weights.chosen,
            beside: Beside::Nothing,
            coarse: &weights.coarse,
            robust_m: NARROW_M,
        }
    }

    /// Solves with the wide, then with the narrow loss, with few vertices until that brings no more.
    fn solved(
        &self,
        problem: &Problem<'_>,
        coarse: &Chosen,
        start: Estimate,
        wide_steps: usize,
    ) -> Estimate {
        let few = Problem {
            chosen: coarse,
            ..*problem
        };
        let wide = Problem {
            robust_m: WIDE_M,
            ..few
        };
        let near = solve(&wide, start, wide_steps, ENOUGH_COARSE);
        let nearer = solve(&few, near, NARROW_STEPS, ENOUGH_COARSE);
        solve(problem, nearer, NARROW_STEPS, ENOUGH)
    }

    /// A pose near enough for the narrow loss, as exact as a step of the joints needs.
    pub fn refined(&self, scan_m: &[Vec3], weights: &Weights, start: Estimate) -> Estimate {
        let problem = self.problem(scan_m, weights);
        solve(&problem, start, NARROW_STEPS, ENOUGH_FOR_JOINTS)
    }

    /// The first frame: pose and, unless it is known, shape.
    pub fn first(
        &self,
        scan_m: &[Vec3],
        weights: &Weights,
        known: &Known,
    ) -> Result<Estimate, FitError> {
        let shape = known.shape.unwrap_or_default();
        if !shape.iter().all(|beta| beta.abs() <= 10.0) {
            return Err(FitError::Parameter {
                name: "the shape",
                got: format!("{shape:?}"),
                expected: "coefficients between -10 and 10 standard deviations",
            });
        }
        let shape_f64 = shape.map(f64::from);
        let mut estimate = Estimate::new(self.body, Pose::REST, shape_f64, known.joint_offsets_m);
        estimate.pose = pose_by_parts(&estimate.shaped, scan_m, &weights.values, &self.parts);
        let mut problem = self.problem(scan_m, weights);
        estimate = self.solved(&problem, &weights.coarse, estimate, WIDE_STEPS);
        // Chest and belly tell most of some coefficients: soft skin counts more here than for poses.
        let shape_weights: Vec<f64> = weights.values.iter().map(|weight| weight.sqrt()).collect();
        if known.shape.is_none() {
            problem.beside = Beside::Shape;
            problem.weights = &shape_weights;
            estimate = self.solved(&problem, &weights.coarse, estimate, WIDE_STEPS);
        }
        let distance_m = problem.distance_m(&estimate);
        if distance_m <= NO_FIT_M {
            Ok(estimate)
        } else {
            Err(FitError::NoFit {
                frame: 0,
                distance_m,
                limit_m: NO_FIT_M,
            })
        }
    }

    /// Rigidity from some frames of the scans.
    fn learned(
        &self,
        scans: &Scans<'_>,
        weights: &Weights,
        first: &Estimate,
    ) -> Result<Weights, FitError> {
        let stride = scans.frame_count().div_ceil(RIGIDITY_FRAMES);
        let offsets_rest_m: Vec<Vec<Vec3>> = (scans.every_nth_m(stride)?)
            .par_iter()
            .map(|scan_m| {
                let estimate = self.pose(scan_m, weights, first, &[]);
                self.offsets_rest_m(scan_m, &estimate)
            })
            .collect();
        let learned = rigidity::from_offsets(&offsets_rest_m, self.body.vertex_count());
        Ok(Weights::new(self.body, learned))
    }

    /// A frame of the shape of `first`, from one of some poses that may be near, or by parts: whichever is
    /// nearest.
    pub fn pose(
        &self,
        scan_m: &[Vec3],
        weights: &Weights,
        first: &Estimate,
        near: &[Pose],
    ) -> Estimate {
        let problem = self.problem(scan_m, weights);
        let coarse = Problem {
            chosen: &weights.coarse,
            ..problem
        };
        let by_parts = pose_by_parts(&first.shaped, scan_m, &weights.values, &self.parts);
        let mut start = first.posed(by_parts);
        let (mut cost, mut wide_steps) = (coarse.cost(&start), WIDE_STEPS);
        for pose in near {
            let tried = first.posed(pose.clone());
            let tried_cost = coarse.cost(&tried);
            if tried_cost < cost {
                (start, cost, wide_steps) = (tried, tried_cost, NEAR_STEPS);
            }
        }
        self.solved(&problem, &weights.coarse, start, wide_steps)
    }

    /// DSNet Eq. 5: the unposed scan minus template, shape and pose correctives.
    fn offsets_rest_m(&self, scan_m: &[Vec3], estimate: &Estimate) -> Vec<Vec3> {
        let matrices = SkinMatrices::new(&estimate.pose, &estimate.shaped.joints_m);
        let mut offsets_m = vec![Vec3::ZERO; scan_m.len()];
        unpose_linear(scan_m, &self.body.skin, &matrices, &mut offsets_m);
        for (offset, rest) in offsets_m.iter_mut().zip(estimate.rest_m(self.body).iter()) {
            *offset -= *rest;
        }
        offsets_m
    }
}
