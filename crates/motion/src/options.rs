//! Options of the readers, for what a file does not state or states wrongly.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::DQuat;

use crate::MotionError;

/// The axis of a file's world that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpAxis {
    /// +Y, as in this project.
    Y,
    /// +Z, as in AMASS.
    Z,
    /// -Y, as in the cameras of computer vision.
    MinusY,
}

impl UpAxis {
    /// Rotates this world into one with +Y up; -Y is mapped to +Z, or for a world with -Y up -Z is mapped
    /// to +Z.
    pub fn y_up_from_world(self) -> DQuat {
        match self {
            Self::Y => DQuat::IDENTITY,
            Self::Z => DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
            Self::MinusY => DQuat::from_rotation_x(std::f64::consts::PI),
        }
    }

    /// Name of the axis: `y`, `z` or `-y`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusY => "-y",
        }
    }

    /// The axis of that name, such as `y`, `+z` or `-Y`.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.trim().to_ascii_lowercase();
        let name = name.strip_prefix('+').unwrap_or(&name);
        [Self::Y, Self::Z, Self::MinusY]
            .into_iter()
            .find(|axis| axis.name() == name)
    }
}

/// Which of a file's animations to read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnimationChoice {
    /// The animation with that name; case counts only if two names differ by nothing else.
    Name(String),
    /// The animation with that index, counted from 0.
    Index(usize),
}

/// What a file does not state or states wrongly. The default leaves everything to the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// The file's joint for one of the body's, by name: `(Joint::LeftHip, "LThigh")`. The others are
    /// recognised by name.
    pub joints: Vec<(Joint, String)>,
    /// Which animation of a glTF file; without it the one that moves the most joints.
    pub animation: Option<AnimationChoice>,
    /// Frames per second of BVH and SMPL files, in place of the rate in the file.
    pub rate_hz: Option<f64>,
    /// The up axis of a file with SMPL poses, in place of that in the file.
    pub up: Option<UpAxis>,
}

impl ReadOptions {
    /// Adds the file's joint for the body's joint of SMPL's name `body_joint` (`left_hip`).
    ///
    /// # Errors
    /// [`MotionError::UnknownBodyJoint`].
    pub fn name_joint(&mut self, body_joint: &str, name: &str) -> Result<(), MotionError> {
        let joint =
            Joint::from_name(body_joint.trim()).ok_or_else(|| MotionError::UnknownBodyJoint {
                name: body_joint.to_owned(),
            })?;
        self.joints.push((joint, name.to_owned()));
        Ok(())
    }

    /// Refuses an option that a kind of file has no use for.
    pub(crate) fn check_unused(
        &self,
        kind: &'static str,
        unused: &[&'static str],
    ) -> Result<(), MotionError> {
        let given = [
            ("joints", !self.joints.is_empty()),
            ("animation", self.animation.is_some()),
            ("rate", self.rate_hz.is_some()),
            ("up axis", self.up.is_some()),
        ];
        match given
            .into_iter()
            .find(|(option, is_given)| *is_given && unused.contains(option))
        {
            None => Ok(()),
            Some((option, _)) => Err(MotionError::OptionNotForFile { option, kind }),
        }
    }
}

/// The joints that the caller named, found among the file's: for each of the body's joints an index into
/// `names`.
///
/// # Errors
/// [`MotionError::NamedJoint`] for a name that is not there, or more than once.
pub fn find_named(
    joints: &[(Joint, String)],
    names: &[&str],
) -> Result<[Option<usize>; JOINT_COUNT], MotionError> {
    let mut found = [None; JOINT_COUNT];
    for (joint, name) in joints {
        let same: Vec<usize> = (0..names.len())
            .filter(|idx| names[*idx] == name.trim())
            .collect();
        let alike: Vec<usize> = (0..names.len())
            .filter(|idx| names[*idx].eq_ignore_ascii_case(name.trim()))
            .collect();
        let problem = match (&same[..], &alike[..]) {
            _ if name.trim().is_empty() => "has an empty name",
            ([only], _) | ([], [only]) => {
                let twice = found.contains(&Some(*only));
                if !twice && found[*joint as usize].is_none() {
                    found[*joint as usize] = Some(*only);
                    continue;
                }
                if twice {
                    "is named for two joints of the body"
                } else {
                    "is the second one named for this joint"
                }
            }
            ([], []) => "is not in the file",
            _ => "is several times in the file",
        };
        return Err(MotionError::NamedJoint {
            joint: *joint,
            name: name.clone(),
            problem,
            available: names
                .iter()
                .filter(|name| !name.is_empty())
                .map(|name| (*name).to_owned())
                .collect(),
        });
    }
    Ok(found)
}
