//! Fitting sequences whose truth is known: what the fit gets wrong, and by how much.

use std::path::Path;

use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT, SkinMatrices, skin_dual_quaternion, skin_linear,
};
use dynaskin_motion::{Clip, UpAxis};
use dynaskin_sim::{ClipData, ClipLabels, Materials, Shell, SimSettings, simulate_clip};
use glam::{DQuat, Vec3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use crate::{
    FitError, FitOptions, FittedSequence, Joints, Objective, Rigidity, ScanOptions, ScanUnit,
    Scans, fit_sequence,
};

/// Standard deviation of the noise of [`Case::Noise`] along each axis, in metres.
const NOISE_M: f32 = 0.001;
/// Determinant of a vertex's blended skinning matrix below which its skin counts as sheared: it shrinks
/// space by a fifth, and no rotation is near.
const SHEARED: f32 = 0.8;
/// The joints of [`CaseReport::spine_median_degrees`].
const SPINE: [Joint; 3] = [Joint::Spine1, Joint::Spine2, Joint::Spine3];

/// A kind of sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// Plain skinning: no soft tissue moves.
    Static,
    /// With simulated soft tissue.
    Dynamic,
    /// With simulated soft tissue and 1 mm of Gaussian noise along each axis of every vertex.
    Noise,
    /// With simulated soft tissue, posed about joints beside the model's ([`CheckOptions::joint_shift_m`]):
    /// real bodies' joints are not exactly where β puts them (the case of Casas & Otaduy's Figure 3).
    OtherJoints,
    /// With simulated soft tissue, posed by dual quaternions: real skin does not bend as the model
    /// does.
    OtherSkinning,
}

impl Case {
    /// All cases.
    pub const ALL: [Self; 5] = [
        Self::Static,
        Self::Dynamic,
        Self::Noise,
        Self::OtherJoints,
        Self::OtherSkinning,
    ];

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamics",
            Self::Noise => "dynamics, 1 mm noise",
            Self::OtherJoints => "dynamics, joints off",
            Self::OtherSkinning => "dynamics, dual quaternions",
        }
    }
}

/// Options of [`check_fit`].
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// True shape of the body.
    pub shape: [f32; SHAPE_COUNT],
    /// Cases, in the report's order.
    pub cases: Vec<Case>,
    /// Objectives, in the report's order.
    pub objectives: Vec<Objective>,
    /// Where the fit takes the joints to be, in the report's order.
    pub joints: Vec<Joints>,
    /// How far the joints of [`Case::OtherJoints`] lie from where the model has them, in metres, each in a
    /// direction of its own.
    pub joint_shift_m: f32,
    /// Where the rigidity weights come from.
    pub rigidity: Rigidity,
    /// Seed of the noise and of shifted joints.
    pub seed: u64,
}

/// Errors of the fit of one case.
#[derive(Clone, Debug)]
pub struct CaseReport {
    /// The case.
    pub case: Case,
    /// The objective.
    pub objective: Objective,
    /// Where the fit took the joints to be.
    pub joints: Joints,
    /// Angle between fitted and true local rotation over all joints and frames: median, in degrees.
    pub angle_median_degrees: f64,
    /// The same: 95th percentile.
    pub angle_p95_degrees: f64,
    /// The same over the three spine joints: median, in degrees.
    pub spine_median_degrees: f64,
    /// The same over the three spine joints: 95th percentile.
    pub spine_p95_degrees: f64,
    /// Mean distance of the root in millimetres.
    pub translation_mm: f64,
    /// RMS error of β in standard deviations.
    pub shape_rms: f64,
    /// Mean error of Δ over all vertices and frames, in millimetres.
    pub offset_mm: f64,
    /// Mean error of Δ over the soft vertices, in millimetres.
    pub soft_offset_mm: f64,
    /// Mean error of Δ where the blended skinning matrix shrinks space by more than a fifth, in millimetres;
    /// none where none does.
    pub sheared_offset_mm: Option<f64>,
    /// 99.9th percentile of the error of Δ over all vertices and frames, in millimetres: "unrealistic
    /// deformations" show here.
    pub offset_p999_mm: f64,
    /// Mean size of the true Δ over the soft vertices, in millimetres.
    pub true_soft_offset_mm: f64,
    /// How far each joint bends from its mean: 95th percentile over the frames, in degrees, `[joint]`.
    pub bend_degrees: [f64; JOINT_COUNT],
    /// Distance of each joint's rest place from the truth, in millimetres, `[joint]`; 0 for the pelvis, whose
    /// place means nothing, because the root's translation makes up for it.
    pub joint_place_mm: [f64; JOINT_COUNT],
    /// The fit itself.
    pub fitted: FittedSequence,
    /// The true offsets `[frame][vertex]` in metres.
    pub true_offsets_rest_m: Vec<Vec<Vec3>>,
}

/// Simulates `motion` (60 Hz) on `body`, poses the result as each case says, fits it with each
/// objective and measures. `done` is called with case, objective and the number of frames done.
///
/// # Errors
/// [`FitError`] from simulating or fitting.
pub fn check_fit(
    body: &BodyModel,
    motion: &Clip,
    options: &CheckOptions,
    done: impl Fn(Case, Objective, usize) + Sync,
) -> Result<Vec<CaseReport>, FitError> {
    let settings = SimSettings::for_body(body);
    let shell = Shell::for_body(body, &options.shape, &settings)?;
    let labels = ClipLabels {
        name: motion.name.clone(),
        body_sha256: String::new(),
        seed: options.seed,
        shape: options.shape,
        materials: Materials::NOMINAL,
        sim_json: "{}".to_owned(),
    };
    let simulated = simulate_clip(&shell, motion, &settings, labels)?.data;
    let mut reports = Vec::new();
    for &case in &options.cases {
        let offsets = true_offsets(body, &simulated, case);
        let joints_m = true_joints_m(body, options, case);
        let scans = scans(body, motion, &offsets, &joints_m, options, case)?;
        let fits = (options.joints.iter())
            .flat_map(|joints| options.objectives.iter().map(move |each| (joints, *each)));
        for (&joints, objective) in fits {
            let fit_options = FitOptions {
                objective,
                rigidity: options.rigidity.clone(),
                shape: None,
                own_surface: false,
                joints,
            };
            let fitted = fit_sequence(body, &scans, &fit_options, |frames| {
                done(case, objective, frames);
            })?;
            let truth = Truth {
                body,
                motion,
                shape: &options.shape,
                joints_m: &joints_m,
                offsets: &offsets,
                soft: &simulated.vertices,
            };
            reports.push(truth.report(case, (objective, joints), fitted));
        }
    }
    Ok(reports)
}

fn true_offsets(body: &BodyModel, simulated: &ClipData, case: Case) -> Vec<Vec<Vec3>> {
    (0..simulated.frame_count())
        .map(|frame| {
            let mut offsets = vec![Vec3::ZERO; body.vertex_count()];
            if case != Case::Static {
                for (slot, &vertex) in simulated.vertices.iter().enumerate() {
                    offsets[vertex as usize] = simulated.offset_rest_m(frame, slot);
                }
            }
            offsets
        })
        .collect()
}

/// Where the joints of a case lie in the rest pose, in metres.
fn true_joints_m(body: &BodyModel, options: &CheckOptions, case: Case) -> [Vec3; JOINT_COUNT] {
    let mut random = Pcg64Mcg::seed_from_u64(options.seed);
    let mut joints_m = body.shaped(&options.shape).joints_m;
    if case == Case::OtherJoints {
        for joint_m in &mut joints_m {
            let direction = Vec3::from_array(std::array::from_fn(|_| normal(&mut random)));
            *joint_m += options.joint_shift_m * direction.normalize_or_zero();
        }
    }
    joints_m
}

fn scans<'b>(
    body: &'b BodyModel,
    motion: &Clip,
    offsets: &[Vec<Vec3>],
    joints_m: &[Vec3; JOINT_COUNT],
    options: &CheckOptions,
    case: Case,
) -> Result<Scans<'b>, FitError> {
    let mut random = Pcg64Mcg::seed_from_u64(options.seed);
    let shaped = body.shaped(&options.shape);
    let mut positions = Vec::with_capacity(offsets.len() * body.vertex_count());
    let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
    for (pose, offsets) in motion.frames.iter().zip(offsets) {
        let mut rest_m = shaped.positions_m.clone();
        body.add_pose_correctives(pose, &mut rest_m);
        for (rest, offset) in rest_m.iter_mut().zip(offsets) {
            *rest += *offset;
        }
        let matrices = SkinMatrices::new(pose, joints_m);
        if case == Case::OtherSkinning {
            skin_dual_quaternion(&rest_m, &body.skin, &matrices, &mut world_m);
        } else {
            skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
        }
        if case == Case::Noise {
            for position in &mut world_m {
                let noise = std::array::from_fn(|_| NOISE_M * normal(&mut random));
                *position += Vec3::from_array(noise);
            }
        }
        positions.extend_from_slice(&world_m);
    }
    let scan_options = ScanOptions {
        unit: Some(ScanUnit::Metre),
        up: Some(UpAxis::Y),
        rate_hz: motion.rate_hz,
        key: String::new(),
        sequence: None,
    };
    Scans::new(Path::new(case.name()), body, positions, &scan_options)
}

/// A number of the standard normal distribution (Box & Muller 1958).
fn normal(random: &mut Pcg64Mcg) -> f32 {
    let (a, b): (f64, f64) = (random.random(), random.random());
    let radius = (-2.0 * (1.0 - a).ln()).sqrt();
    (radius * (std::f64::consts::TAU * b).cos()) as f32
}

/// What is known of a sequence.
struct Truth<'a> {
    body: &'a BodyModel,
    motion: &'a Clip,
    shape: &'a [f32; SHAPE_COUNT],
    joints_m: &'a [Vec3; JOINT_COUNT],
    offsets: &'a [Vec<Vec3>],
    soft: &'a [u32],
}

impl Truth<'_> {
    fn report(
        &self,
        case: Case,
        (objective, joints): (Objective, Joints),
        fitted: FittedSequence,
    ) -> CaseReport {
        let mut angles = Vec::new();
        let mut spine_angles = Vec::new();
        let (mut sheared_mm, mut sheared_count) = (0.0, 0.0);
        let mut translation_m = 0.0;
        let mut errors_mm = Vec::new();
        let (mut soft_mm, mut true_soft_mm) = (0.0, 0.0);
        let frames = fitted.frames.iter().zip(&self.motion.frames);
        for ((fit, pose), offsets) in frames.zip(self.offsets) {
            for joint in Joint::ALL {
                let (a, b) = (
                    fit.pose.parent_from_joint[joint as usize],
                    pose.parent_from_joint[joint as usize],
                );
                let degrees = a.angle_between(b).to_degrees();
                angles.push(degrees);
                if SPINE.contains(&joint) {
                    spine_angles.push(degrees);
                }
            }
            let (a, b) = (fit.pose.root_translation_m, pose.root_translation_m);
            translation_m += a.distance(b);
            let error_mm = |vertex: usize| {
                1e3 * f64::from(fit.offsets_rest_m[vertex].distance(offsets[vertex]))
            };
            errors_mm.extend((0..offsets.len()).map(error_mm));
            let matrices = SkinMatrices::new(pose, self.joints_m);
            for (vertex, skin) in self.body.skin.iter().enumerate() {
                if matrices.blended(skin).matrix3.determinant() < SHEARED {
                    sheared_mm += error_mm(vertex);
                    sheared_count += 1.0;
                }
            }
            for &vertex in self.soft {
                soft_mm += error_mm(vertex as usize);
                true_soft_mm += 1e3 * f64::from(offsets[vertex as usize].length());
            }
        }
        let count = fitted.frames.len() as f64;
        let soft_count = count * self.soft.len() as f64;
        let shape_errors = fitted.shape.iter().zip(self.shape);
        let shape_square: f64 = shape_errors
            .map(|(a, b)| f64::from(a - b).powi(2))
            .sum::<f64>()
            / SHAPE_COUNT as f64;
        angles.sort_by(f64::total_cmp);
        spine_angles.sort_by(f64::total_cmp);
        errors_mm.sort_by(f64::total_cmp);
        CaseReport {
            case,
            objective,
            joints,
            spine_median_degrees: quantile(&spine_angles, 0.5),
            spine_p95_degrees: quantile(&spine_angles, 0.95),
            sheared_offset_mm: (sheared_count > 0.0).then(|| sheared_mm / sheared_count),
            bend_degrees: std::array::from_fn(|joint| self.bend_degrees(joint)),
            joint_place_mm: self.joint_place_mm(&fitted),
            angle_median_degrees: quantile(&angles, 0.5),
            angle_p95_degrees: quantile(&angles, 0.95),
            translation_mm: 1e3 * translation_m / count,
            shape_rms: shape_square.sqrt(),
            offset_mm: errors_mm.iter().sum::<f64>() / errors_mm.len() as f64,
            soft_offset_mm: soft_mm / soft_count,
            offset_p999_mm: quantile(&errors_mm, 0.999),
            true_soft_offset_mm: true_soft_mm / soft_count,
            fitted,
            true_offsets_rest_m: self.offsets.to_vec(),
        }
    }
}

impl Truth<'_> {
    fn bend_degrees(&self, joint: usize) -> f64 {
        let turns = || {
            self.motion
                .frames
                .iter()
                .map(|pose| pose.parent_from_joint[joint])
        };
        let Some(first) = turns().next() else {
            return 0.0;
        };
        // A quaternion and its opposite are one rotation.
        let sum: DQuat = turns()
            .map(|turn| if turn.dot(first) < 0.0 { -turn } else { turn })
            .sum();
        let mean = sum.normalize();
        let mut angles: Vec<f64> = turns()
            .map(|turn| turn.angle_between(mean).to_degrees())
            .collect();
        angles.sort_by(f64::total_cmp);
        quantile(&angles, 0.95)
    }

    fn joint_place_mm(&self, fitted: &FittedSequence) -> [f64; JOINT_COUNT] {
        let by_shape_m = self.body.shaped(&fitted.shape).joints_m;
        std::array::from_fn(|joint| {
            if joint == Joint::Pelvis as usize {
                return 0.0;
            }
            let place_m = by_shape_m[joint] + fitted.joint_offsets_m[joint];
            1e3 * f64::from(place_m.distance(self.joints_m[joint]))
        })
    }
}

/// The value below which a fraction of sorted values lies.
fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted
        .get((fraction * last).round() as usize)
        .copied()
        .unwrap_or_default()
}
