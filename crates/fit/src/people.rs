//! Captures of several people: lists the sequences, whose they are, and which of them determines a person's
//! shape.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_body::{BodyModel, Joint};
use glam::DQuat;

use crate::scans::{is_hdf5, is_hidden, sequences};
use crate::start::{Parts, pose_by_parts};
use crate::{FitError, Scans};

/// Mean rotation of the joints, in degrees, up to which a person counts as standing at rest.
pub const REST_DEGREES: f64 = 15.0;

/// A sequence of a person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Capture {
    /// Its name: of its data set, file or folder.
    pub name: String,
    /// Whose it is: its name up to the first underscore.
    pub person: String,
    /// What is done in it: the rest of its name.
    pub motion: String,
    /// The file or folder.
    pub path: PathBuf,
    /// Its data set, where it is in an HDF5 file.
    pub sequence: Option<String>,
}

impl Capture {
    fn new(path: &Path, name: &str, sequence: Option<&str>) -> Result<Self, FitError> {
        if let Some(problem) = problem_of(name) {
            return Err(FitError::BadName {
                path: path.to_owned(),
                name: name.to_owned(),
                problem,
            });
        }
        match name.split_once('_') {
            Some((person, motion)) if !person.is_empty() && !motion.is_empty() => Ok(Self {
                name: name.to_owned(),
                person: person.to_owned(),
                motion: motion.to_owned(),
                path: path.to_owned(),
                sequence: sequence.map(str::to_owned),
            }),
            _ => Err(FitError::NoPerson {
                path: path.to_owned(),
                name: name.to_owned(),
            }),
        }
    }

    /// Where it is, for messages.
    fn place(&self) -> String {
        match &self.sequence {
            Some(sequence) => format!("{}, data set `{sequence}`,", self.path.display()),
            None => self.path.display().to_string(),
        }
    }
}

/// Longest name of a sequence in bytes: file systems take 255, with endings and what is put beside.
const MAX_NAME_BYTES: usize = 120;
/// What file systems and shells take for something else.
const ODD: &str = "/\\:*?\"<>|";

/// Why a name cannot be that of a file.
fn problem_of(name: &str) -> Option<String> {
    if let Some(odd) = name.chars().find(|c| c.is_control() || ODD.contains(*c)) {
        return Some(format!("has the character {odd:?}"));
    }
    if name.starts_with(['.', '-']) {
        return Some("begins with a dot or a dash".to_owned());
    }
    let length = name.len();
    (length > MAX_NAME_BYTES).then(|| format!("has {length} bytes, at most {MAX_NAME_BYTES}"))
}

/// What a name is on a file system that does not tell capitals apart, and in the names of clips, which cannot have
/// several underscores in a row.
fn file_key(name: &str) -> String {
    let parts: Vec<&str> = name.split('_').filter(|part| !part.is_empty()).collect();
    parts.join("_").to_lowercase()
}

/// The sequences of an HDF5 file, or those of a folder: data sets of its HDF5 files, its `.npz` files, and
/// its folders of OBJ or PLY files; sorted by name.
///
/// # Errors
/// [`FitError`] where nothing is there, a name has no person, two sequences have the same name, or a file
/// cannot be listed.
pub fn captures(path: &Path, body: &BodyModel) -> Result<Vec<Capture>, FitError> {
    let mut found = Vec::new();
    if path.is_dir() {
        for entry in listing(path)? {
            add_entry(&entry, path, body, &mut found)?;
        }
    } else if is_hdf5(path)? {
        add_data_sets(path, body, &mut found)?;
    } else if ends_with(path, &["npz"]) {
        let path = path.to_owned();
        return Err(FitError::OneSequence { path });
    }
    if found.is_empty() {
        return Err(FitError::NoCaptures {
            path: path.to_owned(),
        });
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    check_names(&found)?;
    Ok(found)
}

/// Refuses captures whose files would be the same.
fn check_names(captures: &[Capture]) -> Result<(), FitError> {
    let mut keys: BTreeMap<String, &Capture> = BTreeMap::new();
    for capture in captures {
        if let Some(first) = keys.insert(file_key(&capture.name), capture) {
            return Err(FitError::SameName {
                first: first.place(),
                second: capture.place(),
            });
        }
    }
    Ok(())
}

fn listing(folder: &Path) -> Result<Vec<PathBuf>, FitError> {
    let io = |source| FitError::Io {
        path: folder.to_owned(),
        action: "listing",
        source,
    };
    let entries = fs::read_dir(folder).map_err(io)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()).map_err(io));
    paths
        .filter(|path| !path.as_ref().is_ok_and(|path| is_hidden(path)))
        .collect()
}

fn add_entry(
    entry: &Path,
    folder: &Path,
    body: &BodyModel,
    found: &mut Vec<Capture>,
) -> Result<(), FitError> {
    let name =
        |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    if entry.is_dir() {
        if holds_meshes(entry)? {
            found.push(Capture::new(entry, &name(entry.file_name()), None)?);
        }
    } else if is_mesh(entry) {
        return Err(FitError::OneSequence {
            path: folder.to_owned(),
        });
    } else if ends_with(entry, &["npz"]) {
        found.push(Capture::new(entry, &name(entry.file_stem()), None)?);
    } else if ends_with(entry, &["h5", "hdf5", "hdf"]) {
        add_data_sets(entry, body, found)?;
    }
    Ok(())
}

fn add_data_sets(path: &Path, body: &BodyModel, found: &mut Vec<Capture>) -> Result<(), FitError> {
    for sequence in sequences(path, body)? {
        let name = sequence.name.rsplit('/').next().unwrap_or_default();
        found.push(Capture::new(path, name, Some(&sequence.name))?);
    }
    Ok(())
}

/// Whether a folder holds mesh files, the frames of one sequence.
///
/// # Errors
/// [`FitError::Io`].
pub fn holds_meshes(folder: &Path) -> Result<bool, FitError> {
    Ok(listing(folder)?.iter().any(|path| is_mesh(path)))
}

fn is_mesh(path: &Path) -> bool {
    ends_with(path, &["obj", "ply"])
}

fn ends_with(path: &Path, endings: &[&str]) -> bool {
    path.extension()
        .is_some_and(|end| endings.iter().any(|known| end.eq_ignore_ascii_case(known)))
}

/// Mean rotation of all joints but the pelvis from rest in the first frame, in degrees. Estimated from each
/// body part's rotation, so no shape need be known.
///
/// # Errors
/// As [`Scans::frames_m`].
pub fn turned_degrees(body: &BodyModel, scans: &Scans<'_>) -> Result<f64, FitError> {
    let first_m = scans.frames_m(0..1)?;
    let mean_shape = body.shaped(&Default::default());
    let weights = vec![1.0; first_m.len()];
    let pose = pose_by_parts(&mean_shape, &first_m, &weights, &Parts::new(body));
    let turns = &pose.parent_from_joint[Joint::Pelvis as usize + 1..];
    let sum: f64 = turns
        .iter()
        .map(|turn| turn.angle_between(DQuat::IDENTITY).to_degrees())
        .sum();
    Ok(sum / turns.len() as f64)
}

/// Of each person the sequence whose first frame is nearest to rest, with its [`turned_degrees`]; or
/// [`FitError::NeverAtRest`] for a person whose sequences all begin far from rest. `captures` and `degrees` go
/// together; a capture without degrees is passed over.
pub fn nearest_to_rest<'c>(
    captures: &'c [Capture],
    degrees: &[Option<f64>],
) -> BTreeMap<&'c str, Result<(&'c Capture, f64), FitError>> {
    let mut nearest: BTreeMap<&str, (&Capture, f64)> = BTreeMap::new();
    for (capture, degrees) in captures.iter().zip(degrees) {
        let Some(degrees) = *degrees else {
            continue;
        };
        let best = nearest.entry(&capture.person).or_insert((capture, degrees));
        if degrees < best.1 {
            *best = (capture, degrees);
        }
    }
    let outcome = |(person, (capture, degrees)): (&'c str, (&'c Capture, f64))| {
        if degrees <= REST_DEGREES {
            return (person, Ok((capture, degrees)));
        }
        let error = FitError::NeverAtRest {
            person: capture.person.clone(),
            nearest: capture.name.clone(),
            degrees,
        };
        (person, Err(error))
    };
    nearest.into_iter().map(outcome).collect()
}
