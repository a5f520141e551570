//! `dynaskin body import`: a SMPL-family body of one's own as a body of this project's format.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_bind::{BindOptions, Transfer, check_adult, transfer};
use dynaskin_body::{BodyModel, Joint, SHAPE_COUNT, Sex, SmplFile, SmplLayout, volume_m3};
use glam::Vec3;

use super::say;
use super::train::glb_body;

const EXAMPLES: &str = "\
Examples:
  dynaskin body import smpl.npz --out data/mine --sex female --depicts adult";

/// Arguments of `dynaskin body import`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ImportArgs {
    /// The body as .npz, in the layout of SMPL, SMPL-H or SMPL-X.
    file: PathBuf,
    /// Folder to write body.glb into.
    #[arg(long)]
    out: PathBuf,
    /// What the body depicts. Soft tissue is for adults only: anything but `adult` is refused.
    #[arg(long)]
    depicts: Option<String>,
    /// The default body whose soft regions and tissue thickness are transferred by surface.
    #[arg(long, value_enum, required_unless_present = "no_regions")]
    sex: Option<Lender>,
    /// Leave out regions and thickness: the soft vertices then come from captures only.
    #[arg(long, conflicts_with = "sex")]
    no_regions: bool,
    /// Folder of the default bodies.
    #[arg(long, default_value = "models")]
    models: PathBuf,
    /// Import a file without `posedirs`, or leave them out.
    #[arg(long)]
    no_pose_correctives: bool,
    /// Replace an existing body.glb.
    #[arg(long)]
    overwrite: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Lender {
    Female,
    Male,
}

impl Lender {
    const fn sex(self) -> Sex {
        match self {
            Self::Female => Sex::Female,
            Self::Male => Sex::Male,
        }
    }
}

/// Runs the command.
pub fn run(args: &ImportArgs) -> anyhow::Result<()> {
    let path = args.out.join("body.glb");
    if path.exists() && !args.overwrite {
        bail!(
            "{} is there already; give another --out, or --overwrite",
            path.display()
        );
    }
    let file = args.file.display().to_string();
    let (body, note) = imported(args).with_context(|| file.clone())?;
    let glb = body.to_glb().with_context(|| file)?;
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    dynaskin_files::replace(&path, &glb)?;
    note.iter().for_each(|line| say(line));
    say(&format!(
        "{}: {} bytes, under the licence of {}",
        path.display(),
        glb.len(),
        args.file.display()
    ));
    Ok(())
}

/// The body, and what is to be told of it.
fn imported(args: &ImportArgs) -> anyhow::Result<(BodyModel, Vec<String>)> {
    let bytes = fs::read(&args.file).context("cannot read the file")?;
    let (mut body, found) = BodyModel::read_smpl_npz(&bytes)?;
    if found.pose_dir_count == 0 && !args.no_pose_correctives {
        bail!(
            "it has no `posedirs`, without which elbows and knees of a SMPL body look wrong; \
             export them, or import it without by --no-pose-correctives"
        );
    }
    if args.no_pose_correctives {
        body.pose_dirs_m.clear();
    }
    check_surface(&body)?;
    let stem = args.file.file_stem().unwrap_or_default();
    body.name = stem.to_string_lossy().into_owned();
    body.copyright = format!(
        "as {} is licensed, which it was imported from",
        args.file.file_name().unwrap_or_default().to_string_lossy()
    );
    let mut note = described(&body, &found);
    let options = BindOptions {
        depicts: args.depicts.clone(),
        bones: Vec::new(),
    };
    match args.sex {
        Some(lender) => {
            let sex = lender.sex();
            let lending = lending_body(&args.models, sex)?;
            let taken = transfer(&body, &lending, &options)?;
            note.extend(lent(sex, &taken));
            body.region_weights = taken.region_weights;
            body.thickness_template_m = taken.thickness_m;
            body.thickness_shape_dirs_m = vec![vec![0.0; body.vertex_count()]; SHAPE_COUNT];
        }
        None => {
            check_adult(&body, &options)?;
            note.push("without soft regions and tissue thickness".to_owned());
        }
    }
    Ok((body, note))
}

/// Longest extents of people, with room for those of cartoons, in metres.
const SIZES_M: std::ops::RangeInclusive<f32> = 0.4..=3.0;
/// How upright a trunk is at least that stands, as the cosine: 45 degrees.
const UPRIGHT: f32 = 0.7;

/// Refuses a surface of another unit, and one that is turned inside out.
fn check_surface(body: &BodyModel) -> anyhow::Result<()> {
    let places_m = || body.template_m.iter().copied();
    let low_m = places_m().fold(Vec3::INFINITY, Vec3::min);
    let size_m = (places_m().fold(Vec3::NEG_INFINITY, Vec3::max) - low_m).max_element();
    if !SIZES_M.contains(&size_m) {
        bail!(
            "array `v_template`: the body would be {size_m:.1} m large; its numbers, and those of `shapedirs` and \
             `posedirs`, must be metres: divide centimetres by 100 and millimetres by 1000"
        );
    }
    let [pelvis_m, neck_m] =
        [Joint::Pelvis, Joint::Neck].map(|joint| body.joint_template_m[joint as usize]);
    let trunk = (neck_m - pelvis_m).normalize_or_zero();
    if trunk.y < UPRIGHT {
        bail!(
            "array `v_template`: the trunk stands along {trunk:.1}, not along +y; turn all arrays of positions, \
             so that y is up"
        );
    }
    if body.faces.is_empty() {
        bail!("array `f`: there are no faces; export the body with them");
    }
    if volume_m3(&body.template_m, &body.faces) < 0.0 {
        bail!(
            "array `f`: the faces look inwards; turn them round with `f[:, ::-1]`, or turn the sign of one \
             coordinate of all arrays where the body is mirrored"
        );
    }
    Ok(())
}

fn lending_body(models: &Path, sex: Sex) -> anyhow::Result<BodyModel> {
    let path = models.join(sex.name()).join("body.glb");
    let bytes = fs::read(&path).with_context(|| {
        format!(
            "cannot read {}; name the folder of the default bodies with --models",
            path.display()
        )
    })?;
    glb_body(&path, &bytes)
}

/// What the file held, and what of it was kept.
fn described(body: &BodyModel, found: &SmplFile) -> Vec<String> {
    let kept = |count: usize, kept: usize| match count.min(kept) {
        kept if kept == count => count.to_string(),
        kept => format!("{count} ({kept} kept)"),
    };
    let shared = match found.layout {
        SmplLayout::Smpl => body.pose_dirs_m.len(),
        // Those of the 21 joints that all layouts share.
        SmplLayout::SmplH | SmplLayout::SmplX => body.pose_dirs_m.len().min(9 * 21),
    };
    let mut note = vec![format!(
        "{}: {} vertices, {} triangles, {} joints, shape coefficients: {}, fields of pose correctives: {}",
        found.layout.name(),
        body.vertex_count(),
        body.faces.len(),
        found.layout.joint_count(),
        kept(found.shape_count, SHAPE_COUNT),
        kept(found.pose_dir_count, shared),
    )];
    if found.has_sparse_regressor {
        note.push("the joint regressor is a sparse matrix's fields".to_owned());
    }
    for (joint, count) in &found.folded {
        note.push(format!("{count} joints became part of {}", joint.name()));
    }
    note
}

/// What was taken over.
fn lent(sex: Sex, taken: &Transfer) -> Vec<String> {
    let vertex_count = taken.thickness_m.len();
    let is_soft = |vertex: &usize| {
        taken
            .region_weights
            .iter()
            .any(|region| region[*vertex] > 0.0)
    };
    let soft = (0..vertex_count).filter(is_soft).count();
    let shape: Vec<String> = taken
        .shape
        .iter()
        .map(|beta| format!("{beta:.1}"))
        .collect();
    let mut note = vec![
        format!(
            "regions and thickness by surface from the {} body, whose shape {} and size {:.2} lie closest: \
             {:.1} % within 2 cm, median {:.1} mm",
            sex.name(),
            shape.join(" "),
            taken.size,
            100.0 * taken.share_close,
            1e3 * taken.median_m
        ),
        format!(
            "{soft} of {vertex_count} vertices are soft; thickness is that of the average shape"
        ),
    ];
    for off in &taken.regions_off {
        note.push(format!("{} stays still: {}", off.region, off.reason));
    }
    note
}

#[cfg(test)]
#[path = "body_import_tests.rs"]
mod tests;
