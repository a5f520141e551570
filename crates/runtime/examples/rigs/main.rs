//! What rigs that turn their collars do to the tissue: the networks against the simulator, error over
//! static, on motions re-posed through rigs of several habits, and on held poses.
//!
//! `cargo run --release -p dynaskin-runtime --example rigs -- [--kept FOLDER] [--seconds S] CLIP.bvh...`
//! `npm run bench:rigs` calls it with captures that the networks did not learn from.

#![allow(clippy::print_stdout)] // It prints tables.

mod measure;
mod truth;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_sim::CollarHabit;

use measure::{Network, Off};
use truth::{Simulator, held, middle};

/// The habits of rigs: as the motion has its collars, none at all, and what the collars of real files do in the median while arms hang.
const RIGS: [(&str, Option<(f64, f64)>); 5] = [
    ("as made", None),
    ("collars still (CMU)", Some((0.0, 0.0))),
    ("Mixamo-like", Some((0.28, 0.0))),
    ("SMPL-like", Some((0.2, 0.0))),
    ("Xsens-like", Some((0.1, 0.15))),
];

/// By how many degrees both collars are lowered in a held pose.
const LOWERED_DEGREES: [f64; 4] = [10.0, 20.0, 30.0, 40.0];

fn main() -> Result<()> {
    let (mut kept, mut seconds, mut files) = (None, 3.0, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || {
            words
                .next()
                .with_context(|| format!("{word} needs a value"))
        };
        match word.as_str() {
            "--kept" => kept = Some(PathBuf::from(value()?)),
            "--seconds" => seconds = value()?.parse()?,
            word if word.starts_with('-') => bail!("unknown option {word}"),
            path => files.push(PathBuf::from(path)),
        }
    }
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models/female");
    let simulator = Simulator::new(&folder, kept)?;
    let mut network = Network::new(&folder)?;
    let motions = motions(&simulator, &files, seconds)?;
    println!(
        "| motion | rig | soft | chest | upper arms | static, mm |\n|---|---|--:|--:|--:|--:|"
    );
    for (rig, habit) in RIGS {
        let mut all = Off::default();
        for motion in &motions {
            let clip = match habit {
                Some((share, lowered)) => {
                    CollarHabit { share, lowered }.applied(motion, simulator.joints_rest_m())
                }
                None => motion.clone(),
            };
            let truth = simulator.offsets(&clip)?;
            let off = network.off(&clip, &truth, &simulator)?;
            print_row(&motion.name, rig, &off);
            all.add(&off);
        }
        print_row("**all**", rig, &all);
    }
    println!("\n| both collars lowered by, degrees | chest, mm | simulator, mm |\n|--:|--:|--:|");
    for degrees in LOWERED_DEGREES {
        let clip = held(degrees.to_radians());
        let truth = simulator.offsets(&clip)?;
        let [shown, simulated] = network.resting_chest_mm(&clip, &truth, &simulator)?;
        println!("| {degrees} | {shown:.2} | {simulated:.2} |");
    }
    Ok(())
}

fn motions(simulator: &Simulator, files: &[PathBuf], seconds: f64) -> Result<Vec<Clip>> {
    let joints_rest_m = simulator.joints_rest_m();
    let mut motions = Vec::new();
    for kind in [
        ProceduralKind::Walk,
        ProceduralKind::RunInPlace,
        ProceduralKind::Hop,
        ProceduralKind::JumpingJacks,
    ] {
        let mut motion = Procedural::new(kind);
        motion.duration_seconds = seconds + 2.0;
        let mut clip = motion.clip(joints_rest_m)?;
        clip.name = kind.name().to_owned();
        motions.push(middle(clip, seconds));
    }
    for file in files {
        motions.push(middle(truth::capture(file, joints_rest_m)?, seconds));
    }
    Ok(motions)
}

fn print_row(motion: &str, rig: &str, off: &Off) {
    let [soft, chest, arms] = off.ratios();
    let still_mm = off.static_mm();
    println!("| {motion} | {rig} | {soft:.2} | {chest:.2} | {arms:.2} | {still_mm:.1} |");
}
