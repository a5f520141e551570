//! `dynaskin fit`: mesh sequences of a subject become poses and soft-tissue offsets.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_body::{BodyModel, REGION_COUNT, Region, SHAPE_COUNT};
use dynaskin_fit::{
    FitOptions, FittedSequence, Objective, Rigidity, ScanOptions, ScanUnit, Scans, fit_sequence,
};
use dynaskin_motion::UpAxis;
use dynaskin_train::ClipName;
use indicatif::{ProgressBar, ProgressStyle};
use sha2::{Digest as _, Sha256};

use super::say;

/// Arguments of `dynaskin fit`.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// Body model: a GLB built by `dynaskin body build`, or an SMPL-family .npz of your own.
    #[arg(long)]
    body: PathBuf,
    /// The sequence, registered to the body's mesh: an .npz file with vertices [frames, vertices,
    /// 3], or a folder with one OBJ or PLY file a frame, sorted by name.
    #[arg(long)]
    scans: PathBuf,
    /// Unit of the scans' coordinates.
    #[arg(long, value_enum)]
    unit: Unit,
    /// Axis of the scans' world that points up.
    #[arg(long, value_enum, default_value_t = Up::Y)]
    up: Up,
    /// Frames per second of the scans.
    #[arg(long)]
    rate: f64,
    /// Key of the vertices in an .npz file.
    #[arg(long, default_value = "vertices")]
    key: String,
    /// Where model and scan are compared: in the rest pose, as the papers do, or in the world.
    #[arg(long, value_enum, default_value_t = Compared::Unposed)]
    objective: Compared,
    /// Where rigidity weights come from; without it from the body's soft regions, or from the
    /// scans where the body has none.
    #[arg(long, value_enum)]
    rigidity: Option<Weights>,
    /// The subject's ten shape coefficients, separated by commas, where they are known from another
    /// sequence; without it they are fitted to the first frame.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, num_args = SHAPE_COUNT)]
    shape: Option<Vec<f32>>,
    /// Count offsets from the subject's own surface in the first frame, where it must be at rest,
    /// instead of from the surface that β makes.
    #[arg(long)]
    own_surface: bool,
    /// Where to write the fit: poses, trans, betas as AMASS names them, and offsets (.npz).
    #[arg(long)]
    out: PathBuf,
    /// Also write a clip for `dynaskin train`, named MOTION__SUBJECT.safetensors.
    #[arg(long)]
    clip: Option<PathBuf>,
    /// Replace files that are there.
    #[arg(long)]
    overwrite: bool,
    /// Threads; 0 takes one per processor.
    #[arg(long, default_value_t = 0)]
    jobs: usize,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Unit {
    M,
    Cm,
    Mm,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Up {
    Y,
    Z,
}

/// Where differences are measured, as an argument.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Compared {
    Unposed,
    Posed,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Weights {
    Body,
    Data,
    Uniform,
}

/// Runs the command.
pub fn run(args: &FitArgs) -> anyhow::Result<()> {
    let clip_name = args.clip.as_deref().map(clip_name).transpose()?;
    for path in [Some(&args.out), args.clip.as_ref()].into_iter().flatten() {
        if path.exists() && !args.overwrite {
            bail!(
                "{} is there already; --overwrite replaces it",
                path.display()
            );
        }
    }
    let (body, sha256) = read_body(&args.body)?;
    let scans = Scans::read(
        &args.scans,
        &body,
        &ScanOptions {
            unit: match args.unit {
                Unit::M => ScanUnit::Metre,
                Unit::Cm => ScanUnit::Centimetre,
                Unit::Mm => ScanUnit::Millimetre,
            },
            up: match args.up {
                Up::Y => UpAxis::Y,
                Up::Z => UpAxis::Z,
            },
            rate_hz: args.rate,
            key: args.key.clone(),
        },
    )?;
    let options = options(args, &body)?;
    let bar = progress_bar(scans.frame_count() as u64);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs)
        .build()?;
    let fitted = pool.install(|| {
        fit_sequence(&body, &scans, &options, |frames| {
            bar.set_position(frames as u64);
        })
    })?;
    bar.finish_and_clear();
    fitted.write_npz(&args.out)?;
    if let (Some(path), Some(name)) = (&args.clip, &clip_name) {
        fitted.clip_data(&body, &sha256, name)?.write(path)?;
    }
    summarise(&body, &fitted, args);
    Ok(())
}

/// A body from a GLB or `.npz` file, and the file's SHA-256.
pub(super) fn read_body(path: &Path) -> anyhow::Result<(BodyModel, String)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the body {}", path.display()))?;
    let is_npz = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("npz"));
    let body = if is_npz {
        BodyModel::from_smpl_npz(&bytes)
    } else {
        BodyModel::from_glb(&bytes)
    }
    .with_context(|| format!("cannot use the body {}", path.display()))?;
    let sha256 = Sha256::digest(&bytes)
        .iter()
        .fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
    Ok((body, sha256))
}

/// A progress bar over frames.
pub(super) fn progress_bar(frames: u64) -> ProgressBar {
    let bar = ProgressBar::new(frames);
    let template = "{bar:30} {pos}/{len} frames, {per_sec}, {eta} left {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// The name that a clip file says: training splits by it.
fn clip_name(path: &Path) -> anyhow::Result<String> {
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    match stem.filter(|stem| ClipName::parse(stem).is_some()) {
        Some(stem) if path.extension().is_some_and(|end| end == "safetensors") => {
            Ok(stem.to_owned())
        }
        _ => bail!(
            "{}: a clip is named MOTION__SUBJECT.safetensors, such as hop__50004.safetensors, so that \
             training can hold out motions and subjects",
            path.display()
        ),
    }
}

fn options(args: &FitArgs, body: &BodyModel) -> anyhow::Result<FitOptions> {
    let usual = FitOptions::for_body(body);
    let shape = match &args.shape {
        None => None,
        Some(betas) => match <[f32; SHAPE_COUNT]>::try_from(betas.as_slice()) {
            Ok(betas) => Some(betas),
            Err(_) => bail!(
                "--shape has {} numbers, expected {SHAPE_COUNT}",
                betas.len()
            ),
        },
    };
    Ok(FitOptions {
        objective: args.objective.into(),
        rigidity: match args.rigidity {
            None => usual.rigidity,
            Some(Weights::Body) => Rigidity::Body,
            Some(Weights::Data) => Rigidity::Data,
            Some(Weights::Uniform) => Rigidity::Uniform,
        },
        shape,
        own_surface: args.own_surface,
    })
}

impl From<Compared> for Objective {
    fn from(compared: Compared) -> Self {
        match compared {
            Compared::Unposed => Self::Unposed,
            Compared::Posed => Self::Posed,
        }
    }
}

fn summarise(body: &BodyModel, fitted: &FittedSequence, args: &FitArgs) {
    let mut distances: Vec<f32> = fitted.frames.iter().map(|f| f.rigid_distance_m).collect();
    distances.sort_by(f32::total_cmp);
    let last = distances.len() - 1;
    let betas: Vec<String> = fitted.shape.iter().map(|b| format!("{b:.3}")).collect();
    let mut text = format!(
        "{} frames at {} Hz into {}\nshape {}\nrigid skin lies {:.2} mm from the scan (RMS; median \
         of the frames), {:.2} mm in the worst frame",
        fitted.frames.len(),
        fitted.rate_hz,
        args.out.display(),
        betas.join(","),
        distances[last / 2] * 1e3,
        distances[last] * 1e3,
    );
    for (region, (mean_mm, largest_mm)) in Region::ALL.iter().zip(region_offsets(body, fitted)) {
        if largest_mm > 0.0 {
            let name = region.name();
            let _ = write!(
                text,
                "\n  {name:<11} offset {mean_mm:6.1} mm mean, {largest_mm:6.1} mm largest"
            );
        }
    }
    say(&text);
}

/// Mean and largest offset in millimetres among the vertices that are mostly of each region.
fn region_offsets(body: &BodyModel, fitted: &FittedSequence) -> [(f32, f32); REGION_COUNT] {
    let mut results = [(0.0, 0.0); REGION_COUNT];
    for (weights, result) in body.region_weights.iter().zip(&mut results) {
        let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0_f32);
        for frame in &fitted.frames {
            for (offset, &weight) in frame.offsets_rest_m.iter().zip(weights) {
                if weight > 0.5 {
                    let size_mm = 1e3 * offset.length();
                    sum += size_mm;
                    count += 1.0;
                    largest = largest.max(size_mm);
                }
            }
        }
        *result = (sum / f32::max(count, 1.0), largest);
    }
    results
}
