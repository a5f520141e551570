//! `dynaskin bind`: a body's soft tissue on somebody else's avatar.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};
use clap::Args;
use dynaskin_bind::{Avatar, BindOptions, Bound, Report, bind};
use dynaskin_body::{BodyModel, Joint};
use dynaskin_report::{Picture, Triangle, heat_colour};
use glam::Vec3;

use super::say;
use super::train::glb_body;

const EXAMPLES: &str = "\
Examples:
  dynaskin bind me.vrm --body models/female/body.glb --depicts adult
  dynaskin bind me.glb --body models/male/body.glb --depicts adult --bone left_hip=Thigh_L --out me.binding";

/// Arguments of `dynaskin bind`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BindArgs {
    /// The avatar: .glb or .vrm, skinned.
    avatar: PathBuf,
    /// The body whose tissue it gets.
    #[arg(long)]
    body: PathBuf,
    /// The binding to write [default: beside the avatar].
    #[arg(long)]
    out: Option<PathBuf>,
    /// The picture of fit and coverage to write (PNG) [default: beside the binding].
    #[arg(long)]
    picture: Option<PathBuf>,
    /// What the avatar depicts. Soft tissue is for adults only: anything but `adult` is refused.
    #[arg(long)]
    depicts: Option<String>,
    /// The avatar's node for one of the body's joints, if it is not recognised: `left_hip=NAME`.
    #[arg(long = "bone", value_name = "JOINT=NAME")]
    bones: Vec<String>,
}

/// Runs the command.
pub fn run(args: &BindArgs) -> anyhow::Result<()> {
    let read =
        |path: &Path| fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let body = glb_body(&args.body, &read(&args.body)?)?;
    let bones = args.bones.iter().map(|bone| named(bone));
    let options = BindOptions {
        depicts: args.depicts.clone(),
        bones: bones.collect::<anyhow::Result<_>>()?,
    };
    let file = args.avatar.display().to_string();
    let avatar = Avatar::from_glb(&read(&args.avatar)?).with_context(|| file.clone())?;
    let bound = bind(&avatar, &body, &options).with_context(|| file.clone())?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| args.avatar.with_extension("binding"));
    let picture = args
        .picture
        .clone()
        .unwrap_or_else(|| out.with_extension("png"));
    let bytes = bound.binding.to_bytes();
    dynaskin_files::replace(&out, &bytes)?;
    let drawn = drawn(&avatar, &body, &bound).png("fit and coverage")?;
    dynaskin_files::replace(&picture, &drawn)?;
    tell(&bound.binding.report, &bound);
    say(&format!("{}: {} bytes", out.display(), bytes.len()));
    say(&format!(
        "{}: distance from the body from 0 (dark) to 5 cm (yellow), front and back; the fitted body; \
         how much of its tissue the skin takes, from none (dark) to all (yellow), front and back",
        picture.display()
    ));
    Ok(())
}

fn named(bone: &str) -> anyhow::Result<(Joint, String)> {
    let (joint, name) = bone.split_once('=').ok_or_else(|| {
        anyhow!("--bone takes JOINT=NAME, such as left_hip=thigh_l, got `{bone}`")
    })?;
    let joint = Joint::from_name(joint.trim()).ok_or_else(|| {
        let joints: Vec<&str> = Joint::ALL.iter().map(|joint| joint.name()).collect();
        anyhow!(
            "the body has no joint `{joint}`; it has {}",
            joints.join(", ")
        )
    })?;
    Ok((joint, name.trim().to_owned()))
}

fn tell(report: &Report, bound: &Bound) {
    let bones: Vec<String> = report
        .bones
        .iter()
        .map(|(joint, bone)| format!("{joint} {bone}"))
        .collect();
    say(&format!("bones: {}", bones.join(", ")));
    if !report.missing.is_empty() {
        say(&format!("without a bone: {}", report.missing.join(", ")));
    }
    let shape: Vec<String> = bound
        .binding
        .shape
        .iter()
        .map(|beta| format!("{beta:.1}"))
        .collect();
    say(&format!(
        "shape: {}; size {:.2}",
        shape.join(" "),
        bound.binding.size
    ));
    say(&format!(
        "fit: {:.1} % of the skin within 2 cm of the body, median {:.1} mm",
        100.0 * report.share_close,
        1e3 * report.median_m
    ));
    say(&format!(
        "{} of {} vertices move",
        report.moving, report.vertices
    ));
    for mesh in &report.meshes {
        say(&format!(
            "  {} ({}): {} of {}",
            mesh.name, mesh.material, mesh.moving, mesh.vertices
        ));
    }
    for off in &report.regions_off {
        say(&format!("{} stays still: {}", off.region, off.reason));
    }
    if !report.double_motion.is_empty() {
        say(&format!(
            "moves by bones of its own, too: {}; keep these bones still or leave the tissue there out",
            report.double_motion.join(", ")
        ));
    }
    report.notes.iter().for_each(|note| say(note));
}

/// Distances from this on have one colour, metres.
const FAR_M: f32 = 0.05;
/// Room between two figures, over the width of one.
const ROOM: f32 = 0.06;

/// Five figures side by side.
fn drawn(avatar: &Avatar, body: &BodyModel, bound: &Bound) -> Picture {
    let of_skin = |values: &[Vec<f32>]| -> Vec<([Vec3; 3], [u8; 3])> {
        let mut triangles = Vec::new();
        for ((mesh, skin_m), values) in avatar.meshes.iter().zip(&bound.skin_m).zip(values) {
            for face in &mesh.faces {
                let face = face.map(|corner| corner as usize);
                let value = face.iter().map(|corner| values[*corner]).sum::<f32>() / 3.0;
                let colour = if value.is_nan() {
                    [120, 120, 120]
                } else {
                    heat_colour(f64::from(value))
                };
                triangles.push((face.map(|corner| skin_m[corner]), colour));
            }
        }
        triangles
    };
    let far = |distances: &Vec<f32>| distances.iter().map(|m| m / FAR_M).collect();
    let distances: Vec<Vec<f32>> = bound.distances_m.iter().map(far).collect();
    let distance = of_skin(&distances);
    let coverage = of_skin(&bound.coverage);
    let fitted: Vec<([Vec3; 3], [u8; 3])> = body
        .faces
        .iter()
        .map(|face| {
            let colour = body.colors_srgba.get(face[0] as usize).copied();
            let [r, g, b, _] = colour.unwrap_or([180, 180, 180, 255]);
            (
                face.map(|corner| bound.fitted_m[corner as usize]),
                [r, g, b],
            )
        })
        .collect();
    // Whatever way the avatar looks, its front is drawn first.
    let ahead_m = bound.ahead;
    let left = Vec3::Y.cross(ahead_m);
    let mut triangles = Vec::new();
    let mut shift = 0.0;
    for (figure, is_back) in [
        (&distance, false),
        (&distance, true),
        (&fitted, false),
        (&coverage, false),
        (&coverage, true),
    ] {
        let sign = if is_back { -1.0 } else { 1.0 };
        let seen = |at: Vec3| [sign * at.dot(left), at.y, sign * at.dot(ahead_m)];
        let across = figure
            .iter()
            .flat_map(|(corners, _)| corners.map(|at| seen(at)[0]));
        let (low, high) = across.fold((f32::MAX, f32::MIN), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let width = (high - low).max(0.0);
        for (corners, colour) in figure {
            let corners = corners.map(|at| {
                let [x, y, z] = seen(at);
                [x - low + shift, y, z]
            });
            triangles.push(Triangle {
                corners,
                colour: *colour,
            });
        }
        shift += (1.0 + ROOM) * width;
    }
    Picture {
        size: (2_000, 640),
        triangles,
        window: None,
    }
}
