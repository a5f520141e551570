//! How long binding takes, on one thread: `cargo bench -p dynaskin-bind`.
//!
//! Made avatars, so that it runs everywhere: a fine mesh in a suit, and one of about 7,000 vertices.

// It prints what it measures.
#![allow(clippy::print_stdout)]

use std::path::PathBuf;
use std::time::{Duration, Instant};

use dynaskin_avatars::{RECIPES, make};
use dynaskin_bind::{Avatar, BindError, BindOptions, Binding, bind};
use dynaskin_body::BodyModel;

const ROUNDS: usize = 9;

/// The median of some rounds, in milliseconds.
fn median_ms<T>(run: impl Fn() -> Result<T, BindError>) -> Result<f64, BindError> {
    let mut times: Vec<Duration> = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let start = Instant::now();
        run()?;
        times.push(start.elapsed());
    }
    times.sort();
    Ok(1e3 * times[ROUNDS / 2].as_secs_f64())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb");
    let body = BodyModel::from_glb(&std::fs::read(path)?)?;
    for recipe in RECIPES
        .iter()
        .filter(|recipe| recipe.fine || recipe.name == "mixamo-t")
    {
        let bytes = make(&body, recipe).bytes;
        let avatar = Avatar::from_glb(&bytes)?;
        let bound = bind(&avatar, &body, &BindOptions::adult())?;
        let stored = bound.binding.to_bytes();
        let read_ms = median_ms(|| Avatar::from_glb(&bytes))?;
        let bind_ms = median_ms(|| bind(&avatar, &body, &BindOptions::adult()))?;
        let load_ms = median_ms(|| Ok(Binding::from_bytes(&stored, &body)?))?;
        println!(
            "{}: {} vertices, {} move; read {read_ms:.0} ms, bound {bind_ms:.0} ms, stored {} bytes, loaded {load_ms:.1} ms",
            recipe.name,
            avatar.vertex_count(),
            bound.binding.report.moving,
            stored.len(),
        );
    }
    Ok(())
}
