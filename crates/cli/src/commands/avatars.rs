//! `dynaskin avatars`: avatars whose soft tissue is known, to test binding with.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_avatars::{Container, EXAMPLES, RECIPES, Recipe, make};

use super::say;
use super::train::glb_body;

const HOW: &str = "\
Examples:
  dynaskin avatars --body models/female/body.glb --out avatars
  dynaskin avatars --body models/female/body.glb --only runner --out avatars";

/// Arguments of `dynaskin avatars`.
#[derive(Debug, Args)]
#[command(after_help = HOW)]
pub struct AvatarsArgs {
    /// The body that the avatars are made from.
    #[arg(long)]
    body: PathBuf,
    /// Folder to write the avatars into.
    #[arg(long)]
    out: PathBuf,
    /// Only the avatar of this name. `runner` and `lifter`, dressed to be shown, are written by name alone.
    #[arg(long)]
    only: Option<String>,
}

/// Runs the command.
pub fn run(args: &AvatarsArgs) -> anyhow::Result<()> {
    let bytes =
        fs::read(&args.body).with_context(|| format!("cannot read {}", args.body.display()))?;
    let body = glb_body(&args.body, &bytes)?;
    let wanted: Vec<&Recipe> = match args.only.as_deref() {
        None => RECIPES.iter().collect(),
        Some(only) => every().filter(|recipe| recipe.name == only).collect(),
    };
    if wanted.is_empty() {
        let names: Vec<&str> = every().map(|recipe| recipe.name).collect();
        bail!(
            "there is no avatar of that name; there are {}",
            names.join(", ")
        );
    }
    fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    for recipe in wanted {
        let made = make(&body, recipe);
        let ending = match recipe.container {
            Container::Glb => "glb",
            Container::Vrm0 | Container::Vrm1 => "vrm",
        };
        let path = args.out.join(format!("{}.{ending}", recipe.name));
        dynaskin_files::replace(&path, &made.bytes)?;
        let vertices: usize = made.truth.iter().map(|mesh| mesh.sources.len()).sum();
        let meshes = made.truth.len();
        say(&format!(
            "{}: {meshes} meshes, {vertices} vertices, {} bytes",
            path.display(),
            made.bytes.len()
        ));
    }
    Ok(())
}

fn every() -> impl Iterator<Item = &'static Recipe> {
    RECIPES.iter().chain(&EXAMPLES)
}
