//! What a run leaves for the next one: its settings, and the shapes of the people.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use dynaskin_body::SHAPE_COUNT;
use dynaskin_files::replace;
use serde_json::{Value, json};

/// The shape of a person, and where it is from.
#[derive(Clone, Debug)]
pub struct PersonShape {
    pub shape: [f32; SHAPE_COUNT],
    /// The sequence that it was fitted to, and by how many degrees its joints are turned from rest in the
    /// first frame; none where it was given.
    pub source: Option<(String, f64)>,
}

/// The shapes of people by their names.
#[derive(Clone, Debug, Default)]
pub struct Shapes(BTreeMap<String, PersonShape>);

impl Shapes {
    /// Those of runs before, in their folder.
    pub fn read(out: &Path) -> anyhow::Result<Self> {
        let path = path(out);
        let Some(text) = read(&path)? else {
            return Ok(Self::default());
        };
        parse(&text).map(Self).with_context(|| {
            format!(
                "{} is not what a run before wrote; remove it to find shapes again",
                path.display()
            )
        })
    }

    /// Writes them into the folder.
    pub fn write(&self, out: &Path) -> anyhow::Result<()> {
        let people: serde_json::Map<String, Value> = self
            .0
            .iter()
            .map(|(person, found)| {
                let source = found.source.as_ref();
                let value = json!({
                    "shape": found.shape,
                    "sequence": source.map(|(name, _)| name),
                    "degreesFromRest": source.map(|(_, degrees)| degrees),
                });
                (person.clone(), value)
            })
            .collect();
        let text = serde_json::to_string_pretty(&people)?;
        Ok(replace(&path(out), text.as_bytes())?)
    }

    pub fn has(&self, person: &str) -> bool {
        self.0.contains_key(person)
    }

    pub fn of(&self, person: &str) -> Option<[f32; SHAPE_COUNT]> {
        self.0.get(person).map(|found| found.shape)
    }

    pub fn people(&self) -> impl Iterator<Item = (&String, &PersonShape)> {
        self.0.iter()
    }

    /// A shape from the command line; another one than a run before had is refused.
    pub fn give(&mut self, person: &str, shape: [f32; SHAPE_COUNT]) -> anyhow::Result<()> {
        let known = self.of(person);
        if known.is_some_and(|known| known != shape) {
            bail!(
                "{person} has another shape in the folder's people.json; choose another --out, so that \
                 fits of two shapes do not mix"
            );
        }
        if known.is_none() {
            let source = None;
            self.0
                .insert(person.to_owned(), PersonShape { shape, source });
        }
        Ok(())
    }

    /// A shape that was fitted.
    pub fn found(&mut self, person: &str, name: &str, degrees: f64, shape: [f32; SHAPE_COUNT]) {
        let source = Some((name.to_owned(), degrees));
        self.0
            .insert(person.to_owned(), PersonShape { shape, source });
    }
}

fn path(out: &Path) -> PathBuf {
    out.join("people.json")
}

fn parse(text: &str) -> anyhow::Result<BTreeMap<String, PersonShape>> {
    let people: BTreeMap<String, Value> = serde_json::from_str(text)?;
    people
        .into_iter()
        .map(|(person, value)| {
            let betas = value["shape"].as_array().context("no shape")?;
            let betas: Option<Vec<f32>> = betas
                .iter()
                .map(|beta| beta.as_f64().map(|beta| beta as f32))
                .collect();
            let shape = <[f32; SHAPE_COUNT]>::try_from(betas.context("a shape of no numbers")?)
                .ok()
                .context("a shape of another length")?;
            let source = value["sequence"].as_str().map(|name| {
                let degrees = value["degreesFromRest"].as_f64().unwrap_or_default();
                (name.to_owned(), degrees)
            });
            Ok((person, PersonShape { shape, source }))
        })
        .collect()
}

/// Keeps the settings of a folder's first run, and refuses others.
pub fn check_settings(out: &Path, settings: &str) -> anyhow::Result<()> {
    let path = out.join("settings.txt");
    match read(&path)? {
        None => Ok(replace(&path, settings.as_bytes())?),
        Some(before) if before == settings => Ok(()),
        Some(before) => bail!(
            "{} has fits of other settings; choose another --out, or the settings of before: {before}",
            out.display()
        ),
    }
}

fn read(path: &Path) -> anyhow::Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
    }
}

/// Removes what a killed run left half written. The folder is locked: nobody else writes there.
pub fn remove_half_written(out: &Path) {
    let Ok(entries) = fs::read_dir(out) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.contains(".npz.") && name.ends_with(".part") {
            // One that cannot be removed only takes space.
            let _ = fs::remove_file(&path);
        }
    }
}
