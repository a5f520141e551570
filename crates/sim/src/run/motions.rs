//! The motions of a data set: captures from files and motions made by formula.

use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_body::JOINT_COUNT;
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionFile, Procedural, ProceduralKind, ReadOptions};
use glam::Vec3;

use super::error::RunError;
use super::poses::{HeldPoses, PoseMovement};

/// A motion of the data set.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// A motion capture.
    Capture {
        /// Name of the file without its ending, with the speed in percent where that is not 100:
        /// `14_06b@85`.
        name: String,
        /// The file: BVH, AMASS-like `.npz` or binary glTF.
        path: PathBuf,
        /// How many times faster than recorded.
        speed: f64,
        /// What the caller says of the file.
        options: ReadOptions,
    },
    /// A motion made by formula.
    Procedural {
        /// Kind, tempo and height, such as `hop-190-090` (hundredths of hertz, millimetres).
        name: String,
        /// Its parameters.
        parameters: Procedural,
    },
    /// Poses held and changed slowly.
    Held {
        /// Kind and number, such as `held-poses-7`.
        name: String,
        /// Which poses.
        poses: HeldPoses,
    },
}

impl Motion {
    /// Name for files.
    pub fn name(&self) -> &str {
        match self {
            Self::Capture { name, .. }
            | Self::Procedural { name, .. }
            | Self::Held { name, .. } => name,
        }
    }

    /// Whether it is made by formula.
    pub fn is_procedural(&self) -> bool {
        matches!(self, Self::Procedural { .. })
    }

    /// The motion at 60 Hz on a skeleton with these rest joint positions (metres).
    ///
    /// # Errors
    /// [`RunError`] if the file cannot be read or the motion not be carried over.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Clip, RunError> {
        Ok(self.clip_and_notes(joints_rest_m)?.0)
    }

    /// The same, with what was found other than usual in its file.
    ///
    /// # Errors
    /// As [`Self::clip`].
    pub fn clip_and_notes(
        &self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<(Clip, Vec<String>), RunError> {
        let failed = |source| RunError::Motion {
            motion: self.name().to_owned(),
            source,
        };
        let mut notes = Vec::new();
        let mut clip = match self {
            Self::Procedural { parameters, .. } => {
                parameters.clip(joints_rest_m).map_err(failed)?
            }
            Self::Held { poses, .. } => poses.clip(joints_rest_m),
            Self::Capture {
                path,
                speed,
                options,
                ..
            } => {
                let bytes = fs::read(path).map_err(|error| io(path, &error))?;
                let file = MotionFile::parse_with(&bytes, options).map_err(failed)?;
                let found = file.clip(joints_rest_m).map_err(failed)?;
                let clip = found.clip;
                notes = found.notes;
                let clip = if (clip.rate_hz / MODEL_RATE_HZ - 1.0).abs() < 1e-4 {
                    // "0.0166667" is meant to be 60 Hz: resampling would only blur it.
                    Clip {
                        rate_hz: MODEL_RATE_HZ,
                        ..clip
                    }
                } else {
                    clip.resampled(MODEL_RATE_HZ).map_err(failed)?
                };
                if *speed == 1.0 {
                    clip
                } else {
                    clip.time_scaled(*speed).map_err(failed)?
                }
            }
        };
        clip.name = self.name().to_owned();
        Ok((clip, notes))
    }
}

fn io(path: &Path, error: &std::io::Error) -> RunError {
    RunError::Io {
        path: path.to_owned(),
        reason: dynaskin_files::reason(error),
    }
}

fn ends_with(path: &Path, ending: &str) -> bool {
    path.extension()
        .is_some_and(|end| end.eq_ignore_ascii_case(ending))
}

/// The captures of a folder, by name: BVH files, AMASS-like `.npz` files and animations in binary
/// glTF. AMASS's `shape.npz`, which holds no motion, is passed over. Each file gets of `options` what
/// its kind has a use for.
///
/// # Errors
/// [`RunError::Io`] if the folder cannot be read, [`RunError::NoCaptures`] if it holds none,
/// [`RunError::UnusedOption`] for an option that no file of the folder has a use for.
pub fn captures(folder: &Path, options: &ReadOptions) -> Result<Vec<Motion>, RunError> {
    let mut motions = Vec::new();
    let mut endings: Vec<&str> = Vec::new();
    for entry in fs::read_dir(folder).map_err(|error| io(folder, &error))? {
        let path = entry.map_err(|error| io(folder, &error))?.path();
        let ending = ENDINGS.into_iter().find(|end| ends_with(&path, end));
        let is_shape = path.file_name() == Some("shape.npz".as_ref());
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        if let (Some(ending), Some(name), false) = (ending, stem, is_shape) {
            endings.push(ending);
            motions.push(Motion::Capture {
                name: name.to_owned(),
                options: of_kind(options, ending),
                path,
                speed: 1.0,
            });
        }
    }
    if motions.is_empty() {
        return Err(RunError::NoCaptures {
            path: folder.to_owned(),
        });
    }
    let any = |kinds: &[&str]| endings.iter().any(|ending| kinds.contains(ending));
    let given = [
        ("--joint", options.joints.is_empty(), WITH_JOINTS),
        ("--animation", options.animation.is_none(), WITH_ANIMATIONS),
        ("--rate", options.rate_hz.is_none(), WITH_RATES),
        ("--up", options.up.is_none(), WITH_UP),
    ];
    for (option, is_left_out, kinds) in given {
        if !is_left_out && !any(kinds) {
            return Err(RunError::UnusedOption {
                option,
                path: folder.to_owned(),
                kinds: kinds.join(", "),
            });
        }
    }
    motions.sort_by(|a, b| a.name().cmp(b.name()));
    Ok(motions)
}

/// Endings of motion files, and of those that options are for.
const ENDINGS: [&str; 4] = ["bvh", "glb", "vrma", "npz"];
const WITH_JOINTS: &[&str] = &["bvh", "glb", "vrma"];
const WITH_ANIMATIONS: &[&str] = &["glb", "vrma"];
const WITH_RATES: &[&str] = &["bvh", "npz"];
const WITH_UP: &[&str] = &["npz"];

/// Of `options` what files of that ending have a use for.
fn of_kind(options: &ReadOptions, ending: &str) -> ReadOptions {
    let mut own = options.clone();
    if !WITH_JOINTS.contains(&ending) {
        own.joints.clear();
    }
    own.animation = own.animation.filter(|_| WITH_ANIMATIONS.contains(&ending));
    own.rate_hz = own.rate_hz.filter(|_| WITH_RATES.contains(&ending));
    own.up = own.up.filter(|_| WITH_UP.contains(&ending));
    own
}

/// Captures of kinds of motion that the CMU selection has little of: jumping jacks, jogging in place
/// and hopping on one leg.
const THIN_CAPTURES: [&str; 4] = ["14_06a", "14_06b", "14_20a", "49_02b"];
/// Speeds at which thin kinds of motion are simulated besides their own, in percent.
const THIN_SPEEDS_PERCENT: [u32; 2] = [88, 112];

/// Slower and faster copies of those captures whose kind is rare.
pub fn thin_captures(captures: &[Motion]) -> Vec<Motion> {
    let mut copies = Vec::new();
    for motion in captures {
        if let Motion::Capture {
            name,
            path,
            options,
            ..
        } = motion
            && THIN_CAPTURES.contains(&name.as_str())
        {
            copies.extend(THIN_SPEEDS_PERCENT.map(|percent| Motion::Capture {
                name: format!("{name}@{percent}"),
                path: path.clone(),
                speed: f64::from(percent) / 100.0,
                options: options.clone(),
            }));
        }
    }
    copies
}

/// Motions made by formula, each at several tempos and heights around the usual ones.
pub fn procedurals() -> Vec<Motion> {
    let mut motions = Vec::new();
    for kind in ProceduralKind::ALL {
        for (tempo, height) in [(0.8, 0.8), (1.0, 1.0), (1.15, 0.7), (0.9, 1.3), (1.25, 0.5)] {
            let usual = Procedural::new(kind);
            let parameters = Procedural {
                tempo_hz: usual.tempo_hz * tempo,
                height_m: usual.height_m * height,
                ..usual
            };
            let name = format!(
                "{}-{:03.0}-{:03.0}",
                kind.name(),
                parameters.tempo_hz * 100.0,
                parameters.height_m * 1000.0
            );
            motions.push(Motion::Procedural { name, parameters });
        }
    }
    motions
}

/// Clips of held poses to learn from, to decide when to stop by, and to be measured on.
const HELD_CLIPS: [(&str, u64); 3] = [
    ("held-poses", 40),
    ("held-poses-validation", 4),
    ("held-poses-test", 6),
];
/// The same of poses in which the body is jerked.
const JERKED_CLIPS: [(&str, u64); 3] = [
    ("jerked-poses", 16),
    ("jerked-poses-validation", 2),
    ("jerked-poses-test", 2),
];
/// Length of such a clip in seconds.
const HELD_SECONDS: f64 = 10.0;

/// Poses held and changed slowly, from T- and A-poses to lying down, with collars that turn, and poses in
/// which the body is jerked a little and left to ring. The clips of each kind have other poses.
pub fn held_poses() -> Vec<Motion> {
    let mut motions = Vec::new();
    for (kinds, movement) in [
        (HELD_CLIPS, PoseMovement::Sways),
        (JERKED_CLIPS, PoseMovement::Jerks),
    ] {
        for (kind, count) in kinds {
            for number in 0..count {
                motions.push(Motion::Held {
                    name: format!("{kind}-{number}"),
                    poses: HeldPoses {
                        seed: 1000 * motions.len() as u64 + number,
                        duration_seconds: HELD_SECONDS,
                        movement,
                    },
                });
            }
        }
    }
    motions
}
