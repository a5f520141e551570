//! AMASS-like motions: SMPL poses as axis-angle vectors in an `.npz` file.
//!
//! AMASS (Mahmood et al. 2019) stores `poses` [T, 72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X)], `trans`
//! [T, 3], `betas` [16 or more], `mocap_framerate` (`mocap_frame_rate` in the SMPL-X files) and,
//! in some, `dmpls` [T, 8]. Its world has +Z up. `dynaskin fit` writes the same keys and adds
//! `up_axis`.

use std::io::{Read, Seek};

use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_npz::{Archive, NpzError};
use glam::{DQuat, DVec3, Vec3};

use crate::clip::check_range;
use crate::retarget::put_on_floor;
use crate::{Clip, MAX_CLIP_FRAMES, MotionError};

/// SMPL's pose: all 24 joints.
const SMPL_WIDTH: usize = 72;
/// Pose widths of SMPL, SMPL-H and SMPL-X. Beyond the first 22 joints the latter two have fingers,
/// jaw and eyes, which the body has not.
const POSE_WIDTHS: [usize; 3] = [SMPL_WIDTH, 156, 165];
/// Joints whose rotation all of the family share.
const SHARED_JOINTS: usize = 22;
/// Larger than any motion accepted: 200,000 frames of SMPL-X in double precision.
const MAX_ARRAY_BYTES: u64 = 300 << 20;
/// Farthest root from the origin in metres.
const MAX_DISTANCE_M: f64 = 1e4;

/// The axis of a file's world that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y, as in this project.
    Y,
    /// +Z, as in AMASS.
    Z,
}

impl UpAxis {
    /// Turns this world into one with +Y up; what pointed along -Y then points along +Z.
    pub fn y_up_from_world(self) -> DQuat {
        match self {
            Self::Y => DQuat::IDENTITY,
            Self::Z => DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        }
    }
}

/// A motion of an SMPL-family body as it stands in a file.
#[derive(Clone, Debug)]
pub struct Amass {
    /// Frames per second.
    pub rate_hz: f64,
    /// Which axis points up: the file's `up_axis` (1 is y, 2 is z); where it has none, +Z as in AMASS,
    /// unless the body stands along +Y throughout.
    pub up: UpAxis,
    /// Shape coefficients of the file, of SMPL's shape space; empty where it has none. They mean
    /// nothing to a body of another shape space.
    pub betas: Vec<f64>,
    /// Number of DMPL soft-tissue coefficients a frame; 0 where the file has none. They belong to a
    /// space of SMPL's and are not read further.
    pub dmpl_count: usize,
    /// Whether the file is one of dynaskin's own fits, whose translations are of the body's own
    /// joints and need no floor.
    own: bool,
    /// Poses in the file's world.
    frames: Vec<Pose>,
}

impl Amass {
    /// Reads a file.
    ///
    /// # Errors
    /// [`MotionError::Amass`] for a file that is no archive, lacks an array or has one of another
    /// shape or with numbers that are not finite; [`MotionError::Parameter`] for a frame rate
    /// outside 1 to 1000 Hz, [`MotionError::EmptyClip`], [`MotionError::TooLong`],
    /// [`MotionError::TooFar`].
    pub fn read(reader: impl Read + Seek) -> Result<Self, MotionError> {
        let mut file = Archive::open(reader, MAX_ARRAY_BYTES)?;
        let poses = file.floats("poses", &[None, None])?;
        let [count, width] = [poses.shape[0], poses.shape[1]];
        if !POSE_WIDTHS.contains(&width) {
            return Err(NpzError::array(
                "poses",
                "72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X) numbers a frame",
                width.to_string(),
            )
            .into());
        }
        if count == 0 {
            return Err(MotionError::EmptyClip);
        }
        if count > MAX_CLIP_FRAMES {
            return Err(MotionError::TooLong {
                frames: count as f64,
                limit: MAX_CLIP_FRAMES,
            });
        }
        let trans = file.floats("trans", &[Some(count), Some(3)])?;
        let rate_key = if file.has("mocap_frame_rate") {
            "mocap_frame_rate"
        } else {
            "mocap_framerate"
        };
        let rate_hz = file.scalar(rate_key)?;
        check_range("mocap_framerate", rate_hz, 1.0, 1000.0)?;
        let up = match file.has("up_axis").then(|| file.scalar("up_axis")) {
            None => None,
            Some(axis) => match axis? {
                1.0 => Some(UpAxis::Y),
                2.0 => Some(UpAxis::Z),
                other => {
                    let expected = "1 (y) or 2 (z)";
                    return Err(NpzError::array("up_axis", expected, other.to_string()).into());
                }
            },
        };
        let betas = if file.has("betas") {
            file.floats("betas", &[None])?.into_c_order()
        } else {
            Vec::new()
        };
        let dmpl_count = if file.has("dmpls") {
            file.floats("dmpls", &[Some(count), None])?.shape[1]
        } else {
            0
        };
        let joints = if width == SMPL_WIDTH {
            JOINT_COUNT
        } else {
            SHARED_JOINTS
        };
        let frames: Vec<Pose> = (0..count)
            .map(|frame| {
                let mut pose = Pose::REST;
                pose.root_translation_m = vector(|axis| trans.at(&[frame, axis]));
                for joint in 0..joints {
                    let turn = vector(|axis| poses.at(&[frame, 3 * joint + axis]));
                    pose.parent_from_joint[joint] = DQuat::from_scaled_axis(turn).normalize();
                }
                pose
            })
            .collect();
        check_distance(&frames)?;
        Ok(Self {
            rate_hz,
            up: up.unwrap_or_else(|| up_by_body(&frames)),
            betas,
            dmpl_count,
            own: file.has("offsets_rest_m"),
            frames,
        })
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// The motion with +Y up for a body with these rest joint positions (metres), at the file's
    /// rate and without a name.
    ///
    /// `trans` counts from where the file's own body has its pelvis at rest, which the file does
    /// not tell: the clip is put on the floor, its first root at x = z = 0. A fit of dynaskin's own
    /// keeps its place.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        let turn = self.up.y_up_from_world();
        let mut frames = self.frames.clone();
        for pose in &mut frames {
            pose.root_translation_m = turn * pose.root_translation_m;
            pose.parent_from_joint[0] = (turn * pose.parent_from_joint[0]).normalize();
        }
        if !self.own {
            put_on_floor(&mut frames, 1.0 / self.rate_hz, joints_rest_m);
        }
        Clip {
            name: String::new(),
            rate_hz: self.rate_hz,
            frames,
        }
    }
}

/// The up axis of a file that does not say it. A body whose trunk is along +Y throughout stands in a
/// world with +Y up, or lies in one with +Z up: then its pelvis is a hand above z = 0.
fn up_by_body(frames: &[Pose]) -> UpAxis {
    let median = |number: &dyn Fn(&Pose) -> f64| {
        let mut numbers: Vec<f64> = frames.iter().map(number).collect();
        numbers.sort_by(f64::total_cmp);
        numbers[numbers.len() / 2]
    };
    let along_y = |pose: &Pose| (pose.parent_from_joint[0] * DVec3::Y).y;
    let mean = frames.iter().map(along_y).sum::<f64>() / frames.len() as f64;
    let least = frames.iter().map(along_y).fold(1.0, f64::min);
    let [height_y, height_z] = [
        median(&|pose| pose.root_translation_m.y),
        median(&|pose| pose.root_translation_m.z),
    ];
    let may_lie = (0.02..0.45).contains(&height_z) && !(0.6..1.4).contains(&height_y);
    if mean > 0.8 && least > 0.2 && !may_lie {
        UpAxis::Y
    } else {
        UpAxis::Z
    }
}

fn vector(component: impl Fn(usize) -> f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(component))
}

fn check_distance(frames: &[Pose]) -> Result<(), MotionError> {
    for (frame, pose) in frames.iter().enumerate() {
        let distance_m = pose.root_translation_m.length();
        if distance_m > MAX_DISTANCE_M {
            return Err(MotionError::TooFar {
                frame: frame + 1,
                distance_m,
                limit_m: MAX_DISTANCE_M,
            });
        }
        if !pose.is_valid() {
            let expected = "rotation vectors of usual length";
            let got = format!("others in frame {}", frame + 1);
            return Err(NpzError::array("poses", expected, got).into());
        }
    }
    Ok(())
}
