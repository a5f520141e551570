//! `dynaskin play`: a motion on a body, as meshes.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, bail, ensure};
use clap::Args;
use dynaskin_body::{Figure, Figures, SHAPE_COUNT};
use dynaskin_motion::{Clip, MotionFile};
use dynaskin_runtime::{Avatar, Model};
use glam::Vec3;

use super::motion_files::MotionFileArgs;
use super::say;
use super::train::clip_bar;

const EXAMPLES: &str = "Examples:
  dynaskin play walk.bvh --body female --out walk
  dynaskin play dance.glb --body models/male --weight 95 --stature 1.82 --out dance --rate 24
  dynaskin play walk.bvh --body female --plain --out without-tissue";

/// Meshes of a clip, beyond which a folder is of no use: ten minutes at 60 Hz.
const MOST_MESHES: usize = 36_000;

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
    /// The folder to write meshes into: frame-00000.obj and on, in metres, +Y up.
    #[arg(long)]
    out: PathBuf,
    /// Meshes per second.
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    meshes: f64,
    /// Weight in kilograms; what is left out follows from the rest.
    #[arg(long, value_name = "KG")]
    weight: Option<f64>,
    /// Stature in metres, 1.45 and up.
    #[arg(long, value_name = "M")]
    stature: Option<f64>,
    /// Tape around the chest in centimetres.
    #[arg(long, value_name = "CM")]
    chest: Option<f64>,
    /// Muscle, 0 to 1.
    #[arg(long, value_name = "SHARE")]
    muscle: Option<f64>,
    /// Age in years.
    #[arg(long, value_name = "YEARS")]
    age: Option<f64>,
    /// Without soft tissue, to compare.
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
    let clip = clip(args, &avatar)?;
    let count = (clip.duration_seconds() * args.meshes) as usize + 1;
    ensure!(
        count <= MOST_MESHES,
        "{} would give {count} meshes, at most {MOST_MESHES} are written; give a smaller --meshes, or cut the motion",
        args.motion.display()
    );
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    let faces = face_lines(&model.body().faces);
    let bar = clip_bar("meshes");
    bar.set_length(count as u64);
    for frame in 0..count {
        avatar.step(&clip.pose_at(frame as f64 / args.meshes), 1.0 / args.meshes)?;
        let path = args.out.join(format!("frame-{frame:05}.obj"));
        let (positions_m, _) = avatar.skin();
        dynaskin_files::replace(&path, obj(positions_m, &faces).as_bytes())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    say(&format!(
        "{}: {count} meshes, {} a second",
        args.out.display(),
        args.meshes
    ));
    Ok(())
}

/// Refuses what cannot be done before anything is read.
fn check(args: &PlayArgs) -> anyhow::Result<()> {
    ensure!(
        args.meshes > 0.0 && args.meshes <= 240.0,
        "--meshes must be above 0 and at most 240 a second, got {}",
        args.meshes
    );
    let ending = args
        .out
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase());
    if matches!(ending.as_deref(), Some("mp4" | "webm" | "gif" | "obj")) {
        bail!(
            "--out {}: meshes are written into a folder, give its name. For a video, drop the motion on the demo page \
             (`npm start`) and record it there, or render the meshes",
            args.out.display()
        );
    }
    ensure!(
        !args.out.is_file(),
        "--out {} is a file; give a folder",
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
    let read = |name: &str| fs::read(folder.join(name)).map_err(|error| error.to_string());
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

/// The triangles, which are the same in every mesh. OBJ counts from 1.
fn face_lines(faces: &[[u32; 3]]) -> String {
    let mut text = String::new();
    for [a, b, c] in faces {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

fn obj(positions_m: &[Vec3], faces: &str) -> String {
    let mut text = String::with_capacity(positions_m.len() * 32 + faces.len());
    for Vec3 { x, y, z } in positions_m {
        let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
    }
    text + faces
}
