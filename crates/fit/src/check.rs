//! Fitting sequences whose truth is known: what the fit gets wrong, and by how much.

use std::path::Path;

use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT, SkinMatrices, skin_dual_quaternion, skin_linear,
};
use dynaskin_motion::{Clip, UpAxis};
use dynaskin_sim::{ClipData, ClipLabels, Materials, Shell, SimSettings, simulate_clip};
use glam::Vec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use crate::{
    FitError, FitOptions, FittedSequence, Objective, Rigidity, ScanOptions, ScanUnit, Scans,
    fit_sequence,
};

/// How far the joints of [`Case::OtherJoints`] lie from where the model has them, in metres.
const JOINT_SHIFT_M: f32 = 0.01;
/// Standard deviation of the noise of [`Case::Noise`] along each axis, in metres.
const NOISE_M: f32 = 0.001;

/// A kind of sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// Plain skinning: no soft tissue moves.
    Static,
    /// With simulated soft tissue.
    Dynamic,
    /// With simulated soft tissue and 1 mm of Gaussian noise along each axis of every vertex.
    Noise,
    /// With simulated soft tissue, posed about joints 1 cm from the model's: real bodies' joints
    /// are not exactly where β puts them (the case of Casas & Otaduy's Figure 3).
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
            Self::OtherJoints => "dynamics, joints 1 cm off",
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
    /// Angle between fitted and true local rotation over all joints and frames: median, in degrees.
    pub angle_median_degrees: f64,
    /// The same: 95th percentile.
    pub angle_p95_degrees: f64,
    /// Mean distance of the root in millimetres.
    pub translation_mm: f64,
    /// RMS error of β in standard deviations.
    pub shape_rms: f64,
    /// Mean error of Δ over all vertices and frames, in millimetres.
    pub offset_mm: f64,
    /// Mean error of Δ over the soft vertices, in millimetres.
    pub soft_offset_mm: f64,
    /// 99.9th percentile of the error of Δ over all vertices and frames, in millimetres: "unrealistic
    /// deformations" show here.
    pub offset_p999_mm: f64,
    /// Mean size of the true Δ over the soft vertices, in millimetres.
    pub true_soft_offset_mm: f64,
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
        let scans = scans(body, motion, &offsets, options, case)?;
        for &objective in &options.objectives {
            let fit_options = FitOptions {
                objective,
                rigidity: options.rigidity.clone(),
                shape: None,
                own_surface: false,
            };
            let fitted = fit_sequence(body, &scans, &fit_options, |frames| {
                done(case, objective, frames);
            })?;
            let truth = Truth {
                motion,
                shape: &options.shape,
                offsets: &offsets,
                soft: &simulated.vertices,
            };
            reports.push(truth.report(case, objective, fitted));
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

fn scans<'b>(
    body: &'b BodyModel,
    motion: &Clip,
    offsets: &[Vec<Vec3>],
    options: &CheckOptions,
    case: Case,
) -> Result<Scans<'b>, FitError> {
    let mut random = Pcg64Mcg::seed_from_u64(options.seed);
    let mut shaped = body.shaped(&options.shape);
    if case == Case::OtherJoints {
        for joint in Joint::ALL {
            let direction = Vec3::from_array(std::array::from_fn(|_| normal(&mut random)));
            shaped.joints_m[joint as usize] += JOINT_SHIFT_M * direction.normalize_or_zero();
        }
    }
    let mut positions = Vec::with_capacity(offsets.len() * body.vertex_count());
    let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
    for (pose, offsets) in motion.frames.iter().zip(offsets) {
        let mut rest_m = shaped.positions_m.clone();
        body.add_pose_correctives(pose, &mut rest_m);
        for (rest, offset) in rest_m.iter_mut().zip(offsets) {
            *rest += *offset;
        }
        let matrices = SkinMatrices::new(pose, &shaped.joints_m);
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
    motion: &'a Clip,
    shape: &'a [f32; SHAPE_COUNT],
    offsets: &'a [Vec<Vec3>],
    soft: &'a [u32],
}

impl Truth<'_> {
    fn report(&self, case: Case, objective: Objective, fitted: FittedSequence) -> CaseReport {
        let mut angles = Vec::new();
        let mut translation_m = 0.0;
        let mut errors_mm = Vec::new();
        let (mut soft_mm, mut true_soft_mm) = (0.0, 0.0);
        let frames = fitted.frames.iter().zip(&self.motion.frames);
        for ((fit, pose), offsets) in frames.zip(self.offsets) {
            for joint in 0..JOINT_COUNT {
                let (a, b) = (
                    fit.pose.parent_from_joint[joint],
                    pose.parent_from_joint[joint],
                );
                angles.push(a.angle_between(b).to_degrees());
            }
            let (a, b) = (fit.pose.root_translation_m, pose.root_translation_m);
            translation_m += a.distance(b);
            let error_mm = |vertex: usize| {
                1e3 * f64::from(fit.offsets_rest_m[vertex].distance(offsets[vertex]))
            };
            errors_mm.extend((0..offsets.len()).map(error_mm));
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
        errors_mm.sort_by(f64::total_cmp);
        CaseReport {
            case,
            objective,
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

/// The value below which a fraction of sorted values lies.
fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted
        .get((fraction * last).round() as usize)
        .copied()
        .unwrap_or_default()
}
