//! Motion files of any kind, told apart by their first bytes.

use dynaskin_body::JOINT_COUNT;
use glam::Vec3;

use crate::{Bvh, Clip, GltfMotion, JointReport, MotionError, retarget};

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
    /// What [`Bvh::parse`], [`GltfMotion::parse`] and `Amass::read` refuse;
    /// [`MotionError::UnknownFile`] for bytes of no known kind.
    pub fn parse(bytes: &[u8]) -> Result<Self, MotionError> {
        if bytes.starts_with(b"glTF") {
            return GltfMotion::parse(bytes).map(Self::Gltf);
        }
        #[cfg(feature = "amass")]
        if bytes.starts_with(b"PK") {
            return crate::Amass::read(std::io::Cursor::new(bytes)).map(Self::Amass);
        }
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = text.trim_ascii_start();
        const FIRST_WORD: &[u8] = b"HIERARCHY";
        if !text
            .get(..FIRST_WORD.len())
            .is_some_and(|word| word.eq_ignore_ascii_case(FIRST_WORD))
        {
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
        Bvh::parse(bytes).map(Self::Bvh)
    }

    /// The motion for a body with these rest joint positions (metres), at the file's rate (60 Hz for
    /// glTF), named as in the file. SMPL poses turn the body's joints as they are: there is nothing
    /// to report of them.
    ///
    /// # Errors
    /// As [`retarget`].
    pub fn clip(
        &self,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<(Clip, Option<JointReport>), MotionError> {
        let with_report = |(clip, report)| (clip, Some(report));
        match self {
            Self::Bvh(motion) => retarget(motion, joints_rest_m).map(with_report),
            Self::Gltf(motion) => {
                let (mut clip, report) = retarget(motion, joints_rest_m)?;
                clip.name.clone_from(&motion.animation_name);
                Ok((clip, Some(report)))
            }
            #[cfg(feature = "amass")]
            Self::Amass(motion) => Ok((motion.clip(joints_rest_m), None)),
        }
    }
}
