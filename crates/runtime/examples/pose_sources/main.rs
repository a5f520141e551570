//! What the source of poses does to the tissue: the error of the offsets over that of plain skinning, against
//! the same network under the true poses, at the best alignment in time, for each source and preset.
//!
//! `cargo run --release -p dynaskin-runtime --example pose_sources -- [--only WORDS] [--preset NAME] [--seconds S] CLIP.bvh...`
//! `npm run bench:sources` calls it with the captures that the networks did not learn from.

#![allow(clippy::print_stdout)] // It prints a table.

mod cost;
mod limits;
mod measure;
mod table;
mod truths;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use dynaskin_motion::ProceduralKind;
use dynaskin_pose_sources::Truth;
use dynaskin_runtime::{Avatar, Model, PoseSource};

use measure::{Played, Reference, played};
use table::{Row, SOURCES};

/// Of the procedural motions, those that the networks did not learn from.
const UNSEEN: [ProceduralKind; 3] = [
    ProceduralKind::JumpingJacks,
    ProceduralKind::OneLegHop,
    ProceduralKind::RunInPlace,
];

/// What each source is tried with; the first is how it was without conditioning.
const PRESETS: [PoseSource; 4] = [
    PoseSource::AsGiven,
    PoseSource::Display,
    PoseSource::Tracker,
    PoseSource::Network,
];

struct Options {
    only: String,
    preset: String,
    limits: bool,
    seconds: f64,
    clips: Vec<PathBuf>,
}

fn options() -> Result<Options> {
    let mut options = Options {
        only: String::new(),
        preset: String::new(),
        limits: false,
        seconds: 4.0,
        clips: Vec::new(),
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || {
            words
                .next()
                .with_context(|| format!("{word} needs a value"))
        };
        match word.as_str() {
            "--only" => options.only = value()?,
            "--limits" => options.limits = true,
            "--preset" => options.preset = value()?,
            "--seconds" => options.seconds = value()?.parse()?,
            word if word.starts_with('-') => bail!("unknown option {word}"),
            path => options.clips.push(path.into()),
        }
    }
    Ok(options)
}

fn model() -> Result<Arc<Model>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models/female");
    let mut read = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let bundle = read("bundle.json").map_err(anyhow::Error::msg)?;
    Ok(Arc::new(Model::load(&bundle, &mut read)?))
}

/// All clips of one kind under one preset.
fn sum(parts: &[Played]) -> Played {
    let count = parts.len().max(1) as f64;
    let mean = |of: fn(&Played) -> f64| parts.iter().map(of).sum::<f64>() / count;
    Played {
        off: parts.iter().map(|part| part.off).sum(),
        size: parts.iter().map(|part| part.size).sum(),
        latency: mean(|part| part.latency),
        said_latency: mean(|part| part.said_latency),
        false_cuts: parts.iter().map(|part| part.false_cuts).sum(),
        moved_mm: mean(|part| part.moved_mm),
        most_mm: parts.iter().map(|part| part.most_mm).fold(0.0, f64::max),
    }
}

/// What a step costs with conditioning, over what it costs without.
fn print_costs(model: &Arc<Model>, motions: &[(bool, Truth)]) -> Result<()> {
    println!("| a step | without, ms | with, ms | ratio (goal 1.05) |\n|---|--:|--:|--:|");
    for (name, preset) in [
        ("60 Hz, a new pose in every frame", PoseSource::Display),
        ("30 Hz held", PoseSource::Display),
        ("30 Hz held", PoseSource::Network),
        ("30 Hz held", PoseSource::Tracker),
    ] {
        let source = SOURCES.iter().find(|(source, _)| source.name == name);
        if let (Some((source, _)), Some((_, truth))) = (source, motions.last()) {
            let [with, without] = cost::seconds(model, preset, &source.frames(truth, 1))?;
            let (preset, ratio) = (table::name(preset), with / without);
            println!(
                "| {name}, {preset} | {:.4} | {:.4} | {ratio:.3} |",
                1e3 * without,
                1e3 * with
            );
        }
    }
    println!();
    Ok(())
}

fn main() -> Result<()> {
    let options = options()?;
    let model = model()?;
    let joints_rest_m = *Avatar::new(Arc::clone(&model), &[0.0; 10])?.joints_rest_m();
    if options.limits {
        return limits::print(&options.clips, &joints_rest_m);
    }
    let mut motions = Vec::new();
    for path in &options.clips {
        motions.push((
            true,
            truths::capture(path, &joints_rest_m, options.seconds)?,
        ));
    }
    for kind in UNSEEN {
        motions.push((
            false,
            truths::procedural(kind, &joints_rest_m, options.seconds)?,
        ));
    }
    let references = motions
        .iter()
        .map(|(_, truth)| Reference::new(&model, truth));
    let references: Vec<Reference> = references.collect::<Result<_>>()?;
    let standing = truths::standing(&joints_rest_m, 2.0 * options.seconds)?;
    let clips: Vec<String> = motions
        .iter()
        .map(|(_, truth)| format!("{} ({:.1} s)", truth.name, truth.seconds))
        .collect();
    println!("Clips: {}.\n", clips.join(", "));
    if options.preset.is_empty() {
        print_costs(&model, &motions)?;
    }
    println!("{}", table::HEAD);
    for (source, goal) in SOURCES {
        if !options.only.is_empty() && !source.name.contains(&options.only) {
            continue;
        }
        for preset in PRESETS {
            if !table::name(preset).contains(&options.preset) {
                continue;
            }
            let mut parts: [Vec<Played>; 3] = Default::default();
            for (idx, (captured, truth)) in motions.iter().enumerate() {
                let frames = source.frames(truth, idx as u64);
                let one = played(&model, preset, &frames, Some(&references[idx]))?;
                parts[usize::from(!captured)].push(one);
            }
            if table::stands(&source) {
                let frames = source.frames(&standing, 77);
                parts[2].push(played(&model, preset, &frames, None)?);
            }
            let [captures, procedural, standing] = parts.map(|parts| sum(&parts));
            let row = Row {
                source,
                goal,
                preset,
                captures,
                procedural,
                standing,
            };
            println!("{row}");
        }
    }
    Ok(())
}
