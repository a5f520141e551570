//! What a run leaves for the next one: its settings, and the shapes of the people.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context as _, bail};
use dynaskin_body::{JOINT_COUNT, SHAPE_COUNT};
use dynaskin_files::write_first;
use glam::Vec3;
use serde_json::{Value, json};

/// The shape and the joints of a person, and where they are from.
#[derive(Clone, Debug)]
pub struct PersonShape {
    pub shape: [f32; SHAPE_COUNT],
    /// How far the joints lie from where the shape puts them, in metres in the rest pose, `[joint]`.
    pub joint_offsets_m: [Vec3; JOINT_COUNT],
    /// The sequence that it was fitted to, and by how many degrees its joints are turned from rest in the
    /// first frame; none where it was given.
    pub source: Option<(String, f64)>,
}

/// The shapes of people by their names.
#[derive(Clone, Debug, Default)]
pub struct Shapes(BTreeMap<String, PersonShape>);

impl Shapes {
    /// Those that are in a folder, a file a person in `people`.
    pub fn read(out: &Path) -> anyhow::Result<Self> {
        let people = out.join("people");
        let entries = match fs::read_dir(&people) {
            Ok(entries) => entries,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => {
                return Err(error).with_context(|| format!("cannot list {}", people.display()));
            }
        };
        let mut shapes = Self::default();
        for entry in entries {
            let path = entry
                .with_context(|| format!("cannot list {}", people.display()))?
                .path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            // Others are being written.
            if let Some(person) = name.strip_suffix(".json") {
                let found = read_person(&path)?;
                shapes.0.insert(person.to_owned(), found);
            }
        }
        Ok(shapes)
    }

    /// Writes the shape of a person into the folder. Where another part of the work was first, its shape is
    /// taken instead, so that all sequences of a person have one.
    pub fn keep(&mut self, out: &Path, person: &str, found: PersonShape) -> anyhow::Result<()> {
        let people = out.join("people");
        fs::create_dir_all(&people).with_context(|| format!("cannot make {}", people.display()))?;
        let path = people.join(format!("{person}.json"));
        let source = found.source.as_ref();
        let value = json!({
            "shape": found.shape,
            "jointOffsetsM": found.joint_offsets_m.map(|offset| offset.to_array()),
            "sequence": source.map(|(name, _)| name),
            "degreesFromRest": source.map(|(_, degrees)| degrees),
        });
        let text = serde_json::to_string_pretty(&value)?;
        let kept = match write_first(&path, text.as_bytes())? {
            true => found,
            false => read_person(&path)?,
        };
        self.0.insert(person.to_owned(), kept);
        Ok(())
    }

    pub fn has(&self, person: &str) -> bool {
        self.0.contains_key(person)
    }

    pub fn of(&self, person: &str) -> Option<&PersonShape> {
        self.0.get(person)
    }

    pub fn people(&self) -> impl Iterator<Item = (&String, &PersonShape)> {
        self.0.iter()
    }

    /// Refuses a shape from the command line where the folder has another one.
    pub fn check_given(
        &self,
        out: &Path,
        person: &str,
        shape: &[f32; SHAPE_COUNT],
    ) -> anyhow::Result<()> {
        if self.of(person).is_some_and(|found| found.shape != *shape) {
            bail!(
                "{person} has another shape in {}; choose another --out, so that fits of two shapes do not \
                 mix",
                out.join("people").display()
            );
        }
        Ok(())
    }
}

fn read_person(path: &Path) -> anyhow::Result<PersonShape> {
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text).with_context(|| {
        format!(
            "{} is not what a run before wrote; remove it to find the shape again",
            path.display()
        )
    })
}

fn parse(text: &str) -> anyhow::Result<PersonShape> {
    let value: Value = serde_json::from_str(text)?;
    let betas = value["shape"].as_array().context("no shape")?;
    let betas: Option<Vec<f32>> = betas
        .iter()
        .map(|beta| beta.as_f64().map(|beta| beta as f32))
        .collect();
    let shape = <[f32; SHAPE_COUNT]>::try_from(betas.context("a shape of no numbers")?)
        .ok()
        .context("a shape of another length")?;
    let joints = value["jointOffsetsM"].as_array().context("no joints")?;
    let joints: Option<Vec<Vec3>> = joints.iter().map(place).collect();
    let joint_offsets_m = <[Vec3; JOINT_COUNT]>::try_from(joints.context("joints of no places")?)
        .ok()
        .context("another number of joints")?;
    let source = value["sequence"].as_str().map(|name| {
        let degrees = value["degreesFromRest"].as_f64().unwrap_or_default();
        (name.to_owned(), degrees)
    });
    Ok(PersonShape {
        shape,
        joint_offsets_m,
        source,
    })
}

fn place(value: &Value) -> Option<Vec3> {
    let numbers = value.as_array()?;
    let numbers: Option<Vec<f32>> = numbers
        .iter()
        .map(|number| number.as_f64().map(|number| number as f32))
        .collect();
    <[f32; 3]>::try_from(numbers?).ok().map(Vec3::from_array)
}

/// The settings of a folder's fits, a line each.
const SETTINGS: &str = "settings.txt";

/// Keeps the settings of a folder's first run, and refuses others.
pub fn check_settings(out: &Path, settings: &[(&str, String)]) -> anyhow::Result<()> {
    let path = out.join(SETTINGS);
    let lines: Vec<String> = settings
        .iter()
        .map(|(name, value)| format!("{name}: {value}"))
        .collect();
    let text = lines.join("\n") + "\n";
    if write_first(&path, text.as_bytes())? {
        return Ok(());
    }
    let before =
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    if before == text {
        return Ok(());
    }
    let before: Vec<&str> = before.lines().collect();
    let missing = |of: &[&str], among: &[&str]| {
        let lines = of.iter().filter(|line| !among.contains(line));
        lines.copied().collect::<Vec<_>>().join(", ")
    };
    let now: Vec<&str> = lines.iter().map(String::as_str).collect();
    bail!(
        "{} has fits of other settings ({}; now {}); choose another --out, or the settings of before",
        out.display(),
        missing(&before, &now),
        missing(&now, &before)
    )
}

/// Removes the settings of a folder in which there is neither a fit nor a person's shape. The folder must be
/// locked against others.
pub fn forget_unused_settings(out: &Path) -> anyhow::Result<()> {
    let path = out.join(SETTINGS);
    let is_used = !Shapes::read(out)?.0.is_empty() || has_fits(out)?;
    if is_used || !path.exists() {
        return Ok(());
    }
    fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))
}

fn has_fits(out: &Path) -> anyhow::Result<bool> {
    let entries = fs::read_dir(out).with_context(|| format!("cannot list {}", out.display()))?;
    for entry in entries {
        let path = entry
            .with_context(|| format!("cannot list {}", out.display()))?
            .path();
        if path.extension().is_some_and(|end| end == "npz") {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Removes what a killed run left half written of fits that nobody else writes.
pub fn remove_half_written(out: &Path, is_ours: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(out) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let fit = name
            .rsplit_once(".npz.")
            .filter(|_| name.ends_with(".part"));
        if fit.is_some_and(|(sequence, _)| is_ours(sequence)) {
            // One that cannot be removed only takes space.
            let _ = fs::remove_file(&path);
        }
    }
}
