//! The bundles of a comparison.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use dynaskin_evaluate::{Method, Player};
use dynaskin_runtime::Bundle;
use dynaskin_train::{Split, TrainError};

/// A bundle with its networks.
pub struct Found {
    /// Its method's name, or its folder's: `casas-otaduy`.
    pub name: String,
    /// Name for people.
    pub label: String,
    /// Where it lies.
    pub folder: PathBuf,
    /// Its networks.
    pub player: Player,
    /// What it says about itself.
    pub bundle: Bundle,
}

/// What a bundle was trained without.
pub fn stored_split(bundle: &Bundle) -> anyhow::Result<Split> {
    let stored = bundle.training.get("split");
    let stored = stored.context("`bundle.json` has no `training.split`")?;
    Ok(serde_json::from_value(stored.clone())?)
}

/// The bundle under evaluation itself.
pub fn own(folder: &Path, player: Player, bundle: Bundle) -> Found {
    let method = method_of(&bundle).unwrap_or(Method::Dynaskin);
    Found {
        name: method.name().to_owned(),
        label: method.label().to_owned(),
        folder: folder.to_owned(),
        player,
        bundle,
    }
}

fn method_of(bundle: &Bundle) -> Option<Method> {
    Method::from_name(bundle.training.get("method")?.as_str()?)
}

/// The networks of the bundle in a folder, and its `bundle.json`. An error names the folder or the file.
pub fn load(folder: &Path) -> anyhow::Result<(Player, Bundle)> {
    Player::load(folder).map_err(|error| match error {
        TrainError::Io { .. } => error.into(),
        other => anyhow::Error::from(other).context(folder.display().to_string()),
    })
}

/// The bundles in the folders of `folder`, in the order of the methods. They have to belong to the
/// body and the vertices of `reference`, and may not have learned from what `split` holds out.
pub fn others(
    folder: Option<&Path>,
    reference: &Bundle,
    split: &Split,
) -> anyhow::Result<Vec<Found>> {
    let mut found: Vec<(usize, Found)> = Vec::new();
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    let entries = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()));
    for entry in entries? {
        let path = entry?.path();
        if !path.join("bundle.json").is_file() {
            continue;
        }
        let (player, bundle) = load(&path)?;
        let place = path.display();
        if bundle.body.sha256 != reference.body.sha256 {
            bail!("{place} belongs to another body: train it again, or take it away");
        }
        if bundle.vertices != reference.vertices {
            bail!("{place} moves other vertices: train it on the same data, or take it away");
        }
        let learned_without = stored_split(&bundle).with_context(|| format!("{place}"))?;
        let same = |a: &Split, b: &Split| {
            let parts = |s: &Split| {
                [&s.test_subjects, &s.test_trials, &s.test_shapes].map(|names| {
                    let mut names = names.clone();
                    names.sort();
                    names
                })
            };
            parts(a) == parts(b)
        };
        if !same(&learned_without, split) {
            bail!(
                "{place} was trained with another split, so it may have seen what is held out here; \
                 train it with the same --split, or take it away"
            );
        }
        let method = method_of(&bundle);
        let name = path.file_name().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        let rank = Method::ALL.iter().position(|m| Some(*m) == method);
        found.push((
            rank.unwrap_or(Method::ALL.len()),
            Found {
                label: method.map_or_else(|| name.clone(), |m| m.label().to_owned()),
                name,
                folder: path,
                player,
                bundle,
            },
        ));
    }
    found.sort_by(|a, b| (a.0, &a.1.name).cmp(&(b.0, &b.1.name)));
    Ok(found.into_iter().map(|(_, found)| found).collect())
}
