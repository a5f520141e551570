//! `dynaskin slim`: a bundle's networks as files that `dynaskin/slim` plays.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_body::BodyModel;
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::features::{Materials, clip_features};
use dynaskin_runtime::{Bundle, BundleFile, Comparison, LoweredFiles, LoweredNetworks, lower};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use super::say;

const BUNDLE_FILE: &str = "bundle.json";

/// Ticks for which lowered networks are played beside tract.
const TICKS: usize = 2_000;

/// Ticks for which one body stays.
const TICKS_PER_BODY: usize = 100;

/// Largest difference of an offset from tract's, in metres.
const TOLERANCE_M: f32 = 1e-6;

const EXAMPLES: &str = "\
Examples:
  dynaskin slim models/female models/male";

/// Arguments of `dynaskin slim`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SlimArgs {
    /// Folders of bundles. Each gets two more files, which its bundle.json names.
    #[arg(required = true)]
    bundles: Vec<PathBuf>,
    /// The body, if it is not beside bundle.json.
    #[arg(long)]
    body: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &SlimArgs) -> anyhow::Result<()> {
    for folder in &args.bundles {
        slim(folder, args.body.as_deref())
            .with_context(|| format!("{} stays as it was", folder.display()))?;
    }
    Ok(())
}

fn slim(folder: &Path, body: Option<&Path>) -> anyhow::Result<()> {
    let read =
        |path: &Path| fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let bundle_file = folder.join(BUNDLE_FILE);
    let named = || bundle_file.display().to_string();
    let mut bundle = Bundle::from_json(&read(&bundle_file)?).with_context(named)?;
    let predictor_onnx = read(&folder.join(&bundle.predictor.file))?;
    let decoder_onnx = read(&folder.join(&bundle.decoder.file))?;
    let body_file = body.map_or_else(|| folder.join(&bundle.body.file), Path::to_owned);
    let body_glb = read(&body_file)?;
    bundle
        .body
        .verify(&body_glb)
        .with_context(|| body_file.display().to_string())?;
    let body = BodyModel::from_glb(&body_glb).with_context(|| body_file.display().to_string())?;
    let lowered = lower(&bundle, &predictor_onnx, &decoder_onnx).with_context(named)?;
    let ticks = random_ticks(&bundle, &body)?;
    let comparison = lowered.compare(&predictor_onnx, &decoder_onnx, ticks)?;
    check(&comparison)?;
    write(folder, &mut bundle, &lowered)?;
    tell(folder, &bundle, &lowered, &comparison);
    Ok(())
}

/// Ticks of real motions in random order, scaled at random, on random bodies.
fn random_ticks(
    bundle: &Bundle,
    body: &BodyModel,
) -> anyhow::Result<impl Iterator<Item = Vec<f32>>> {
    let kind = bundle.feature_kind;
    let shape = [0.0; 10];
    let joints_m = body.shaped(&shape).joints_m;
    let mut ticks: Vec<Vec<f32>> = Vec::new();
    for motion in [
        ProceduralKind::Hop,
        ProceduralKind::Walk,
        ProceduralKind::JumpingJacks,
    ] {
        let clip = Procedural::new(motion).clip(&joints_m)?;
        let materials = Materials::default();
        let (frames, rate_hz) = (&clip.frames, clip.rate_hz);
        let numbers = clip_features(kind, frames, rate_hz, &joints_m, &shape, &materials)?;
        ticks.extend(numbers.chunks(kind.count()).map(<[f32]>::to_vec));
    }
    let mut rng = Pcg64Mcg::seed_from_u64(19);
    let mut conditions = vec![0.0; kind.condition_count()];
    Ok((0..TICKS).map(move |tick| {
        if tick % TICKS_PER_BODY == 0 {
            conditions.fill_with(|| rng.random_range(-1.5..1.5));
        }
        let mut features = ticks[rng.random_range(0..ticks.len())].clone();
        let scale = rng.random_range(0.5..1.2);
        let (motion, about_body) = features.split_at_mut(kind.motion_count());
        motion.iter_mut().for_each(|number| *number *= scale);
        about_body.copy_from_slice(&conditions);
        features
    }))
}

fn check(comparison: &Comparison) -> anyhow::Result<()> {
    let Comparison {
        ticks,
        largest_difference_m,
        largest_offset_m,
    } = *comparison;
    // NaN is in no order.
    if largest_difference_m <= TOLERANCE_M && ticks > 0 {
        return Ok(());
    }
    bail!(
        "the lowered networks differ from tract by {largest_difference_m:.1e} m (largest offset \
         {largest_offset_m:.3} m), more than {TOLERANCE_M:.0e} m: play this bundle with the whole core"
    )
}

/// Writes the files; `bundle.json` comes last.
fn write(folder: &Path, bundle: &mut Bundle, lowered: &LoweredNetworks) -> anyhow::Result<()> {
    let name = |onnx: &BundleFile| {
        let stem = onnx.file.strip_suffix(".onnx").unwrap_or(&onnx.file);
        format!("{stem}.lowered")
    };
    let files = LoweredFiles {
        predictor: BundleFile::of(&name(&bundle.predictor), &lowered.predictor),
        decoder: BundleFile::of(&name(&bundle.decoder), &lowered.decoder),
    };
    let paths = [&files.predictor, &files.decoder].map(|file| folder.join(&file.file));
    bundle.lowered = Some(files);
    let json = bundle.to_json()?;
    let bundle_file = folder.join(BUNDLE_FILE);
    dynaskin_files::replace_all(&[
        (&paths[0], &lowered.predictor),
        (&paths[1], &lowered.decoder),
        (&bundle_file, json.as_bytes()),
    ])?;
    Ok(())
}

fn tell(folder: &Path, bundle: &Bundle, lowered: &LoweredNetworks, comparison: &Comparison) {
    let Comparison {
        ticks,
        largest_difference_m,
        largest_offset_m,
    } = *comparison;
    if let Some(files) = &bundle.lowered {
        for (file, bytes) in [
            (&files.predictor, &lowered.predictor),
            (&files.decoder, &lowered.decoder),
        ] {
            say(&format!(
                "{}: {} bytes",
                folder.join(&file.file).display(),
                bytes.len()
            ));
        }
    }
    say(&format!(
        "{}: {ticks} random ticks beside tract: off by {largest_difference_m:.1e} m at most, of offsets up \
         to {largest_offset_m:.3} m",
        bundle.name,
    ));
}
