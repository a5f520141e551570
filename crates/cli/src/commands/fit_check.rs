//! `dynaskin fit-check`: how far fits are from a truth that is known, because it was simulated.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_body::{JOINT_COUNT, Joint, Pose, SHAPE_COUNT};
use dynaskin_fit::{Case, CaseReport, CheckOptions, Joints, Objective, check_fit};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_npz::Writer;
use dynaskin_sim::{Run, captures};
use glam::{DQuat, Vec3};

use super::fit::{JointPlaces, Weights, progress_bar, read_body};
use super::motion_files::MotionFileArgs;
use super::say;

const EXAMPLES: &str = "\
Examples:
  dynaskin fit-check --body models/female/body.glb
  dynaskin fit-check --body models/female/body.glb --mocap captures --clip 02_01 --case noise --frames 60";

/// Arguments of `dynaskin fit-check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FitCheckArgs {
    /// Body model, a GLB built by `dynaskin body build`.
    #[arg(long)]
    body: PathBuf,
    /// Folder of motion captures [default: procedural hops].
    #[arg(long)]
    mocap: Option<PathBuf>,
    /// Name of the capture in that folder.
    #[arg(long, requires = "mocap")]
    clip: Option<String>,
    #[command(flatten)]
    files: MotionFileArgs,
    /// Index of the true shape among the simulator's training and held-out shapes.
    #[arg(long, default_value_t = 1)]
    shape: usize,
    /// Number of frames.
    #[arg(long, default_value_t = 120, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..=6_000))]
    frames: usize,
    /// Where rigidity weights come from.
    #[arg(long, value_enum, default_value_t = Weights::Body)]
    rigidity: Weights,
    /// Where the fit takes the joints to be; without it both.
    #[arg(long, value_enum)]
    joints: Option<JointPlaces>,
    /// How far joints lie beside the model's where they do, in millimetres.
    #[arg(long, default_value_t = 10.0, value_parser = millimetres)]
    joints_off_mm: f32,
    /// Also swing elbows and knees, and half as far shoulders, by up to so many degrees, twice a second.
    #[arg(long, default_value_t = 0.0, value_parser = degrees)]
    bend_degrees: f64,
    /// Seed of noise and shifted joints.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only one case.
    #[arg(long, value_enum)]
    case: Option<CaseName>,
    /// Also write the rest surface, each fit's offsets and the true ones into an .npz file, for
    /// inspection.
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CaseName {
    Static,
    Dynamic,
    Noise,
    OtherJoints,
    OtherSkinning,
}

fn millimetres(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err("expected millimetres, 0 to 100".to_owned()),
    }
}

fn degrees(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=170.0).contains(&value) => Ok(value),
        _ => Err("expected degrees, 0 to 170".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &FitCheckArgs) -> anyhow::Result<()> {
    let (body, _) = read_body(&args.body)?;
    let shape: [f32; SHAPE_COUNT] = Run::shape(args.shape);
    let motion = motion(args, &body.shaped(&shape).joints_m)?;
    let options = CheckOptions {
        shape,
        cases: match args.case {
            None => Case::ALL.to_vec(),
            Some(CaseName::Static) => vec![Case::Static],
            Some(CaseName::Dynamic) => vec![Case::Dynamic],
            Some(CaseName::Noise) => vec![Case::Noise],
            Some(CaseName::OtherJoints) => vec![Case::OtherJoints],
            Some(CaseName::OtherSkinning) => vec![Case::OtherSkinning],
        },
        objectives: vec![Objective::Unposed, Objective::Posed],
        joints: match args.joints {
            None => vec![Joints::Body, Joints::Fitted],
            Some(joints) => vec![joints.into()],
        },
        joint_shift_m: 1e-3 * args.joints_off_mm,
        rigidity: args.rigidity.into(),
        seed: args.seed,
    };
    let fits = options.cases.len() * options.objectives.len() * options.joints.len();
    let frames = motion.frames.len() * fits;
    let bar = progress_bar(frames as u64);
    let reports = check_fit(&body, &motion, &options, |case, objective, _| {
        bar.set_message(format!("{}, {}", case.name(), name(objective)));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    say(&format!(
        "{}, {} frames on shape {}:",
        motion.name,
        motion.frames.len(),
        args.shape
    ));
    say(&table(&reports, args.joints_off_mm));
    if let Some(joints) = joint_table(&reports) {
        say(&joints);
    }
    if let Some(path) = &args.out {
        let rest_m = body.shaped(&shape).positions_m;
        write(path, &rest_m, &reports)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn motion(args: &FitCheckArgs, joints_rest_m: &[Vec3; JOINT_COUNT]) -> anyhow::Result<Clip> {
    let mut clip = match (&args.mocap, &args.clip) {
        (None, _) => Procedural::new(ProceduralKind::Hop).clip(joints_rest_m)?,
        (Some(folder), Some(wanted)) => {
            let motions = captures(folder, &args.files.options()?)?;
            let Some(motion) = motions.iter().find(|motion| motion.name() == wanted) else {
                bail!("{} holds no motion named {wanted}", folder.display());
            };
            let (clip, notes) = motion.clip_and_notes(joints_rest_m)?;
            for note in notes {
                say(&format!("{wanted}: {note}"));
            }
            clip
        }
        (Some(_), None) => bail!("--mocap needs the name of a capture: --clip NAME"),
    };
    clip.frames.truncate(args.frames);
    let rate_hz = clip.rate_hz;
    for (frame, pose) in clip.frames.iter_mut().enumerate() {
        bend(pose, frame as f64 / rate_hz, args.bend_degrees);
    }
    Ok(clip)
}

/// Bends a pose as far as a swing that begins at rest is at a time in seconds.
fn bend(pose: &mut Pose, seconds: f64, most_degrees: f64) {
    let far =
        most_degrees.to_radians() * 0.5 * (1.0 - (4.0 * std::f64::consts::PI * seconds).cos());
    let turns = [
        (Joint::LeftKnee, DQuat::from_rotation_x(far)),
        (Joint::RightKnee, DQuat::from_rotation_x(far)),
        (Joint::LeftElbow, DQuat::from_rotation_y(-far)),
        (Joint::RightElbow, DQuat::from_rotation_y(far)),
        (Joint::LeftShoulder, DQuat::from_rotation_z(0.5 * far)),
        (Joint::RightShoulder, DQuat::from_rotation_z(-0.5 * far)),
    ];
    for (joint, turn) in turns {
        pose.parent_from_joint[joint as usize] *= turn;
    }
}

fn name(objective: Objective) -> &'static str {
    match objective {
        Objective::Unposed => "unposed",
        Objective::Posed => "posed",
    }
}

fn places(joints: Joints) -> &'static str {
    match joints {
        Joints::Body => "body",
        Joints::Fitted => "fitted",
        Joints::Given(_) => "given",
    }
}

/// A Markdown table.
fn table(reports: &[CaseReport], joints_off_mm: f32) -> String {
    let mut text = "| sequence | joints | objective | angle median, 95 % (°) | spine median, 95 % (°) | \
                    root (mm) | β RMS (sd) | Δ mean (mm) | Δ soft skin (mm) | Δ sheared skin (mm) | \
                    Δ 99.9 % (mm) | true Δ soft skin (mm) |\n\
                    |---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        .to_owned();
    for report in reports {
        let mut case = report.case.name().to_owned();
        if report.case == Case::OtherJoints {
            case = format!("dynamics, joints {joints_off_mm} mm off");
        }
        let sheared = report.sheared_offset_mm;
        text.push_str(&format!(
            "\n| {case} | {} | {} | {:.3}, {:.3} | {:.3}, {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {} | {:.2} | \
             {:.2} |",
            places(report.joints),
            name(report.objective),
            report.angle_median_degrees,
            report.angle_p95_degrees,
            report.spine_median_degrees,
            report.spine_p95_degrees,
            report.translation_mm,
            report.shape_rms,
            report.offset_mm,
            report.soft_offset_mm,
            sheared.map_or("none".to_owned(), |mm| format!("{mm:.2}")),
            report.offset_p999_mm,
            report.true_soft_offset_mm,
        ));
    }
    text
}

/// Which joints the sequence whose joints lie beside the model's determines; none where it was not fitted.
fn joint_table(reports: &[CaseReport]) -> Option<String> {
    let report = reports
        .iter()
        .find(|report| report.case == Case::OtherJoints && report.joints == Joints::Fitted)?;
    let mut text = format!(
        "| joint ({}) | bends by (°, 95 %) | place off after the fit (mm) |\n|---|--:|--:|",
        name(report.objective)
    );
    for joint in Joint::ALL.into_iter().skip(1) {
        let own = joint as usize;
        text.push_str(&format!(
            "\n| {} | {:.1} | {:.1} |",
            joint.name(),
            report.bend_degrees[own],
            report.joint_place_mm[own]
        ));
    }
    Some(text)
}

fn write(path: &Path, rest_m: &[Vec3], reports: &[CaseReport]) -> anyhow::Result<()> {
    let mut writer = Writer::create(path)?;
    let rest: Vec<f32> = rest_m.iter().flat_map(|rest| rest.to_array()).collect();
    writer.array("rest_m", &[rest_m.len(), 3], &rest)?;
    for report in reports {
        let (objective, joints) = (name(report.objective), places(report.joints));
        let key = format!("{:?}_{objective}_{joints}", report.case).to_lowercase();
        let frames = report.fitted.frames.len();
        let vertices = report.fitted.rigidity.len();
        let fitted = report
            .fitted
            .frames
            .iter()
            .map(|frame| &frame.offsets_rest_m);
        let flat = |frames: Vec<&Vec<Vec3>>| -> Vec<f32> {
            let offsets = frames.into_iter().flatten();
            offsets.flat_map(|offset| offset.to_array()).collect()
        };
        let shape = [frames, vertices, 3];
        writer.array(&format!("fitted_{key}"), &shape, &flat(fitted.collect()))?;
        let truth = report.true_offsets_rest_m.iter().collect();
        writer.array(&format!("true_{key}"), &shape, &flat(truth))?;
    }
    writer.finish()?;
    Ok(())
}
