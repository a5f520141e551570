//! What the simulator says of a motion.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, Materials, Pose};
use dynaskin_motion::{Clip, MODEL_RATE_HZ, MotionFile};
use dynaskin_sim::{ClipData, ClipLabels, Shell, SimSettings, simulate_clip};
use glam::{DQuat, Vec3};
use sha2::{Digest as _, Sha256};

/// Seconds of a held pose: what swings at its start has gone by its end.
const HELD_SECONDS: f64 = 3.0;

pub struct Simulator {
    pub body: BodyModel,
    settings: SimSettings,
    shell: Shell,
    joints_rest_m: [Vec3; JOINT_COUNT],
    /// Where clips that were simulated are kept.
    kept: Option<PathBuf>,
}

impl Simulator {
    pub fn new(model: &Path, kept: Option<PathBuf>) -> Result<Self> {
        let path = model.join("body.glb");
        let body = BodyModel::from_glb(
            &std::fs::read(&path).with_context(|| path.display().to_string())?,
        )?;
        let settings = SimSettings::for_body(&body);
        let shell = Shell::for_body(&body, &[0.0; 10], &settings)?;
        let joints_rest_m = body.shaped(&[0.0; 10]).joints_m;
        if let Some(folder) = &kept {
            std::fs::create_dir_all(folder)?;
        }
        Ok(Self {
            body,
            settings,
            shell,
            joints_rest_m,
            kept,
        })
    }

    pub fn joints_rest_m(&self) -> &[Vec3; JOINT_COUNT] {
        &self.joints_rest_m
    }

    /// Body vertices of the offsets' slots.
    pub fn vertices(&self) -> &[u32] {
        self.shell.vertices()
    }

    /// `[frame][slot][xyz]`, metres, rest pose.
    pub fn offsets(&self, clip: &Clip) -> Result<Vec<f32>> {
        let path = self
            .kept
            .as_ref()
            .map(|folder| folder.join(format!("{}.safetensors", name_of(clip))));
        if let Some(path) = path.as_ref().filter(|path| path.exists()) {
            return Ok(numbers(&ClipData::read(path)?));
        }
        let labels = ClipLabels {
            name: clip.name.clone(),
            body_sha256: String::new(),
            seed: 0,
            shape: [0.0; 10],
            materials: Materials::NOMINAL,
            sim_json: "{}".to_owned(),
        };
        let data = simulate_clip(&self.shell, clip, &self.settings, labels)?.data;
        if let Some(path) = path {
            data.write(&path)?;
        }
        Ok(numbers(&data))
    }
}

/// Tells clips apart by their poses.
fn name_of(clip: &Clip) -> String {
    let mut hash = Sha256::new();
    for pose in &clip.frames {
        let numbers = pose
            .parent_from_joint
            .iter()
            .flat_map(|turn| turn.to_array());
        for number in numbers.chain(pose.root_translation_m.to_array()) {
            hash.update(number.to_le_bytes());
        }
    }
    let digest = hash.finalize();
    let hex: String = digest[..8]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    format!("{}-{hex}", clip.name)
}

fn numbers(data: &ClipData) -> Vec<f32> {
    data.offsets_rest_m
        .iter()
        .map(|number| number.to_f32())
        .collect()
}

/// A capture at 60 Hz.
pub fn capture(path: &Path, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Clip> {
    let file =
        MotionFile::parse(&std::fs::read(path).with_context(|| path.display().to_string())?)?;
    let mut clip = file.clip(joints_rest_m)?.clip.resampled(MODEL_RATE_HZ)?;
    clip.name = path
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default();
    Ok(clip)
}

/// The middle `seconds` of a clip at 60 Hz.
pub fn middle(mut clip: Clip, seconds: f64) -> Clip {
    let count = ((seconds * clip.rate_hz) as usize).min(clip.frames.len());
    let start = (clip.frames.len() - count) / 2;
    clip.frames = clip.frames[start..start + count].to_vec();
    clip
}

/// A body that stands still with both collars lowered by `lowered` radians, and the arms with them.
pub fn held(lowered: f64) -> Clip {
    let mut pose = Pose::REST;
    for (collar, side) in [(Joint::LeftCollar, -1.0), (Joint::RightCollar, 1.0)] {
        pose.parent_from_joint[collar as usize] = DQuat::from_rotation_z(side * lowered);
    }
    Clip {
        name: format!("collars-lowered-{:.0}", lowered.to_degrees()),
        rate_hz: MODEL_RATE_HZ,
        frames: vec![pose; (HELD_SECONDS * MODEL_RATE_HZ) as usize],
    }
}
