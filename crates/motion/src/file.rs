//! Motion files of any kind, recognised by their first bytes.

use dynaskin_body::{JOINT_COUNT, Pose};
use glam::Vec3;

use crate::other_kind::other_kind;
use crate::{Bvh, Clip, GltfMotion, JointReport, MotionError, ReadOptions, retarget_watched};

/// A motion file.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum MotionFile {
    /// Text with a skeleton and its motion.
    Bvh(Bvh),
    /// An animation in binary glTF: `.glb`, `.vrm` or `.vrma`.
    Gltf(GltfMotion),
    /// SMPL poses as AMASS stores them: `.npz`.
    #[cfg(feature = "amass")]
    Amass(crate::Amass),
}

impl MotionFile {
    /// Reads a file, whatever its name.
    ///
    /// # Errors
    /// As [`Self::parse_with`].
    pub fn parse(bytes: &[u8]) -> Result<Self, MotionError> {
        Self::parse_with(bytes, &ReadOptions::default())
    }

    /// Reads a file with options for what it does not state, whatever its name.
    ///
    /// # Errors
    /// What [`Bvh::parse_with`], [`GltfMotion::parse_with`] and `Amass::read_with` refuse;
    /// [`MotionError::EmptyFile`], [`MotionError::OtherKind`] for files of known kinds that are not supported,
    /// [`MotionError::UnknownFile`] for all others.
    pub fn parse_with(bytes: &[u8], options: &ReadOptions) -> Result<Self, MotionError> {
        if bytes.is_empty() {
            return Err(MotionError::EmptyFile);
        }
        if bytes.starts_with(b"glTF") {
            return GltfMotion::parse_with(bytes, options).map(Self::Gltf);
        }
        #[cfg(feature = "amass")]
        if bytes.starts_with(b"PK") {
            let reader = std::io::Cursor::new(bytes);
            return crate::Amass::read_with(reader, options).map(Self::Amass);
        }
        if let Some((kind, what_to_do)) = other_kind(bytes) {
            return Err(MotionError::OtherKind { kind, what_to_do });
        }
        if !Bvh::begins(bytes) {
            let found = bytes.iter().take(16).copied();
            return Err(MotionError::UnknownFile {
                found: format!(
                    "`{}`",
                    found
                        .map(std::ascii::escape_default)
                        .map(|c| c.to_string())
                        .collect::<String>()
                ),
            });
        }
        Bvh::parse_with(bytes, options).map(Self::Bvh)
    }

    /// What the file does not state or lacks, and how it was read; empty if there is nothing to note.
    /// One sentence each, without initial capital and full stop. [`Self::clip`] finds more.
    pub fn notes(&self) -> Vec<String> {
        match self {
            Self::Bvh(motion) => motion.break_off().iter().map(ToString::to_string).collect(),
            Self::Gltf(motion) => motion.notes(),
            #[cfg(feature = "amass")]
            Self::Amass(motion) => motion.notes(),
        }
    }

    /// The motion for a body with these rest joint positions (metres), at the file's rate (for
    /// glTF that of its keyframes, at most 60 Hz), named as in the file.
    ///
    /// # Errors
    /// As [`retarget`].
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<FileClip, MotionError> {
        self.clip_watched(joints_rest_m, &mut |_| {})
    }

    fn clip_watched(
        &self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        progress: &mut dyn FnMut(f64),
    ) -> Result<FileClip, MotionError> {
        let (clip, report) = match self {
            Self::Bvh(motion) => retarget_watched(motion, joints_rest_m, progress)
                .map(|(clip, report)| (clip, Some(report)))?,
            Self::Gltf(motion) => {
                let (mut clip, report) = retarget_watched(motion, joints_rest_m, progress)?;
                clip.name.clone_from(&motion.animation_name);
                (clip, Some(report))
            }
            #[cfg(feature = "amass")]
            Self::Amass(motion) => (motion.clip(joints_rest_m), None),
        };
        Ok(self.file_clip(clip, report))
    }

    /// As [`Self::clip`] at `rate_hz`, with less memory: the file's contents are freed before the poses
    /// are resampled. `progress` receives the fraction that is done, 0 to 1.
    ///
    /// # Errors
    /// As [`Self::clip`] and [`Clip::resampled`].
    pub fn into_clip(
        self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        rate_hz: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<FileClip, MotionError> {
        let found = match self {
            #[cfg(feature = "amass")]
            Self::Amass(mut motion) => {
                let clip = motion.take_clip(joints_rest_m);
                Self::Amass(motion).file_clip(clip, None)
            }
            other => other.clip_watched(joints_rest_m, progress)?,
        };
        Ok(FileClip {
            clip: found.clip.into_resampled(rate_hz)?,
            ..found
        })
    }

    /// Says what is to be said of a clip of this file.
    fn file_clip(&self, clip: Clip, report: Option<JointReport>) -> FileClip {
        let mut notes = self.notes();
        // Of glTF files this is said with the choice among their animations.
        if !matches!(self, Self::Gltf(_)) && is_still(&clip) {
            notes.push("nothing moves in the file: every frame is the same pose".to_owned());
        }
        notes.extend(jumps_note(&clip));
        if let Some(report) = &report {
            notes.extend(report.notes.iter().cloned());
        }
        let report = report.map(|report| JointReport {
            notes: notes.clone(),
            ..report
        });
        FileClip {
            clip,
            report,
            notes,
        }
    }
}

/// The motion of a file for a body.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FileClip {
    /// The motion, at the file's rate.
    pub clip: Clip,
    /// How the file's joints were matched. None for SMPL poses, which drive the body's joints directly.
    pub report: Option<JointReport>,
    /// What the file does not state or lacks, what is unusual in it, and how it was read: one
    /// sentence each. The report has the same.
    pub notes: Vec<String>,
}

/// Whether several frames are all the same pose: files saved while the rest pose is shown.
fn is_still(clip: &Clip) -> bool {
    const SAME: f64 = 1e-6;
    let [first, others @ ..] = &clip.frames[..] else {
        return false;
    };
    let is_same = |pose: &Pose| {
        let turns = pose.parent_from_joint.iter().zip(&first.parent_from_joint);
        pose.root_translation_m.distance(first.root_translation_m) < SAME
            && turns
                .into_iter()
                .all(|(turn, same)| (turn.inverse() * *same).xyz().length() < SAME)
    };
    !others.is_empty() && others.iter().all(is_same)
}

/// What is to be said of the places where the body jumps.
fn jumps_note(clip: &Clip) -> Option<String> {
    const MOST: usize = 8;
    let jumps = clip.jumps();
    let places: Vec<String> = jumps
        .iter()
        .take(MOST)
        .map(|frame| (frame + 1).to_string())
        .collect();
    let more = jumps.len().saturating_sub(MOST);
    match (&places[..], more) {
        ([], _) => None,
        (places, 0) => Some(format!(
            "the body jumps after frame {}: taken as a cut",
            places.join(", ")
        )),
        (places, more) => Some(format!(
            "the body jumps after frame {} and {more} more: taken as cuts",
            places.join(", ")
        )),
    }
}
