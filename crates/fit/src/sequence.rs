//! Fitting a whole sequence: β from the first frame, then every frame's pose, then Δ.

use std::sync::atomic::{AtomicUsize, Ordering};

use dynaskin_body::{BodyModel, Pose, SHAPE_COUNT, SkinMatrices, unpose_linear};
use glam::Vec3;
use rayon::prelude::*;

use crate::problem::{Estimate, Objective, Problem, moving};
use crate::rigidity::{self, Rigidity};
use crate::solve::solve;
use crate::start::{Parts, pose_by_parts};
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
}

impl FitOptions {
    /// Unposed, with rigidity from the body where it has soft regions, else from the scans.
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
    /// Rigidity weight of each vertex, 0 to 1.
    pub rigidity: Vec<f64>,
    /// The frames, at least one.
    pub frames: Vec<FittedFrame>,
}

/// What all frames of a sequence share.
struct Fitter<'a> {
    body: &'a BodyModel,
    objective: Objective,
    moving: Vec<u32>,
    parts: Parts,
}

/// A sequence whose shape is known, and whose frames are fitted when they are asked for.
pub struct SequenceFit<'a> {
    fitter: Fitter<'a>,
    scans: &'a Scans<'a>,
    weights: Vec<f64>,
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
        rigidity: fit.weights,
        frames,
    })
}

impl<'a> SequenceFit<'a> {
    /// Fits β to the first frame of `scans`, unless it is given, and finds the rigidity weights.
    ///
    /// # Errors
    /// [`FitError::NoFit`] where the first frame is no mesh of this body in this order,
    /// [`FitError::Body`] for rigidity that the body does not tell, [`FitError::Parameter`] for β or
    /// weights that are none, [`FitError::Topology`] for scans of another body, and what
    /// [`Scans::frames_m`] gives.
    pub fn begin(
        body: &'a BodyModel,
        scans: &'a Scans<'a>,
        options: &FitOptions,
    ) -> Result<Self, FitError> {
        if scans.vertex_count != body.vertex_count() {
            return Err(FitError::Topology {
                path: scans.path.clone(),
                what: "the number of vertices",
                expected: body.vertex_count().to_string(),
                got: scans.vertex_count.to_string(),
            });
        }
        let fitter = Fitter {
            body,
            objective: options.objective,
            moving: moving(body),
            parts: Parts::new(body),
        };
        let mut weights = options.rigidity.weights(body)?;
        let first_m = scans.frames_m(0..1)?;
        let mut first = fitter.first(&first_m, &weights, options.shape)?;
        if options.rigidity == Rigidity::Data {
            let stride = scans.frame_count().div_ceil(RIGIDITY_FRAMES);
            let some: Result<Vec<Vec<Vec3>>, FitError> = (0..scans.frame_count())
                .step_by(stride)
                .map(|frame| scans.frames_m(frame..frame + 1))
                .collect();
            let some = some?;
            for _ in 0..RIGIDITY_PASSES {
                let frames: Vec<Vec<Vec3>> = some
                    .par_iter()
                    .map(|scan_m| {
                        let estimate = fitter.pose(scan_m, &weights, &first, None);
                        fitter.offsets_rest_m(scan_m, &estimate)
                    })
                    .collect();
                weights = rigidity::from_offsets(&frames, body.vertex_count());
                first = fitter.first(&first_m, &weights, options.shape)?;
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

    /// Rigidity weight of each vertex, 0 to 1.
    pub fn rigidity(&self) -> &[f64] {
        &self.weights
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
        let mut before: Option<Pose> = None;
        scans_m
            .chunks_exact(self.scans.vertex_count)
            .map(|scan_m| {
                let estimate = fitter.pose(scan_m, &self.weights, &self.first, before.as_ref());
                let problem = fitter.problem(scan_m, &self.weights);
                let fitted = FittedFrame {
                    offsets_rest_m: fitter.offsets_rest_m(scan_m, &estimate),
                    rigid_distance_m: problem.distance_m(&estimate) as f32,
                    pose: estimate.pose,
                };
                before = Some(fitted.pose.clone());
                done();
                fitted
            })
            .collect()
    }
}

impl<'a> Fitter<'a> {
    fn problem<'b>(&'b self, scan_m: &'b [Vec3], weights: &'b [f64]) -> Problem<'b> {
        Problem {
            body: self.body,
            objective: self.objective,
            scan_m,
            weights,
            moving: &self.moving,
            fit_shape: false,
            robust_m: NARROW_M,
        }
    }

    /// Solves with the wide, then with the narrow loss.
    fn solved(&self, problem: &Problem<'_>, start: Estimate, wide_steps: usize) -> Estimate {
        let wide = Problem {
            robust_m: WIDE_M,
            ..*problem
        };
        solve(problem, solve(&wide, start, wide_steps), NARROW_STEPS)
    }

    /// The first frame: pose and, unless it is known, shape.
    fn first(
        &self,
        scan_m: &[Vec3],
        weights: &[f64],
        known: Option<[f32; SHAPE_COUNT]>,
    ) -> Result<Estimate, FitError> {
        let shape = known.unwrap_or_default();
        if !shape.iter().all(|beta| beta.abs() <= 10.0) {
            return Err(FitError::Parameter {
                name: "the shape",
                got: format!("{shape:?}"),
                expected: "coefficients between -10 and 10 standard deviations",
            });
        }
        let mut estimate = Estimate::new(self.body, Pose::REST, shape.map(f64::from));
        estimate.pose = pose_by_parts(&estimate.shaped, scan_m, weights, &self.parts);
        let mut problem = self.problem(scan_m, weights);
        estimate = self.solved(&problem, estimate, WIDE_STEPS);
        // Chest and belly tell most of some coefficients: soft skin counts more here than for poses.
        let shape_weights: Vec<f64> = weights.iter().map(|weight| weight.sqrt()).collect();
        if known.is_none() {
            problem.fit_shape = true;
            problem.weights = &shape_weights;
            estimate = self.solved(&problem, estimate, WIDE_STEPS);
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

    /// A frame of the shape of `first`, from the pose `before` it or by parts: whichever is nearer.
    fn pose(
        &self,
        scan_m: &[Vec3],
        weights: &[f64],
        first: &Estimate,
        before: Option<&Pose>,
    ) -> Estimate {
        let problem = self.problem(scan_m, weights);
        let with_pose = |pose| Estimate {
            pose,
            ..first.clone()
        };
        let by_parts = pose_by_parts(&first.shaped, scan_m, weights, &self.parts);
        let far = with_pose(by_parts);
        if let Some(before) = before {
            let near = with_pose(before.clone());
            if problem.cost(&near) < problem.cost(&far) {
                return self.solved(&problem, near, NEAR_STEPS);
            }
        }
        self.solved(&problem, far, WIDE_STEPS)
    }

    /// DSNet Eq. 5: the unposed scan minus template, shape and pose correctives.
    fn offsets_rest_m(&self, scan_m: &[Vec3], estimate: &Estimate) -> Vec<Vec3> {
        let matrices = SkinMatrices::new(&estimate.pose, &estimate.shaped.joints_m);
        let mut offsets_m = vec![Vec3::ZERO; scan_m.len()];
        unpose_linear(scan_m, &self.body.skin, &matrices, &mut offsets_m);
        for (offset, rest) in offsets_m.iter_mut().zip(estimate.rest_m(self.body)) {
            *offset -= rest;
        }
        offsets_m
    }
}
