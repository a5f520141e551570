//! `dynaskin fit-all`: the captures of several people, each with one shape, fitted side by side.

mod page;
mod state;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use dynaskin_body::{BodyModel, SHAPE_COUNT};
use dynaskin_files::FolderLock;
use dynaskin_fit::{
    Capture, ClipBuilder, FitError, FitOptions, JointFrames, Joints, Scans, SequenceFit, captures,
    nearest_to_rest, turned_degrees,
};
use dynaskin_train::ClipName;
use indicatif::ProgressBar;

use super::fit::{Settings, joints_told, progress_bar, read_body, shape_of};
use super::shard::Shard;
use super::{numbers, say};
use crate::told::sentence;
use state::{PersonShape, Shapes};

const EXAMPLES: &str = "\
Examples:
  dynaskin fit-all --body models/female/body.glb --scans dyna_female.h5 --rate 60 --out fits
  dynaskin fit-all --body my_smpl.npz --scans FOLDER --rate 60 --person 50002 --person 50004 --out fits
  dynaskin fit-all --body my_smpl.npz --scans FOLDER --rate 60 --out fits --shard 1/16
  dynaskin train --data fits/clips --body models/female/body.glb --hold-out 50004 --validate-on shake_hips \\
    --out my_model";

/// Arguments of `dynaskin fit-all`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FitAllArgs {
    #[command(flatten)]
    settings: Settings,
    /// An HDF5 file, or a folder of HDF5 files, .npz files and folders of OBJ or PLY files. Sequences are
    /// named PERSON_MOTION: what stands before the first underscore says whose they are.
    #[arg(long)]
    scans: PathBuf,
    /// Frames per second of the scans.
    #[arg(long, value_parser = numbers::rate_hz, allow_hyphen_values = true)]
    rate: f64,
    /// Only the sequences of this person; may be given several times.
    #[arg(long)]
    person: Vec<String>,
    /// Do not fit this sequence, such as 50004_hop, and take away its clip, where it went wrong; its fit stays. May be
    /// given several times. A run without it fits the sequence again.
    #[arg(long, value_name = "SEQUENCE")]
    leave_out: Vec<String>,
    /// The shape of a person, PERSON=b0,b1,...,b9; without it, it is fitted to the sequence of the person
    /// that begins nearest to rest.
    #[arg(long, allow_hyphen_values = true)]
    shape: Vec<String>,
    /// Folder for fits (.npz), clips for `dynaskin train` (clips/MOTION__PERSON.safetensors) and report.html.
    /// What is there is kept and not fitted again.
    #[arg(long)]
    out: PathBuf,
    /// Fit only part I of N, for running on several machines: `--shard 2/8`. All parts may write to one folder;
    /// the command without it writes the report in the end.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Sequences fitted at a time; 0 takes one per two processors. All processors work in any case.
    #[arg(long, default_value_t = 0, value_parser = numbers::jobs)]
    jobs: usize,
}

/// What all sequences of a run share.
struct Work<'a> {
    args: &'a FitAllArgs,
    body: &'a BodyModel,
    sha256: &'a str,
    shapes: &'a Shapes,
    /// Why a person has no shape, by name.
    shapeless: &'a BTreeMap<String, String>,
    pool: rayon::ThreadPool,
    bar: ProgressBar,
    /// When the first sequence was begun, and how many there are.
    begun: Instant,
    sequences: usize,
    fitted: AtomicUsize,
}

/// Runs the command.
pub fn run(args: &FitAllArgs) -> anyhow::Result<()> {
    let (body, sha256) = read_body(&args.settings.body)?;
    let mut found = captures(&args.scans, &body)?;
    found.retain(|capture| args.person.is_empty() || args.person.contains(&capture.person));
    if found.is_empty() {
        bail!(
            "{} has no sequence of {}",
            args.scans.display(),
            args.person.join(", ")
        );
    }
    for name in &args.leave_out {
        if !found.iter().any(|capture| capture.name == *name) {
            bail!(
                "--leave-out {name}: {} has no such sequence",
                args.scans.display()
            );
        }
    }
    let (left_out, found): (Vec<Capture>, Vec<Capture>) = found
        .into_iter()
        .partition(|capture| args.leave_out.contains(&capture.name));
    if found.is_empty() {
        bail!("--leave-out leaves no sequence to fit");
    }
    let _lock = match args.shard {
        None => FolderLock::take(&args.out)?,
        Some(_) => FolderLock::share(&args.out)?,
    };
    // Settings of which nothing came keep nobody from trying others.
    if args.shard.is_none() {
        state::forget_unused_settings(&args.out)?;
    }
    state::check_settings(&args.out, &settings(args, &sha256))?;
    let clips = args.out.join("clips");
    fs::create_dir_all(&clips).with_context(|| format!("cannot make {}", clips.display()))?;
    for capture in &left_out {
        let clip = clip_path(&args.out, capture);
        match fs::remove_file(&clip) {
            Ok(()) => say(&format!("{} is taken away", clip.display())),
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => {
                return Err(error).with_context(|| format!("cannot remove {}", clip.display()));
            }
        }
    }
    // Sequences of a person are neighbours: few parts look for the same shape.
    let ours = args
        .shard
        .map_or(0..found.len(), |shard| shard.neighbours(found.len()));
    let ours = found.get(ours).unwrap_or_default();
    let names: BTreeSet<&str> = ours.iter().map(|capture| capture.name.as_str()).collect();
    state::remove_half_written(&args.out, |name| names.contains(name));
    let (shapes, shapeless) = shapes(args, &body, &found, ours)?;
    let failed = fit_all(args, (&body, &sha256), (&shapes, &shapeless), ours)?;
    let told = format!(
        "{} of {} sequences are fitted",
        ours.len() - failed.len(),
        ours.len()
    );
    if args.shard.is_some() {
        say(&format!(
            "{told} in this part; the command without --shard writes the report once all parts are done"
        ));
    } else {
        let page = args.out.join("report.html");
        page::write(&page, &body, &args.out, &found, &shapes, &failed)?;
        say(&format!("{told}; {} shows them", page.display()));
    }
    if failed.is_empty() {
        return Ok(());
    }
    let reasons: Vec<String> = failed
        .iter()
        .map(|(name, reason)| format!("  {name}: {reason}"))
        .collect();
    bail!(
        "{} of {} sequences could not be fitted:\n{}",
        failed.len(),
        ours.len(),
        reasons.join("\n")
    )
}

/// What must be the same for fits in one folder to go together.
fn settings(args: &FitAllArgs, sha256: &str) -> Vec<(&'static str, String)> {
    let mut settings = args.settings.told(sha256);
    settings.push(("rate", format!("{} Hz", args.rate)));
    settings
}

/// Shape and joints of each person of `ours`: in the folder already, or fitted. The second are the people
/// without them, and why: they do not stop the others. The shape is given, or fitted to the sequence nearest
/// to rest among all that were `found`; the joints are fitted to frames of all of the person's sequences.
fn shapes(
    args: &FitAllArgs,
    body: &BodyModel,
    found: &[Capture],
    ours: &[Capture],
) -> anyhow::Result<(Shapes, BTreeMap<String, String>)> {
    let mut shapes = Shapes::read(&args.out)?;
    let mut given = BTreeMap::new();
    for text in &args.shape {
        let Some((person, betas)) = text.split_once('=') else {
            bail!("--shape {text}: expected PERSON=b0,b1,...,b9");
        };
        let betas: Result<Vec<f32>, _> = betas.split(',').map(|beta| beta.trim().parse()).collect();
        let betas = betas.with_context(|| format!("--shape {text}: expected numbers"))?;
        let shape = shape_of(&betas)?;
        shapes.check_given(&args.out, person, &shape)?;
        if given
            .insert(person, shape)
            .is_some_and(|other| other != shape)
        {
            bail!("--shape gives {person} two shapes; give one");
        }
    }
    let people: BTreeSet<&str> = ours.iter().map(|capture| capture.person.as_str()).collect();
    let new: Vec<Capture> = found
        .iter()
        .filter(|capture| people.contains(&*capture.person) && !shapes.has(&capture.person))
        .cloned()
        .collect();
    let bar = progress_bar(new.len() as u64);
    bar.set_message("(looking for rest; sequences, not frames)");
    // A sequence that cannot be read is told when it is its turn.
    let degrees: Vec<Option<f64>> = new
        .iter()
        .map(|capture| {
            bar.inc(1);
            let scans = open(args, body, capture).ok()?;
            turned_degrees(body, &scans).ok()
        })
        .collect();
    bar.finish_and_clear();
    let mut shapeless = BTreeMap::new();
    for (person, nearest) in nearest_to_rest(&new, &degrees) {
        let shape = given.get(person).copied();
        // With a known shape any pose will do to begin with.
        let readable = || {
            let mut readable = new
                .iter()
                .zip(&degrees)
                .filter(|(_, degrees)| degrees.is_some());
            readable.find(|(capture, _)| capture.person == person)
        };
        let begun = match (shape.and_then(|_| readable()), nearest) {
            (Some((capture, _)), _) => Ok((capture, None)),
            (None, nearest) => nearest.map(|(capture, degrees)| (capture, Some(degrees))),
        };
        let own: Vec<&Capture> = new.iter().filter(|other| other.person == person).collect();
        match begun
            .map_err(anyhow::Error::from)
            .and_then(|begun| person_shape(args, body, begun, shape, &own))
        {
            Ok(found) => {
                if let Some((name, degrees)) = &found.source {
                    say(&format!(
                        "{person}: shape from {name}, which begins {degrees:.0} degrees from rest"
                    ));
                }
                if args.settings.fits_joints() {
                    say(&format!(
                        "{person}: {}",
                        joints_told(&found.joint_offsets_m)
                    ));
                }
                shapes.keep(&args.out, person, found)?;
            }
            Err(error) => {
                shapeless.insert(person.to_owned(), sentence(&error));
            }
        }
    }
    Ok((shapes, shapeless))
}

/// Shape and joints of a person: from a sequence, whose first frame is by so many degrees from rest unless
/// the shape is given, and from frames of all `own` sequences.
fn person_shape(
    args: &FitAllArgs,
    body: &BodyModel,
    (capture, degrees): (&Capture, Option<f64>),
    shape: Option<[f32; SHAPE_COUNT]>,
    own: &[&Capture],
) -> anyhow::Result<PersonShape> {
    let options = args.settings.fit_options(body, shape);
    let mut frames = JointFrames::new(body);
    if options.joints == Joints::Fitted {
        let stride = own.len().div_ceil(JointFrames::MOST);
        let some: Vec<&&Capture> = own.iter().step_by(stride).collect();
        for capture in &some {
            // One that cannot be read is told when it is its turn.
            if let Ok(scans) = open(args, body, capture) {
                let _ = frames.add(&scans, JointFrames::MOST / some.len());
            }
        }
    }
    let scans = open(args, body, capture)?;
    let fit = SequenceFit::begin_with(body, &scans, &frames, &options)
        .with_context(|| capture.name.clone())?;
    Ok(PersonShape {
        shape: fit.shape(),
        joint_offsets_m: fit.joint_offsets_m(),
        source: degrees.map(|degrees| (capture.name.clone(), degrees)),
    })
}

fn open<'b>(
    args: &FitAllArgs,
    body: &'b BodyModel,
    capture: &Capture,
) -> Result<Scans<'b>, FitError> {
    let options = args
        .settings
        .scan_options(args.rate, capture.sequence.as_deref());
    Scans::open(&capture.path, body, &options)
}

/// Fits what is not there yet. Gives why sequences could not be fitted, by name.
fn fit_all(
    args: &FitAllArgs,
    (body, sha256): (&BodyModel, &str),
    (shapes, shapeless): (&Shapes, &BTreeMap<String, String>),
    found: &[Capture],
) -> anyhow::Result<BTreeMap<String, String>> {
    let mut failed = BTreeMap::new();
    let mut waiting = Vec::new();
    let mut frames = 0;
    // Names of sequences by unit and axes, in which all should be alike.
    let mut kinds: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for capture in found {
        if is_there(&args.out, capture) {
            continue;
        }
        // Opened once more when it is its turn: many files are not held open.
        match open(args, body, capture) {
            Ok(scans) => {
                frames += scans.frame_count() as u64;
                let axes = scans.axes.as_ref();
                let axes = axes.map_or_else(String::new, |axes| format!(", {axes}"));
                let kind = format!("in {}, {} up{axes}", scans.unit.name(), scans.up.name());
                kinds.entry(kind).or_default().push(&capture.name);
                for doubt in &scans.doubts {
                    say(&format!("check {}: {doubt}", capture.name));
                }
                waiting.push(capture);
            }
            Err(error) => {
                failed.insert(capture.name.clone(), sentence(&error.into()));
            }
        }
    }
    let there = found.len() - waiting.len() - failed.len();
    if there > 0 {
        say(&format!("{there} sequences are there already"));
    }
    let usual = kinds.values().map(Vec::len).max();
    for (kind, names) in &kinds {
        let count = names.len();
        match kinds.len() > 1 && Some(count) < usual {
            false => say(&format!("sequences {kind}: {count}")),
            true => say(&format!("check: sequences {kind}: {}", names.join(", "))),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().build()?;
    let jobs = match args.jobs {
        0 => pool.current_num_threads().div_ceil(2),
        jobs => jobs,
    };
    let work = Work {
        args,
        body,
        sha256,
        shapes,
        shapeless,
        pool,
        bar: progress_bar(frames),
        begun: Instant::now(),
        sequences: waiting.len(),
        fitted: AtomicUsize::new(0),
    };
    let next = AtomicUsize::new(0);
    let is_full = AtomicBool::new(false);
    let told = Mutex::new(failed);
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(waiting.len()) {
            scope.spawn(|| {
                while let Some(capture) = waiting.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let fitted = match is_full.load(Ordering::Relaxed) {
                        false => fit_one(&work, capture),
                        true => Err(anyhow!("not fitted, because the disk is full")),
                    };
                    if let Err(error) = fitted {
                        // Others would work for nothing.
                        is_full.fetch_or(tells_full_disk(&error), Ordering::Relaxed);
                        let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
                        told.insert(capture.name.clone(), sentence(&error));
                    }
                    work.tell_progress();
                }
            });
        }
    });
    work.bar.finish_and_clear();
    Ok(told.into_inner().unwrap_or_else(PoisonError::into_inner))
}

impl Work<'_> {
    /// Says how far the work is, in a log, where no bar is drawn.
    fn tell_progress(&self) {
        let fitted = self.fitted.fetch_add(1, Ordering::Relaxed) + 1;
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        if !self.bar.is_hidden() || done == 0 {
            return;
        }
        let left = all.saturating_sub(done) as f64 / done as f64;
        let minutes = self.begun.elapsed().as_secs_f64() / 60.0 * left;
        let sequences = self.sequences;
        say(&format!(
            "{fitted} of {sequences} sequences done, {done} of {all} frames, {minutes:.0} min left"
        ));
    }
}

fn tells_full_disk(error: &anyhow::Error) -> bool {
    let refusals = error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>());
    let kinds: Vec<ErrorKind> = refusals.map(std::io::Error::kind).collect();
    kinds.contains(&ErrorKind::StorageFull) || kinds.contains(&ErrorKind::QuotaExceeded)
}

fn fit_one(work: &Work<'_>, capture: &Capture) -> anyhow::Result<()> {
    let (args, body) = (work.args, work.body);
    if let Some(reason) = work.shapeless.get(&capture.person) {
        bail!("{reason}");
    }
    let person = work
        .shapes
        .of(&capture.person)
        .context("its person has no shape: no sequence of the person can be read")?;
    let name = clip_name(capture);
    if ClipName::parse(&name).is_none() {
        bail!("`{name}` is no name of a clip; name the sequence PERSON_MOTION, such as 50002_hips");
    }
    let scans = open(args, body, capture)?;
    scans.check(|_| ())?;
    work.pool.install(|| -> anyhow::Result<()> {
        let options = FitOptions {
            joints: Joints::Given(person.joint_offsets_m),
            ..args.settings.fit_options(body, Some(person.shape))
        };
        let fit = SequenceFit::begin(body, &scans, &options)?;
        let mut clip = ClipBuilder::new(body, fit.rate_hz(), fit.shape());
        let done = |_: usize| work.bar.inc(1);
        fit.write_npz(&fit_path(&args.out, capture), done, |frame| {
            clip.push(frame)
        })?;
        clip.finish(work.sha256, &name)?
            .write(&clip_path(&args.out, capture))?;
        Ok(())
    })
}

/// The fit of a sequence.
fn fit_path(out: &Path, capture: &Capture) -> PathBuf {
    out.join(format!("{}.npz", capture.name))
}

fn clip_name(capture: &Capture) -> String {
    // What stands between motion and person may not stand in them.
    let parts: Vec<&str> = (capture.motion.split('_'))
        .filter(|part| !part.is_empty())
        .collect();
    format!("{}__{}", parts.join("_"), capture.person)
}

fn clip_path(out: &Path, capture: &Capture) -> PathBuf {
    out.join("clips")
        .join(format!("{}.safetensors", clip_name(capture)))
}

/// Whether a sequence is fitted: its clip is written last.
fn is_there(out: &Path, capture: &Capture) -> bool {
    fit_path(out, capture).exists() && clip_path(out, capture).exists()
}
