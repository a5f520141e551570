//! `dynaskin simulate`: soft-tissue clips for training.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use dynaskin_sim::{
    Job, JobReport, Motion, Outcome, Run, Shell, SimSettings, Solver, TRAINING_SHAPES, captures,
    execute, procedurals,
};
use indicatif::{HumanBytes, ProgressBar, ProgressStyle};
use sha2::{Digest as _, Sha256};

use super::say;

/// Arguments of `dynaskin simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Body model, a GLB built by `dynaskin body build`.
    #[arg(long)]
    body: PathBuf,
    /// Folder of motion captures (BVH).
    #[arg(long)]
    mocap: Option<PathBuf>,
    /// Also simulate the motions made by formula.
    #[arg(long)]
    procedural: bool,
    /// Folder to write one file per clip into; finished clips there are kept.
    #[arg(long)]
    out: PathBuf,
    /// Seed that body shapes are drawn with.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips simulated at the same time; 0 takes one per processor.
    #[arg(long, default_value_t = 0)]
    jobs: usize,
    /// Training shapes to draw from.
    #[arg(long, default_value_t = TRAINING_SHAPES.len(),
        value_parser = clap::builder::RangedU64ValueParser::<usize>::new()
            .range(1..=TRAINING_SHAPES.len() as u64))]
    shapes: usize,
    /// At most this many frames of each motion.
    #[arg(long, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    limit_frames: Option<usize>,
    /// Do not simulate mirrored motions: training learns from mirror images of all clips anyway.
    #[arg(long)]
    no_mirror: bool,
    /// Only clips whose name contains one of these words (several separated by commas).
    #[arg(long, value_delimiter = ',')]
    filter: Vec<String>,
    /// Simulator settings as JSON, all of them; `--plan` prints the usual ones.
    #[arg(long)]
    settings: Option<PathBuf>,
    /// Only print what would be simulated, how many frames and how much disk they need.
    #[arg(long)]
    plan: bool,
}

/// Runs the command.
pub fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    let bytes = fs::read(&args.body)
        .with_context(|| format!("cannot read the body {}", args.body.display()))?;
    let body = BodyModel::from_glb(&bytes)
        .with_context(|| format!("cannot use the body {}", args.body.display()))?;
    let body_sha256 = hex(&Sha256::digest(&bytes));
    let run = Run {
        body: &body,
        body_sha256: &body_sha256,
        settings: settings(args, &body)?,
        seed: args.seed,
        out: args.out.clone(),
        limit_frames: args.limit_frames,
        mirrored: !args.no_mirror,
        shapes: args.shapes,
    };
    let shell = Shell::for_body(&body, &Run::shape(0), &run.settings)?;
    let mut jobs = run.plan(&motions(args)?)?;
    jobs.retain(|job| {
        let name = job.name();
        args.filter.is_empty() || args.filter.iter().any(|word| name.contains(word))
    });
    if jobs.is_empty() {
        bail!("no clip is left after --filter {}", args.filter.join(","));
    }
    print_plan(args, &jobs, &shell, &run.settings);
    if args.plan {
        say(&format!(
            "settings: {}",
            serde_json::to_string(&run.settings)?
        ));
        for job in &jobs {
            say(&format!("  {} {} frames", job.name(), job.frames));
        }
        return Ok(());
    }
    let start = Instant::now();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs)
        .build()?;
    let bar = progress_bar(&jobs);
    let reports = pool.install(|| {
        execute(&run, &jobs, |report| {
            if let Outcome::Failed(error) = &report.outcome {
                bar.println(format!("failed: {}: {error}", report.name));
            }
            bar.set_message(report.name.clone());
            bar.inc(report.frames as u64);
        })
    })?;
    bar.finish_and_clear();
    summarise(&reports, run.settings.substeps, start.elapsed())
}

fn settings(args: &SimulateArgs, body: &BodyModel) -> anyhow::Result<SimSettings> {
    let Some(path) = &args.settings else {
        return Ok(SimSettings::for_body(body));
    };
    let text = fs::read_to_string(path)
        .with_context(|| format!("cannot read the settings {}", path.display()))?;
    let settings: SimSettings = serde_json::from_str(&text)
        .with_context(|| format!("{} holds no simulator settings", path.display()))?;
    settings
        .check()
        .with_context(|| format!("{} cannot be used", path.display()))?;
    Ok(settings)
}

fn motions(args: &SimulateArgs) -> anyhow::Result<Vec<Motion>> {
    let mut motions = match &args.mocap {
        Some(folder) => captures(folder).context("no motion captures (--mocap)")?,
        None => Vec::new(),
    };
    if args.procedural {
        motions.extend(procedurals());
    }
    if motions.is_empty() {
        bail!("nothing to simulate: give --mocap FOLDER, --procedural or both");
    }
    Ok(motions)
}

fn print_plan(args: &SimulateArgs, jobs: &[Job], shell: &Shell, settings: &SimSettings) {
    let frames: usize = jobs.iter().map(|job| job.frames).sum();
    let tissue = shell.report();
    // Offsets in half precision, poses in double precision.
    let disk = jobs
        .iter()
        .map(|job| job.frames as u64 * (tissue.vertices as u64 * 6 + 99 * 8) + 8192)
        .sum();
    say(&format!(
        "{}: {} soft vertices, {} tetrahedra ({} left out), {:.1} kg of tissue and {:.0} g \
         more for stability, depth {:.0} to {:.0} mm",
        args.body.display(),
        tissue.vertices,
        tissue.tets,
        tissue.dropped_tets,
        tissue.mass_kg,
        Solver::new(shell, settings).added_mass_kg() * 1e3,
        tissue.depth_m[0] * 1e3,
        tissue.depth_m[2] * 1e3,
    ));
    say(&format!(
        "{} clips, {frames} frames ({:.1} minutes of motion), {} on disk in {}",
        jobs.len(),
        frames as f64 / 3600.0,
        HumanBytes(disk),
        args.out.display()
    ));
}

fn progress_bar(jobs: &[Job]) -> ProgressBar {
    let frames = jobs.iter().map(|job| job.frames as u64).sum();
    let bar = ProgressBar::new(frames);
    let template = "{bar:30} {pos}/{len} frames, {per_sec}, {eta} left, {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

fn summarise(reports: &[JobReport], usual_substeps: u32, elapsed: Duration) -> anyhow::Result<()> {
    let (mut written, mut kept, mut retried) = (0, 0, 0);
    let mut frames = 0;
    let mut failed = Vec::new();
    let mut largest: [(f32, &str); REGION_COUNT] = [(0.0, ""); REGION_COUNT];
    for report in reports {
        match &report.outcome {
            Outcome::Kept => kept += 1,
            Outcome::Failed(error) => failed.push(format!("{}: {error}", report.name)),
            Outcome::Written {
                substeps,
                largest_m,
            } => {
                written += 1;
                frames += report.frames;
                retried += usize::from(*substeps > usual_substeps);
                for (most, got) in largest.iter_mut().zip(largest_m) {
                    if *got > most.0 {
                        *most = (*got, &report.name);
                    }
                }
            }
        }
    }
    let seconds = elapsed.as_secs_f64();
    let mut text = format!(
        "{written} clips written ({frames} frames in {seconds:.0} s, {:.1} a second), {kept} kept, \
         {retried} needed smaller time steps, {} failed\n",
        frames as f64 / seconds.max(1e-3),
        failed.len()
    );
    if written > 0 {
        text.push_str("largest offset:\n");
        for (region, (metres, clip)) in Region::ALL.iter().zip(largest) {
            let _ = writeln!(
                text,
                "  {:<11} {:6.1} mm  {clip}",
                region.name(),
                metres * 1e3
            );
        }
    }
    say(text.trim_end());
    if !failed.is_empty() {
        bail!("{} clips failed:\n  {}", failed.len(), failed.join("\n  "));
    }
    Ok(())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
