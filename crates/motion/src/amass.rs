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
use crate::{Clip, MAX_CLIP_FRAMES, MotionError, ReadOptions, UpAxis};

/// SMPL's pose: all 24 joints.
const SMPL_WIDTH: usize = 72;
/// Widths of poses with a root: 22 joints and more, up to SMPL-X. Beyond the first 22, SMPL-H and
/// SMPL-X have fingers, jaw and eyes, which the body has not.
const POSE_WIDTHS: std::ops::RangeInclusive<usize> = 66..=165;
/// Spellings of keys.
const POSE_KEYS: [&str; 2] = ["poses", "pose"];
const ROOT_KEYS: [&str; 2] = ["root_orient", "global_orient"];
const BODY_KEYS: [&str; 2] = ["pose_body", "body_pose"];
const TRANS_KEYS: [&str; 3] = ["trans", "transl", "translation"];
const RATE_KEYS: [&str; 5] = [
    "mocap_frame_rate",
    "mocap_framerate",
    "fps",
    "frame_rate",
    "framerate",
];
/// Joints whose rotation all of the family share.
const SHARED_JOINTS: usize = 22;
/// Larger than any motion accepted: as many frames as a clip may have, of SMPL-X in double precision.
const MAX_ARRAY_BYTES: u64 = (MAX_CLIP_FRAMES * 165 * 8) as u64;
/// More shape coefficients than any published file (SMPL-X has 400).
const MAX_SHAPES: usize = 1_000;
/// Farthest root from the origin in metres.
const MAX_DISTANCE_M: f64 = 1e4;

/// A motion of an SMPL-family body as it stands in a file.
#[derive(Clone, Debug)]
pub struct Amass {
    /// Frames per second.
    pub rate_hz: f64,
    /// Which axis points up: the caller's, the file's `up_axis` (1 is y, 2 is z), else that along
    /// which the body stands, else +Z, as AMASS has it.
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
    notes: Vec<String>,
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
        Self::read_with(reader, &ReadOptions::default())
    }

    /// Reads a file of which the caller knows more.
    ///
    /// # Errors
    /// As [`Self::read`]; [`MotionError::OptionNotForFile`].
    pub fn read_with(reader: impl Read + Seek, options: &ReadOptions) -> Result<Self, MotionError> {
        options.check_unused("SMPL poses", &["joints", "animation"])?;
        let mut file = Archive::open(reader, MAX_ARRAY_BYTES)?;
        let arrays = Arrays::find(&mut file)?;
        let count = arrays.count;
        let trans_key = key_of(&file, &TRANS_KEYS).unwrap_or(TRANS_KEYS[0]);
        let trans = file.floats(trans_key, &[Some(count), Some(3)])?;
        let rate_hz = match (options.rate_hz, key_of(&file, &RATE_KEYS)) {
            (Some(rate_hz), _) => rate_hz,
            (None, Some(key)) => file.scalar(key)?,
            (None, None) => {
                let expected = "the frames per second, here or as `fps`, `mocap_frame_rate` or \
                                `frame_rate`, or the option `rate`";
                return Err(NpzError::array("mocap_framerate", expected, "none").into());
            }
        };
        check_range("mocap_framerate", rate_hz, 1.0, 1000.0)?;
        let said = match file.has("up_axis").then(|| file.scalar("up_axis")) {
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
        let betas = betas(&mut file)?;
        let dmpl_count = dmpl_count(&mut file, count)?;
        let mut frames = arrays.poses(&mut file)?;
        for (frame, pose) in frames.iter_mut().enumerate() {
            pose.root_translation_m =
                DVec3::from_array([0, 1, 2].map(|axis| trans.at(&[frame, axis])));
        }
        check_distance(&frames)?;
        let mut notes = Vec::new();
        let up = options.up.or(said).unwrap_or_else(|| {
            let (up, is_clear) = up_by_body(&frames);
            if !is_clear {
                notes.push(
                    "the file does not say which axis points up, and the body hardly stands: +z was \
                     taken, as in AMASS; the option `up` says another"
                        .to_owned(),
                );
            } else if up != UpAxis::Z {
                notes.push(format!(
                    "the file does not say which axis points up: the body stands along {}",
                    up.name()
                ));
            }
            up
        });
        Ok(Self {
            rate_hz,
            up,
            betas,
            dmpl_count,
            own: file.has("offsets_rest_m"),
            frames,
            notes,
        })
    }

    /// What the file did not say, and what was made of it.
    pub fn notes(&self) -> Vec<String> {
        self.notes.clone()
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
        self.clip_of(self.frames.clone(), joints_rest_m)
    }

    /// As [`Self::clip`], in the memory of the file's poses, which are gone afterwards.
    pub(crate) fn take_clip(&mut self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        let frames = std::mem::take(&mut self.frames);
        self.clip_of(frames, joints_rest_m)
    }

    fn clip_of(&self, mut frames: Vec<Pose>, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        let turn = self.up.y_up_from_world();
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

/// Where the rotation vectors stand: in one array, or root and body in two.
struct Arrays {
    /// Number of frames.
    count: usize,
    /// Key and shape of each array, the first of its joints and how many are taken.
    parts: Vec<(&'static str, Vec<usize>, usize, usize)>,
}

impl Arrays {
    fn find(file: &mut Archive<impl Read + Seek>) -> Result<Self, MotionError> {
        let keys = file.keys();
        if let Some(other) = keys.is_empty().then_some(NO_ARRAYS) {
            return Err(other);
        }
        let root = key_of(file, &ROOT_KEYS);
        let one = key_of(file, &POSE_KEYS);
        let body = key_of(file, &BODY_KEYS);
        match (one, root, body) {
            (_, Some(root_key), Some(body_key)) if one.is_none() => {
                let root = vectors_shape(file, root_key)?;
                let body = vectors_shape(file, body_key)?;
                let [root_width, body_width] = [&root, &body].map(|shape| width(shape));
                if root_width != 3 {
                    let expected = "3 numbers a frame, a rotation vector";
                    return Err(bad(root_key, expected, root_width));
                }
                if !(63..=POSE_WIDTHS.end() - 3).contains(&body_width)
                    || !body_width.is_multiple_of(3)
                {
                    let expected = "63 (SMPL-H, SMPL-X) or 69 (SMPL) numbers a frame";
                    return Err(bad(body_key, expected, body_width));
                }
                if body[0] != root[0] {
                    let expected = format!("as many frames as `{root_key}`, {}", root[0]);
                    let got = body[0].to_string();
                    return Err(NpzError::array(body_key, expected, got).into());
                }
                let joints = taken(body_width + 3) - 1;
                Ok(Self {
                    count: root[0],
                    parts: vec![(root_key, root, 0, 1), (body_key, body, 1, joints)],
                })
            }
            (one, ..) => {
                let key = one.unwrap_or(POSE_KEYS[0]);
                if one.is_none() && !keys.is_empty() {
                    let expected = "rotation vectors, or `root_orient` and `pose_body`";
                    let got = format!("none among {}", keys.join(", "));
                    return Err(NpzError::array(key, expected, got).into());
                }
                let shape = vectors_shape(file, key)?;
                let width = width(&shape);
                // 69 numbers are a body without its root, or a root and 22 joints of something else.
                if !POSE_WIDTHS.contains(&width) || !width.is_multiple_of(3) || width == 69 {
                    let expected = "66 to 165 numbers a frame: 72 (SMPL), 156 (SMPL-H), 165 (SMPL-X), \
                                    66 (without hands); a body of 63 or 69 without its root is \
                                    `pose_body`, and the root `root_orient`";
                    return Err(bad(key, expected, width));
                }
                Ok(Self {
                    count: shape[0],
                    parts: vec![(key, shape, 0, taken(width))],
                })
            }
        }
    }

    /// The poses, without their translations. The numbers go where they belong as they are unpacked: an
    /// array of them would take as much memory again.
    fn poses(&self, file: &mut Archive<impl Read + Seek>) -> Result<Vec<Pose>, MotionError> {
        let mut frames = vec![Pose::REST; self.count];
        for (key, shape, first, joints) in &self.parts {
            let whole: Vec<Option<usize>> = shape.iter().copied().map(Some).collect();
            let most = match shape.len() {
                3 => [usize::MAX, *joints],
                _ => [usize::MAX, 3 * joints],
            };
            file.visit_floats(key, &whole, &most, |index, number| {
                let (frame, joint, axis) = match *index {
                    [frame, joint, axis] => (frame, joint, axis),
                    [frame, column] => (frame, column / 3, column % 3),
                    _ => return,
                };
                // A rotation vector on its way to a rotation.
                let turn = frames.get_mut(frame);
                let turn = turn.and_then(|pose| pose.parent_from_joint.get_mut(first + joint));
                if let Some(turn) = turn {
                    match axis {
                        0 => turn.x = number,
                        1 => turn.y = number,
                        _ => turn.z = number,
                    }
                }
            })?;
        }
        let joints: usize = self.parts.iter().map(|(.., joints)| joints).sum();
        for turn in frames
            .iter_mut()
            .flat_map(|pose| pose.parent_from_joint.iter_mut().take(joints))
        {
            let vector = DVec3::new(turn.x, turn.y, turn.z);
            *turn = DQuat::from_scaled_axis(vector).normalize();
        }
        Ok(frames)
    }
}

/// How many joints of a pose of that width the body has.
fn taken(width: usize) -> usize {
    if width == SMPL_WIDTH {
        JOINT_COUNT
    } else {
        SHARED_JOINTS
    }
}

fn bad(key: &str, expected: &str, width: usize) -> MotionError {
    NpzError::array(key, expected, width.to_string()).into()
}

/// The shape of an array of [frames, numbers] or [frames, joints, 3], with as many frames as a clip may
/// have.
fn vectors_shape(
    file: &mut Archive<impl Read + Seek>,
    key: &'static str,
) -> Result<Vec<usize>, MotionError> {
    let shape = file.shape(key)?;
    match shape[..] {
        [0, _] | [0, _, 3] => Err(MotionError::EmptyClip),
        [frames, _] | [frames, _, 3] if frames > MAX_CLIP_FRAMES => Err(MotionError::TooLong {
            frames: frames as f64,
            limit: MAX_CLIP_FRAMES,
        }),
        [_, _] | [_, _, 3] => Ok(shape),
        // A third length that is not 3: matrices or quaternions.
        _ => {
            let expected = "shape [any, any]";
            Err(NpzError::array(key, expected, format!("shape {shape:?}")).into())
        }
    }
}

/// Numbers a frame.
fn width(shape: &[usize]) -> usize {
    shape.iter().skip(1).product()
}

/// The first of the spellings that the file has.
fn key_of(file: &Archive<impl Read + Seek>, spellings: &[&'static str]) -> Option<&'static str> {
    spellings.iter().copied().find(|key| file.has(key))
}

const NO_ARRAYS: MotionError = MotionError::OtherKind {
    kind: "an archive without NumPy arrays, such as a ZIP file, a USD file (.usdz) or a Python pickle (.pt)",
    what_to_do: "unpack a ZIP file and choose the motion in it, convert a USD file to GLB, and save a pickle's \
                 arrays with `numpy.savez`",
};

/// Shape coefficients: of the whole file, or the first frame's where every frame has its own.
fn betas(file: &mut Archive<impl Read + Seek>) -> Result<Vec<f64>, MotionError> {
    if !file.has("betas") {
        return Ok(Vec::new());
    }
    let shape = file.shape("betas")?;
    let (expected, most): (&[Option<usize>], &[usize]) = match shape[..] {
        [_, _] => (&[None, None], &[1, MAX_SHAPES]),
        _ => (&[None], &[MAX_SHAPES]),
    };
    Ok(file.floats_within("betas", expected, most)?.into_c_order())
}

/// Number of soft-tissue coefficients a frame.
fn dmpl_count(file: &mut Archive<impl Read + Seek>, frames: usize) -> Result<usize, MotionError> {
    if !file.has("dmpls") {
        return Ok(0);
    }
    let shape = file.shape("dmpls")?;
    match shape[..] {
        [count, width] if count == frames => Ok(width),
        _ => {
            let expected = format!("shape [{frames}, any]");
            Err(NpzError::array("dmpls", expected, format!("shape {shape:?}")).into())
        }
    }
}

/// The axis along which the trunk stands on average, and whether that is clear; +Z where it is not.
fn up_by_body(frames: &[Pose]) -> (UpAxis, bool) {
    let median = |number: &dyn Fn(&Pose) -> f64| {
        let mut numbers: Vec<f64> = frames.iter().map(number).collect();
        numbers.sort_by(f64::total_cmp);
        numbers.get(numbers.len() / 2).copied().unwrap_or_default()
    };
    let sum: DVec3 = frames
        .iter()
        .map(|pose| pose.parent_from_joint[0] * DVec3::Y)
        .sum();
    let mean = sum / frames.len().max(1) as f64;
    let [height_y_m, height_z_m] = [
        median(&|pose| pose.root_translation_m.y),
        median(&|pose| pose.root_translation_m.z),
    ];
    // Somebody who lies on a floor at z = 0 has the trunk along y and the pelvis a hand above it.
    let may_lie = (0.02..0.45).contains(&height_z_m) && !(0.6..1.4).contains(&height_y_m);
    let clearly = |along: f64, aside: f64| along > 0.5 && along > 2.0 * aside.abs();
    if clearly(mean.z, mean.y) {
        (UpAxis::Z, true)
    } else if may_lie {
        (UpAxis::Z, false)
    } else if clearly(mean.y, mean.z) {
        (UpAxis::Y, true)
    } else if clearly(-mean.y, mean.z) {
        (UpAxis::MinusY, true)
    } else {
        (UpAxis::Z, false)
    }
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
