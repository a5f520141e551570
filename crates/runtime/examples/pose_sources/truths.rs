//! The motions that are played.

use std::path::Path;

use anyhow::{Context, Result};
use dynaskin_body::JOINT_COUNT;
use dynaskin_motion::{Bvh, Procedural, ProceduralKind, retarget};
use dynaskin_pose_sources::Truth;
use glam::Vec3;

/// Procedural motions are made at this rate: a multiple of those of usual displays.
const PROCEDURAL_HZ: f64 = 240.0;

/// The middle `seconds` of a capture.
pub fn capture(path: &Path, joints_rest_m: &[Vec3; JOINT_COUNT], seconds: f64) -> Result<Truth> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (clip, _) = retarget(&Bvh::parse(&bytes)?, joints_rest_m)?;
    let name = path.file_stem().map(|name| name.to_string_lossy().into());
    Ok(Truth::middle(name.unwrap_or_default(), clip, seconds))
}

/// The middle of a procedural motion.
pub fn procedural(
    kind: ProceduralKind,
    joints_rest_m: &[Vec3; JOINT_COUNT],
    seconds: f64,
) -> Result<Truth> {
    let mut motion = Procedural::new(kind);
    motion.duration_seconds = seconds + 4.0;
    let clip = motion.clip_at(PROCEDURAL_HZ, joints_rest_m)?;
    Ok(Truth::middle(kind.name().to_owned(), clip, seconds))
}

/// A body that stands still with its arms down.
pub fn standing(joints_rest_m: &[Vec3; JOINT_COUNT], seconds: f64) -> Result<Truth> {
    let clip = Procedural::new(ProceduralKind::Walk).clip(joints_rest_m)?;
    Ok(Truth::still("standing", clip, seconds))
}
