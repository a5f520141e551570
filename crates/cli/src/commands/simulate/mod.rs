//! `dynaskin simulate`: soft-tissue clips for training.

mod report;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use dynaskin_sim::{
    ComplianceTable, Job, JobReport, Motion, Outcome, Run, Shell, SimSettings, Solver,
    TRAINING_SHAPES, captures, execute, held_poses, procedurals, thin_captures,
};
use indicatif::{HumanBytes, ProgressBar, ProgressStyle};
use sha2::{Digest as _, Sha256};

use super::motion_files::MotionFileArgs;
use super::shard::Shard;
use super::train::glb_body;
use super::{numbers, say};

/// Shapes whose compliance a whole data set tells.
const COMPLIANCE_SHAPES: usize = 512;

const EXAMPLES: &str = "\
Examples:
  dynaskin simulate --body models/female/body.glb --out data/female --preset full --mocap captures --plan
  dynaskin simulate --body models/female/body.glb --out data/female --preset full --mocap captures
  dynaskin simulate --body models/female/body.glb --procedural --shapes 1 --out data/small";

/// Arguments of `dynaskin simulate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SimulateArgs {
    /// Body model, a GLB built by `dynaskin body build`.
    #[arg(long)]
    body: PathBuf,
    /// Folder of motion captures: BVH, AMASS-like .npz, or animations in .glb or .vrma.
    #[arg(long)]
    mocap: Option<PathBuf>,
    #[command(flatten)]
    files: MotionFileArgs,
    /// Also simulate the procedural motions.
    #[arg(long)]
    procedural: bool,
    /// Folder to write one file per clip into; finished clips there are kept.
    #[arg(long, required_unless_present = "report")]
    out: Option<PathBuf>,
    /// Simulate no clips, but write a page that compares the simulator with measured bodies; with
    /// --mocap also in captured walks and runs, with --out also the extremes of the clips there.
    #[arg(long, value_name = "FILE.html", conflicts_with_all = ["plan", "shard", "preset"])]
    report: Option<PathBuf>,
    /// Seed that body shapes are drawn with.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips simulated at the same time; 0 takes one per processor.
    #[arg(long, default_value_t = 0, value_parser = numbers::jobs)]
    jobs: usize,
    /// Training shapes to draw from.
    #[arg(long, default_value_t = TRAINING_SHAPES.len(),
        value_parser = clap::builder::RangedU64ValueParser::<usize>::new()
            .range(1..=TRAINING_SHAPES.len() as u64))]
    shapes: usize,
    /// At most this many frames of each motion.
    #[arg(long, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    limit_frames: Option<usize>,
    /// Do not simulate mirrored motions: training of our networks ties left and right anyway.
    #[arg(long)]
    no_mirror: bool,
    /// Only clips whose name contains one of these words (several separated by commas).
    #[arg(long, value_delimiter = ',')]
    filter: Vec<String>,
    /// Give every second clip its own materials: stiffness and damping of each region are drawn
    /// between a quarter and four times the usual.
    #[arg(long)]
    vary_materials: bool,
    /// Also simulate every second motion on one of 256 further shapes, drawn over 1.35 times the
    /// range of the training shapes
    #[arg(long)]
    further_shapes: bool,
    /// Play every second capture through another kind of rig: collars that take a share of the
    /// arm's swing, spines with one or two bones
    #[arg(long)]
    vary_rigs: bool,
    /// Also simulate poses that are held and changed slowly, from T- and A-poses to lying down, with
    /// collars that turn
    #[arg(long)]
    held_poses: bool,
    /// Also compute how far the tissue of COUNT shapes moves when gravity turns, into
    /// compliance.json beside the clips: `train` conditions the networks on it. 512 with
    /// `--preset full`; shapes in an existing file are kept.
    #[arg(long, value_name = "COUNT")]
    compliance: Option<usize>,
    /// A whole data set: `full` takes the captures and the procedural motions, mirror images,
    /// slower and faster copies of rare motions, held poses, further shapes, and varied
    /// materials and rigs.
    #[arg(long, value_enum)]
    preset: Option<Preset>,
    /// Simulate only part I of N, for running on several machines: `--shard 2/8`. All parts may
    /// write to one folder.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// File with all simulator settings as JSON; `--plan` prints the default ones.
    #[arg(long)]
    settings: Option<PathBuf>,
    /// Only print the clips that would be simulated, their frames and their size on disk.
    #[arg(long)]
    plan: bool,
}

/// A ready-made choice of motions, shapes and materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// What the models are trained on.
    Full,
}

/// Runs the command.
pub fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    let bytes = fs::read(&args.body)
        .with_context(|| format!("cannot read the body {}", args.body.display()))?;
    let body = glb_body(&args.body, &bytes)?;
    let body_sha256 = hex(&Sha256::digest(&bytes));
    if let Some(path) = &args.report {
        let motions = match &args.mocap {
            Some(folder) => {
                captures(folder, &args.files.options()?).context("no motion captures (--mocap)")?
            }
            None => Vec::new(),
        };
        let settings = settings(args, &body)?;
        pool(args)?
            .install(|| report::write(path, &body, &settings, &motions, args.out.as_deref()))?;
        say(&format!("report written to {}", path.display()));
        return Ok(());
    }
    let out = args.out.clone().context("--out FOLDER is missing")?;
    let run = Run {
        body: &body,
        body_sha256: &body_sha256,
        settings: settings(args, &body)?,
        seed: args.seed,
        out,
        limit_frames: args.limit_frames,
        mirrored: !args.no_mirror,
        vary_materials: args.vary_materials || args.preset == Some(Preset::Full),
        shapes: args.shapes,
        further_shapes: args.further_shapes || args.preset == Some(Preset::Full),
        vary_rigs: args.vary_rigs || args.preset == Some(Preset::Full),
    };
    let shell = Shell::for_body(&body, &Run::shape(0), &run.settings)?;
    if args.compliance.is_some() && args.mocap.is_none() && !args.procedural && !args.held_poses {
        return compliance(args, &run);
    }
    let mut jobs = run.plan(&motions(args)?)?;
    jobs.retain(|job| {
        let name = job.name();
        args.filter.is_empty() || args.filter.iter().any(|word| name.contains(word))
    });
    if jobs.is_empty() {
        bail!("no clip is left after --filter {}", args.filter.join(","));
    }
    if let Some(shard) = args.shard {
        // The jobs are sorted by length.
        shard.every_nth(&mut jobs);
        if jobs.is_empty() {
            say("this part has no clips: there are fewer clips than parts");
            return Ok(());
        }
    }
    print_plan(args, &jobs, &shell, &run);
    print_notes(&jobs);
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
    let bar = progress_bar(&jobs);
    let reports = pool(args)?.install(|| {
        execute(&run, &jobs, |report| {
            if let Outcome::Failed(error) = &report.outcome {
                bar.println(format!("failed: {}: {error}", report.name));
            }
            bar.set_message(report.name.clone());
            bar.inc(report.frames as u64);
        })
    })?;
    bar.finish_and_clear();
    // One part of several is enough to write the table.
    if args.shard.is_none_or(|shard| shard.index == 1) {
        compliance(args, &run)?;
    }
    summarise(&reports, run.settings.substeps, start.elapsed())
}

/// Works out the compliance of as many shapes as wanted.
fn compliance(args: &SimulateArgs, run: &Run<'_>) -> anyhow::Result<()> {
    let usual = (args.preset == Some(Preset::Full)).then_some(COMPLIANCE_SHAPES);
    let Some(count) = args.compliance.or(usual) else {
        return Ok(());
    };
    let bar = ProgressBar::new(count as u64);
    let template = "{bar:30} {pos}/{len} shapes under turned gravity, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    let table = pool(args)?.install(|| {
        ComplianceTable::make(
            run.body,
            run.body_sha256,
            &run.settings,
            &run.out,
            count,
            |done| bar.set_position(done as u64),
        )
    })?;
    bar.finish_and_clear();
    let settled = table.rows.iter().filter(|row| row.metres.is_some());
    say(&format!(
        "compliance of {} shapes in {}, {} without rest",
        table.rows.len(),
        run.out.join(ComplianceTable::FILE_NAME).display(),
        table.rows.len() - settled.count()
    ));
    Ok(())
}

fn pool(args: &SimulateArgs) -> anyhow::Result<rayon::ThreadPool> {
    Ok(rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs)
        .build()?)
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
        Some(folder) => {
            captures(folder, &args.files.options()?).context("no motion captures (--mocap)")?
        }
        None if args.preset == Some(Preset::Full) => {
            bail!("--preset full needs motion captures: give their folder with --mocap FOLDER")
        }
        None => Vec::new(),
    };
    if args.preset == Some(Preset::Full) {
        let copies = thin_captures(&motions);
        motions.extend(copies);
    }
    if args.procedural || args.preset == Some(Preset::Full) {
        motions.extend(procedurals());
    }
    if args.held_poses || args.preset == Some(Preset::Full) {
        motions.extend(held_poses());
    }
    if motions.is_empty() {
        bail!("nothing to simulate: give --mocap FOLDER, --procedural or --held-poses");
    }
    Ok(motions)
}

/// Says of each file what was found other than usual.
fn print_notes(jobs: &[Job]) {
    let notes: BTreeMap<&str, &[String]> = jobs
        .iter()
        .map(|job| (job.motion.name(), &job.notes[..]))
        .collect();
    for (name, notes) in notes {
        for note in notes {
            say(&format!("{name}: {note}"));
        }
    }
}

fn print_plan(args: &SimulateArgs, jobs: &[Job], shell: &Shell, run: &Run<'_>) {
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
        Solver::new(shell, &run.settings).added_mass_kg() * 1e3,
        tissue.depth_m[0] * 1e3,
        tissue.depth_m[2] * 1e3,
    ));
    say(&format!(
        "{} clips, {frames} frames ({:.1} minutes of motion), {} on disk in {}",
        jobs.len(),
        frames as f64 / 3600.0,
        HumanBytes(disk),
        run.out.display()
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
    let (mut written, mut kept, mut retried, mut replaced) = (0, 0, 0, 0);
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
                replaced: has_replaced,
            } => {
                written += 1;
                frames += report.frames;
                retried += usize::from(*substeps > usual_substeps);
                replaced += usize::from(*has_replaced);
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
    if replaced > 0 {
        let _ = writeln!(
            text,
            "{replaced} of those written replaced clips of other settings, lengths or seeds"
        );
    }
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
