//! `dynaskin fit-check`: how far fits are from a truth that is known, because it was simulated.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_body::{JOINT_COUNT, SHAPE_COUNT};
use dynaskin_fit::{Case, CaseReport, CheckOptions, Objective, Rigidity, check_fit};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_npz::Writer;
use dynaskin_sim::{Run, captures};
use glam::Vec3;

use super::fit::{progress_bar, read_body};
use super::motion_files::MotionFileArgs;
use super::say;

/// Arguments of `dynaskin fit-check`.
#[derive(Debug, Args)]
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
    /// Learn rigidity from the scans instead of taking it from the body.
    #[arg(long)]
    rigidity_from_data: bool,
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
        rigidity: if args.rigidity_from_data {
            Rigidity::Data
        } else {
            Rigidity::Body
        },
        seed: args.seed,
    };
    let frames = motion.frames.len() * options.cases.len() * options.objectives.len();
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
    say(&table(&reports));
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
    Ok(clip)
}

fn name(objective: Objective) -> &'static str {
    match objective {
        Objective::Unposed => "unposed",
        Objective::Posed => "posed",
    }
}

/// A Markdown table.
fn table(reports: &[CaseReport]) -> String {
    let mut text =
        "| sequence | objective | angle median, 95 % (°) | root (mm) | β RMS (sd) | Δ mean \
                    (mm) | Δ soft skin (mm) | Δ 99.9 % (mm) | true Δ soft skin (mm) |\n\
                    |---|---|--:|--:|--:|--:|--:|--:|--:|"
            .to_owned();
    for report in reports {
        text.push_str(&format!(
            "\n| {} | {} | {:.3}, {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.2} | {:.2} |",
            report.case.name(),
            name(report.objective),
            report.angle_median_degrees,
            report.angle_p95_degrees,
            report.translation_mm,
            report.shape_rms,
            report.offset_mm,
            report.soft_offset_mm,
            report.offset_p999_mm,
            report.true_soft_offset_mm,
        ));
    }
    text
}

fn write(path: &Path, rest_m: &[Vec3], reports: &[CaseReport]) -> anyhow::Result<()> {
    let mut writer = Writer::create(path)?;
    let rest: Vec<f32> = rest_m.iter().flat_map(|rest| rest.to_array()).collect();
    writer.array("rest_m", &[rest_m.len(), 3], &rest)?;
    for report in reports {
        let key = format!("{:?}_{}", report.case, name(report.objective)).to_lowercase();
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
