//! `dynaskin play`: a motion on a body, as meshes or as a video.

mod meshes;
mod video;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::motion_files::MotionFileArgs;
use super::say;
use super::train::clip_bar;
use anyhow::{Context as _, bail, ensure};
use clap::Args;
use dynaskin_body::{Figure, Figures, SHAPE_COUNT};
use dynaskin_motion::{Clip, MotionFile};
use dynaskin_runtime::{Avatar, Model};
use meshes::Meshes;
use video::Video;

const EXAMPLES: &str = "Examples:
  dynaskin play walk.bvh --body female --out walk.mp4
  dynaskin play dance.glb --body models/male --weight 95 --stature 1.82 --out dance --fps 24
  dynaskin play walk.bvh --body female --plain --out without-tissue";

/// Frames of a clip, beyond which neither a folder nor a film of one is of use: ten minutes at 60 Hz.
const MOST_FRAMES: usize = 36_000;

/// Arguments of `dynaskin play`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct PlayArgs {
    /// The motion: BVH, GLB, VRM, VRMA or SMPL poses as .npz.
    #[arg(id = "mocap", value_name = "MOTION")]
    motion: PathBuf,
    /// The body with its networks: a folder with bundle.json, or its name below `models`, such as female.
    #[arg(long)]
    body: PathBuf,
    /// Output: a folder for meshes (frame-00000.obj and so on, in metres, +Y up), or a video, NAME.mp4, which needs
    /// ffmpeg.
    #[arg(long)]
    out: PathBuf,
    /// Meshes or pictures per second.
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    fps: f64,
    /// Width and height of a video in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = clap::value_parser!(u32).range(64..=2160))]
    size: u32,
    /// View of a video in degrees about the vertical: 0 from the front of the body at its beginning, 90 from its
    /// left.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 30.0,
        allow_negative_numbers = true
    )]
    turn: f64,
    /// Weight in kilograms; measures that are left out follow from the others.
    #[arg(long, value_name = "KG")]
    weight: Option<f64>,
    /// Stature in metres, 1.45 to 2.2.
    #[arg(long, value_name = "M")]
    stature: Option<f64>,
    /// Chest circumference in centimetres.
    #[arg(long, value_name = "CM")]
    chest: Option<f64>,
    /// Muscle, 0 to 1.
    #[arg(long, value_name = "SHARE")]
    muscle: Option<f64>,
    /// Age in years.
    #[arg(long, value_name = "YEARS")]
    age: Option<f64>,
    /// Plain skinning without soft tissue, to compare.
    #[arg(long)]
    plain: bool,
    #[command(flatten)]
    reading: MotionFileArgs,
}

/// Runs the command.
pub fn run(args: &PlayArgs) -> anyhow::Result<()> {
    check(args)?;
    let model = Arc::new(load(&args.body)?);
    let shape = shape(&model, args)?;
    let mut avatar = Avatar::new(Arc::clone(&model), &shape)?;
    if args.plain {
        avatar.set_enabled(false);
    }
    let mut clip = clip(args, &avatar)?;
    // Meshes stay where the file has them.
    if is_video(&args.out) {
        clip.turn_to_front();
    }
    let count = (clip.duration_seconds() * args.fps) as usize + 1;
    ensure!(
        count <= MOST_FRAMES,
        "{} would give {count} frames, at most {MOST_FRAMES} are written; give a smaller --fps, or cut the motion",
        args.motion.display()
    );
    let mut out = Sink::open(args, &model, &clip, &avatar)?;
    let bar = clip_bar("frames");
    bar.set_length(count as u64);
    for frame in 0..count {
        let pose = clip.pose_at(frame as f64 / args.fps);
        avatar.step(&pose, 1.0 / args.fps)?;
        let (positions_m, _) = avatar.skin();
        match &mut out {
            Sink::Meshes(meshes) => meshes.write(frame, positions_m)?,
            Sink::Video(video) => video.write(positions_m, pose.root_translation_m)?,
        }
        bar.inc(1);
    }
    if let Sink::Video(video) = out {
        video.finish()?;
    }
    bar.finish_and_clear();
    say(&format!(
        "{}: {count} frames, {} a second",
        args.out.display(),
        args.fps
    ));
    Ok(())
}

/// Where frames go.
enum Sink {
    Meshes(Meshes),
    Video(Video),
}

impl Sink {
    fn open(args: &PlayArgs, model: &Model, clip: &Clip, avatar: &Avatar) -> anyhow::Result<Self> {
        let body = model.body();
        if !is_video(&args.out) {
            return Ok(Self::Meshes(Meshes::new(&args.out, &body.faces)?));
        }
        // As high as the pelvis goes over its place at rest, and room for raised arms.
        let rise_m = clip
            .frames
            .iter()
            .map(|pose| pose.root_translation_m.y as f32);
        let rise_m = rise_m.fold(0.0, f32::max);
        let tallest_m = avatar
            .joints_rest_m()
            .iter()
            .map(|joint| joint.y)
            .fold(0.0, f32::max);
        let view = video::View {
            size_px: args.size,
            turn_radians: args.turn.to_radians() as f32,
            height_m: 1.25 * tallest_m + rise_m,
        };
        Ok(Self::Video(Video::start(&args.out, args.fps, view, body)?))
    }
}

fn is_video(out: &Path) -> bool {
    out.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("mp4"))
}

/// Refuses what cannot be done before anything is read.
fn check(args: &PlayArgs) -> anyhow::Result<()> {
    ensure!(
        args.fps >= 1.0 && args.fps <= 240.0,
        "--fps must be 1 to 240 a second, got {}",
        args.fps
    );
    ensure!(
        args.turn.is_finite(),
        "--turn must be a number of degrees, got {}",
        args.turn
    );
    let ending = args
        .out
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase());
    if let Some(ending @ ("webm" | "gif" | "mov" | "obj" | "glb" | "ply")) = ending.as_deref() {
        bail!(
            "--out {}: .{ending} is not written; give NAME.mp4 for a video, or a folder for one .obj file a frame",
            args.out.display()
        );
    }
    ensure!(
        is_video(&args.out) || !args.out.is_file(),
        "--out {} is a file; give a folder, or NAME.mp4",
        args.out.display()
    );
    Ok(())
}

/// The model of a folder, or of a name below `models`.
fn load(body: &Path) -> anyhow::Result<Model> {
    let named = Path::new("models").join(body);
    let folder = [body, &named]
        .into_iter()
        .find(|folder| folder.join("bundle.json").is_file());
    let Some(folder) = folder else {
        bail!(
            "there is no bundle.json in {} nor in {}; give --body the folder of a model, such as models/female in a \
             clone of dynaskin or the package dynaskin-female",
            body.display(),
            named.display()
        );
    };
    let read =
        |name: &str| fs::read(folder.join(name)).map_err(|error| dynaskin_files::reason(&error));
    let bundle = folder.join("bundle.json");
    let json = fs::read(&bundle).with_context(|| format!("cannot read {}", bundle.display()))?;
    Model::load(&json, &mut |name| read(name)).with_context(|| {
        format!(
            "{} cannot be used; its files belong together, fetch all of them again",
            folder.display()
        )
    })
}

fn shape(model: &Model, args: &PlayArgs) -> anyhow::Result<[f32; SHAPE_COUNT]> {
    let wanted = Figure {
        stature_m: args.stature,
        weight_kg: args.weight,
        chest_cm: args.chest,
        muscle: args.muscle,
        age_years: args.age,
    };
    if wanted == Figure::default() {
        return Ok([0.0; SHAPE_COUNT]);
    }
    let traits = model.bundle().map_or(&[][..], |bundle| &bundle.traits);
    let figures = Figures::new(model.body(), traits)?;
    let shape = figures.shape_of(&wanted)?;
    say(&told(&figures.measure(&shape)));
    Ok(shape)
}

/// What was reached: not every wish comes true.
fn told(reached: &Figure) -> String {
    let [stature, weight, chest, muscle, age] = reached.values().map(Option::unwrap_or_default);
    format!(
        "a body of {weight:.1} kg and {stature:.2} m, {chest:.0} cm around the chest, muscle {muscle:.2}, {age:.0} years"
    )
}

fn clip(args: &PlayArgs, avatar: &Avatar) -> anyhow::Result<Clip> {
    let path = &args.motion;
    let name = || path.display().to_string();
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", name()))?;
    let options = args.reading.options()?;
    let read = MotionFile::parse_with(&bytes, &options)
        .with_context(name)?
        .clip(avatar.joints_rest_m())
        .with_context(name)?;
    // What the file did not say, and what was made of it.
    for note in &read.notes {
        say(&format!("{}: {note}", name()));
    }
    Ok(read.clip)
}
