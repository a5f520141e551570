//! `dynaskin fit`: mesh sequences of a subject become poses and soft-tissue offsets.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, REGION_COUNT, Region, SHAPE_COUNT};
use dynaskin_fit::{
    ClipBuilder, FitOptions, FittedFrame, Joints, Objective, Rigidity, ScanOptions, ScanUnit,
    Scans, SequenceFit, captures, is_hdf5, sequences,
};
use dynaskin_motion::UpAxis;
use dynaskin_train::ClipName;
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use sha2::{Digest as _, Sha256};

use super::train::glb_body;
use super::{numbers, say};

const EXAMPLES: &str = "\
Examples:
  dynaskin fit --body models/female/body.glb --scans dyna_female.h5 --list
  dynaskin fit --body models/female/body.glb --scans dyna_female.h5 --sequence 50004_hips --rate 60 \\
    --out fits/50004_hips.npz --clip data/mine/hips__50004.safetensors
  dynaskin fit --body my_smpl.npz --scans FOLDER_OF_PLY --rate 60 --out hop.npz";

/// A rate that reads scans where only their number counts.
const LISTED_HZ: f64 = 60.0;

/// Arguments of `dynaskin fit`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FitArgs {
    #[command(flatten)]
    settings: Settings,
    /// The sequence, registered to the body's mesh: an HDF5 file with a data set [vertices, 3, frames] for
    /// each sequence, as Dyna and D-FAUST come, an .npz file with vertices [frames, vertices, 3], or a folder
    /// with one OBJ or PLY file a frame, sorted by name.
    #[arg(long)]
    scans: PathBuf,
    /// Data set of the sequence in an HDF5 file that holds several.
    #[arg(long)]
    sequence: Option<String>,
    /// List the sequences of a file or folder, and fit nothing.
    #[arg(long)]
    list: bool,
    /// Frames per second of the scans.
    #[arg(long, required_unless_present = "list", value_parser = numbers::rate_hz, allow_hyphen_values = true)]
    rate: Option<f64>,
    /// The subject's ten shape coefficients, separated by commas, where they are known from another
    /// sequence; without it they are fitted to the first frame.
    #[arg(
        long,
        value_name = "b0,b1,...,b9",
        value_delimiter = ',',
        allow_hyphen_values = true,
        num_args = 1
    )]
    shape: Option<Vec<f32>>,
    /// Where to write the fit: poses, trans, betas as AMASS names them, and offsets (.npz).
    #[arg(long, required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Also write a clip for `dynaskin train`, named MOTION__SUBJECT.safetensors.
    #[arg(long)]
    clip: Option<PathBuf>,
    /// Replace files that are there.
    #[arg(long)]
    overwrite: bool,
    /// Threads; 0 takes one per processor.
    #[arg(long, default_value_t = 0, value_parser = numbers::jobs)]
    jobs: usize,
}

/// How scans are read and fitted: what all sequences of a capture have in common.
#[derive(Debug, Args)]
pub(super) struct Settings {
    /// Body model: a GLB built by `dynaskin body build`, or an SMPL-family .npz of your own.
    #[arg(long)]
    pub(super) body: PathBuf,
    /// Unit of the scans' coordinates; without it the one in which the mesh is as large as a person.
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Axis of the scans' world that points up; without it the one along which the trunk stands in the first
    /// frame.
    #[arg(long, value_enum, allow_hyphen_values = true)]
    up: Option<Up>,
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
    /// Count offsets from the subject's own surface in the first frame, where it must be at rest,
    /// instead of from the surface that β makes.
    #[arg(long)]
    own_surface: bool,
    /// Where the joints lie: where the scans' movement shows them, or where the shape puts them.
    #[arg(long, value_enum, default_value_t = JointPlaces::Fitted)]
    joints: JointPlaces,
}

impl Settings {
    /// How to read a sequence.
    pub(super) fn scan_options(&self, rate_hz: f64, sequence: Option<&str>) -> ScanOptions {
        ScanOptions {
            unit: self.unit.map(|unit| match unit {
                Unit::M => ScanUnit::Metre,
                Unit::Cm => ScanUnit::Centimetre,
                Unit::Mm => ScanUnit::Millimetre,
            }),
            up: self.up.map(|up| match up {
                Up::Y => UpAxis::Y,
                Up::Z => UpAxis::Z,
                Up::MinusY => UpAxis::MinusY,
            }),
            rate_hz,
            key: self.key.clone(),
            sequence: sequence.map(str::to_owned),
        }
    }

    /// All of them by name, for people: what fits that go together have in common. The body may lie elsewhere if
    /// it is the same one, so it is told by its SHA-256.
    pub(super) fn told(&self, body_sha256: &str) -> Vec<(&'static str, String)> {
        fn name(value: &impl ValueEnum) -> String {
            let value = value.to_possible_value();
            value.map_or_else(String::new, |value| value.get_name().to_owned())
        }
        fn found(value: Option<&impl ValueEnum>) -> String {
            value.map_or_else(|| "as found".to_owned(), name)
        }
        vec![
            ("body", format!("the one of SHA-256 {body_sha256}")),
            ("unit", found(self.unit.as_ref())),
            ("up", found(self.up.as_ref())),
            ("key", self.key.clone()),
            ("objective", name(&self.objective)),
            ("rigidity", found(self.rigidity.as_ref())),
            ("own-surface", self.own_surface.to_string()),
            ("joints", name(&self.joints)),
        ]
    }

    /// Whether the joints' places are fitted.
    pub(super) fn fits_joints(&self) -> bool {
        matches!(self.joints, JointPlaces::Fitted)
    }

    /// How to fit a sequence of a person of a shape.
    pub(super) fn fit_options(
        &self,
        body: &BodyModel,
        shape: Option<[f32; SHAPE_COUNT]>,
    ) -> FitOptions {
        FitOptions {
            objective: self.objective.into(),
            rigidity: match self.rigidity {
                None => FitOptions::for_body(body).rigidity,
                Some(weights) => weights.into(),
            },
            shape,
            own_surface: self.own_surface,
            joints: self.joints.into(),
        }
    }
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
    #[value(name = "-y")]
    MinusY,
}

/// Where differences are measured, as an argument.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Compared {
    Unposed,
    Posed,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Weights {
    Body,
    Data,
    Uniform,
}

/// Where the joints lie, as an argument.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum JointPlaces {
    Fitted,
    Body,
}

/// Runs the command.
pub fn run(args: &FitArgs) -> anyhow::Result<()> {
    if args.list {
        return list(args);
    }
    let (Some(out), Some(rate_hz)) = (&args.out, args.rate) else {
        bail!("--out and --rate are needed");
    };
    let clip_name = args.clip.as_deref().map(clip_name).transpose()?;
    for path in [Some(out), args.clip.as_ref()].into_iter().flatten() {
        if path.exists() && !args.overwrite {
            bail!(
                "{} is there already; --overwrite replaces it",
                path.display()
            );
        }
        // Before the minutes that a fit takes.
        dynaskin_files::check_place(path)?;
    }
    let (body, sha256) = read_body(&args.settings.body)?;
    let scan_options = args
        .settings
        .scan_options(rate_hz, args.sequence.as_deref());
    let scans = Scans::open(&args.scans, &body, &scan_options)?;
    for note in &scans.notes {
        say(note);
    }
    for doubt in &scans.doubts {
        say(&format!("check: {doubt}"));
    }
    let shape = args.shape.as_deref().map(shape_of).transpose()?;
    let options = args.settings.fit_options(&body, shape);
    let frames = scans.frame_count() as u64;
    let reading = progress_bar(frames);
    reading.set_message("(reading)");
    scans.check(|read| reading.set_position(read as u64))?;
    reading.finish_and_clear();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs)
        .build()?;
    let mut summary = Summary::new(&body);
    let shape = pool.install(|| -> anyhow::Result<[f32; SHAPE_COUNT]> {
        let fit = SequenceFit::begin(&body, &scans, &options)?;
        if args.settings.fits_joints() {
            say(&joints_told(&fit.joint_offsets_m()));
        }
        let bar = progress_bar(frames);
        let mut clip = clip_name
            .is_some()
            .then(|| ClipBuilder::new(&body, fit.rate_hz(), fit.shape()));
        let done = |frames: usize| bar.set_position(frames as u64);
        fit.write_npz(out, done, |frame| {
            summary.add(frame);
            if let Some(clip) = &mut clip {
                clip.push(frame);
            }
        })?;
        bar.finish_and_clear();
        if let (Some(clip), Some(path), Some(name)) = (clip, &args.clip, &clip_name) {
            clip.finish(&sha256, name)?.write(path)?;
        }
        Ok(fit.shape())
    })?;
    summary.tell(out, rate_hz, &shape);
    Ok(())
}

fn list(args: &FitArgs) -> anyhow::Result<()> {
    let (body, _) = read_body(&args.settings.body)?;
    let path = &args.scans;
    if !path.is_dir() && is_hdf5(path)? {
        return list_file(path, &body, "");
    }
    if !path.is_dir() || dynaskin_fit::holds_meshes(path)? {
        // It is one.
        let options = args.settings.scan_options(LISTED_HZ, None);
        let scans = Scans::open(path, &body, &options)?;
        say(&format!(
            "{} {}",
            path.display(),
            frames(scans.frame_count())
        ));
        return Ok(());
    }
    let found = captures(&args.scans, &body)?;
    let files: BTreeSet<&Path> = found.iter().map(|capture| capture.path.as_path()).collect();
    for file in files {
        say(&file.display().to_string());
        if file.is_file() && is_hdf5(file)? {
            list_file(file, &body, "  ")?;
        }
    }
    Ok(())
}

fn frames(count: usize) -> String {
    match count {
        1 => "1 frame".to_owned(),
        count => format!("{count} frames"),
    }
}

/// Lists the sequences of an HDF5 file.
fn list_file(file: &Path, body: &BodyModel, indent: &str) -> anyhow::Result<()> {
    for sequence in sequences(file, body)? {
        let told = match sequence.frame_count {
            Some(count) => frames(count),
            None if sequence.is_ambiguous => "can be read in more than one way".to_owned(),
            None => "not of this body's mesh".to_owned(),
        };
        // A name may hold anything.
        let name = sequence.name.replace(char::is_control, "\u{fffd}");
        say(&format!("{indent}{name} {:?} {told}", sequence.shape));
    }
    Ok(())
}

/// A body from a GLB or `.npz` file, and the file's SHA-256.
pub(super) fn read_body(path: &Path) -> anyhow::Result<(BodyModel, String)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the body {}", path.display()))?;
    let is_npz = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("npz"));
    let body = match is_npz {
        true => BodyModel::from_smpl_npz(&bytes)
            .with_context(|| format!("cannot use the body {}", path.display()))?,
        false => glb_body(path, &bytes)?,
    };
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

/// Shape coefficients that were given.
pub(super) fn shape_of(betas: &[f32]) -> anyhow::Result<[f32; SHAPE_COUNT]> {
    <[f32; SHAPE_COUNT]>::try_from(betas).map_err(|_| {
        let got = betas.len();
        anyhow::anyhow!("--shape has {got} numbers, expected {SHAPE_COUNT}")
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

impl From<Weights> for Rigidity {
    fn from(weights: Weights) -> Self {
        match weights {
            Weights::Body => Self::Body,
            Weights::Data => Self::Data,
            Weights::Uniform => Self::Uniform,
        }
    }
}

impl From<JointPlaces> for Joints {
    fn from(places: JointPlaces) -> Self {
        match places {
            JointPlaces::Fitted => Self::Fitted,
            JointPlaces::Body => Self::Body,
        }
    }
}

/// How far the joints lie from where the shape puts them, farthest first.
pub(super) fn joints_told(offsets_m: &[Vec3; JOINT_COUNT]) -> String {
    let mut joints: Vec<(Joint, f32)> = Joint::ALL
        .into_iter()
        .map(|joint| (joint, 1e3 * offsets_m[joint as usize].length()))
        .collect();
    joints.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mean_mm = joints.iter().map(|(_, mm)| mm).sum::<f32>() / JOINT_COUNT as f32;
    let farthest: Vec<String> = (joints.iter().take(3))
        .map(|(joint, mm)| format!("{} {mm:.0} mm", joint.name()))
        .collect();
    format!(
        "joints lie {mean_mm:.1} mm on average from where the shape puts them; farthest: {}",
        farthest.join(", ")
    )
}

/// What is told of a fit in the end, added up frame by frame.
struct Summary<'b> {
    body: &'b BodyModel,
    distances_m: Vec<f32>,
    /// Sum, number and largest of the offsets, in millimetres, of the vertices that are mostly of each
    /// region.
    regions: [(f64, f64, f32); REGION_COUNT],
}

impl<'b> Summary<'b> {
    fn new(body: &'b BodyModel) -> Self {
        Self {
            body,
            distances_m: Vec::new(),
            regions: [(0.0, 0.0, 0.0); REGION_COUNT],
        }
    }

    fn add(&mut self, frame: &FittedFrame) {
        self.distances_m.push(frame.rigid_distance_m);
        for (weights, (sum, count, largest)) in
            self.body.region_weights.iter().zip(&mut self.regions)
        {
            for (offset, &weight) in frame.offsets_rest_m.iter().zip(weights) {
                if weight > 0.5 {
                    let size_mm = 1e3 * offset.length();
                    *sum += f64::from(size_mm);
                    *count += 1.0;
                    *largest = largest.max(size_mm);
                }
            }
        }
    }

    fn tell(&mut self, out: &Path, rate_hz: f64, shape: &[f32; SHAPE_COUNT]) {
        self.distances_m.sort_by(f32::total_cmp);
        let count = self.distances_m.len();
        let at = |index: usize| self.distances_m.get(index).copied().unwrap_or_default() * 1e3;
        let last = count.saturating_sub(1);
        let betas: Vec<String> = shape.iter().map(|b| format!("{b:.3}")).collect();
        let mut text = format!(
            "{} at {rate_hz} Hz into {}\nshape {}\nrigid skin lies {:.2} mm from the scan (RMS; \
             median of the frames), {:.2} mm in the worst frame",
            frames(count),
            out.display(),
            betas.join(","),
            at(last / 2),
            at(last),
        );
        for (region, (sum, count, largest_mm)) in Region::ALL.iter().zip(self.regions) {
            if largest_mm > 0.0 {
                let (name, mean_mm) = (region.name(), sum / f64::max(count, 1.0));
                let _ = write!(
                    text,
                    "\n  {name:<11} offset {mean_mm:6.1} mm mean, {largest_mm:6.1} mm largest"
                );
            }
        }
        say(&text);
    }
}
