//! Clips for a body.

use dynaskin_body::JOINT_COUNT;
use dynaskin_motion::{
    AnimationChoice, Bvh, Clip, FileClip, GltfMotion, JointReport, MODEL_RATE_HZ, MotionError,
    MotionFile, Procedural, ProceduralKind, ReadOptions, UpAxis,
};
use dynaskin_runtime::RuntimeError;
use glam::Vec3;
use serde_json::{Value, json};
use wasm_bindgen::prelude::*;

use crate::error::Thrown;
use crate::pose;

/// A clip at 60 Hz.
#[wasm_bindgen]
pub struct CoreMotion {
    clip: Clip,
    report: Option<JointReport>,
    notes: Vec<String>,
}

/// Options of a file. `joints` are pairs of the body's joint and the file's name of it.
pub(crate) fn read_options(
    joints: &[String],
    animation: Option<AnimationChoice>,
    rate_hz: Option<f64>,
    up: Option<&str>,
) -> Result<ReadOptions, Thrown> {
    let mut options = ReadOptions::default();
    for pair in joints.chunks(2) {
        let [joint, name] = pair else {
            let message = "Joints are named in pairs: the body's joint and the file's.";
            return Err(Thrown::argument(message.to_owned()));
        };
        options
            .name_joint(joint, name)
            .map_err(|error| match error {
                MotionError::UnknownBodyJoint { .. } => Thrown::argument(error.to_string()),
                other => other.into(),
            })?;
    }
    options.animation = animation;
    options.rate_hz = rate_hz;
    options.up = match up {
        None => None,
        Some(name) => Some(UpAxis::from_name(name).ok_or_else(|| {
            Thrown::argument(format!("There is no up axis `{name}`; give y, z or -y."))
        })?),
    };
    Ok(options)
}

/// A name or a place counted from 0; none for everything else.
pub(crate) fn animation_choice(animation: &JsValue) -> Option<AnimationChoice> {
    match (animation.as_string(), animation.as_f64()) {
        (Some(name), _) => Some(AnimationChoice::Name(name)),
        (None, Some(index)) => Some(AnimationChoice::Index(index as usize)),
        (None, None) => None,
    }
}

/// The animations of a binary glTF file, as JavaScript has them.
pub(crate) fn animations(bytes: &[u8]) -> Result<JsValue, JsValue> {
    if !READS_FILES {
        return Err(no_files().into());
    }
    let animations = GltfMotion::animations(bytes).map_err(Thrown::from)?;
    let animations = animations.iter().map(|animation| {
        json!({
            "name": animation.name,
            "seconds": animation.seconds,
            "movingJoints": animation.moving_joints,
        })
    });
    js_sys::JSON::parse(&Value::from_iter(animations).to_string())
}

/// Whether motion files are read; the compiler drops what follows where they are not.
const READS_FILES: bool = cfg!(feature = "files");

/// The error for a file where they are not read.
fn no_files() -> Thrown {
    Thrown::motion(
        "The slim core reads no motion files: use readMotion of dynaskin/worker, or Motion.fromPoses."
            .to_owned(),
    )
}

impl CoreMotion {
    pub(crate) fn from_bvh(
        bytes: &[u8],
        options: &ReadOptions,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Self, Thrown> {
        if !READS_FILES {
            return Err(no_files());
        }
        let bvh = Bvh::parse_with(bytes, options)?;
        Self::played(MotionFile::Bvh(bvh), joints_rest_m, &mut |_| {})
    }

    pub(crate) fn from_file(
        bytes: &[u8],
        options: &ReadOptions,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Self, Thrown> {
        Self::watched(bytes, options, joints_rest_m, &mut |_| {})
    }

    /// Reads a file; `progress` is told the fraction that is done.
    fn watched(
        bytes: &[u8],
        options: &ReadOptions,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, Thrown> {
        // About as long as what follows.
        const PARSED: f64 = 0.3;
        if !READS_FILES {
            return Err(no_files());
        }
        progress(0.0);
        let file = MotionFile::parse_with(bytes, options)?;
        progress(PARSED);
        let mut rest = |done: f64| progress(PARSED + (1.0 - PARSED) * done);
        Self::played(file, joints_rest_m, &mut rest)
    }

    fn played(
        file: MotionFile,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, Thrown> {
        let FileClip {
            clip,
            report,
            notes,
            ..
        } = file.into_clip(joints_rest_m, MODEL_RATE_HZ, progress)?;
        Ok(Self {
            clip,
            report,
            notes,
        })
    }

    pub(crate) fn from_poses(name: String, numbers: &[f64], rate_hz: f64) -> Result<Self, Thrown> {
        if !numbers.len().is_multiple_of(pose::POSE_LENGTH) {
            return Err(Thrown::argument(format!(
                "Poses have {} numbers each; {} are no whole number of poses.",
                pose::POSE_LENGTH,
                numbers.len()
            )));
        }
        let mut frames = Vec::with_capacity(numbers.len() / pose::POSE_LENGTH);
        for (idx, numbers) in numbers.chunks_exact(pose::POSE_LENGTH).enumerate() {
            let frame = pose::from_numbers(numbers)?;
            if !frame.is_valid() {
                return Err(RuntimeError::InvalidPose {
                    place: format!("frame {idx}"),
                    value: "no translation and unit quaternions".to_owned(),
                }
                .into());
            }
            frames.push(frame);
        }
        let clip = Clip {
            name,
            rate_hz,
            frames,
        };
        Ok(Self {
            clip: clip.into_resampled(MODEL_RATE_HZ)?,
            report: None,
            notes: Vec::new(),
        })
    }

    /// `parameters` are tempo (Hz), height (m) and duration (s), each with a default.
    pub(crate) fn procedural(
        name: &str,
        parameters: (Option<f64>, Option<f64>, Option<f64>),
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Self, Thrown> {
        let kind = ProceduralKind::from_name(name).ok_or_else(|| {
            let names = ProceduralKind::ALL.map(ProceduralKind::name).join(", ");
            Thrown::argument(format!("There is no motion `{name}`; there are {names}."))
        })?;
        let mut motion = Procedural::new(kind);
        let (tempo_hz, height_m, duration_seconds) = parameters;
        motion.tempo_hz = tempo_hz.unwrap_or(motion.tempo_hz);
        motion.height_m = height_m.unwrap_or(motion.height_m);
        motion.duration_seconds = duration_seconds.unwrap_or(motion.duration_seconds);
        Ok(Self {
            clip: motion.clip(joints_rest_m)?,
            report: None,
            notes: Vec::new(),
        })
    }
}

#[wasm_bindgen]
impl CoreMotion {
    /// Reads a motion file as `CoreAvatar.motionFromFile` does, for a body with these rest joints,
    /// `[joint][3]` in metres. `progress` is called with the fraction that is done, 0 to 1.
    ///
    /// # Errors
    /// Throws `motion` and `argument`.
    #[wasm_bindgen(js_name = readFile)]
    pub fn read_file(
        bytes: &[u8],
        joints_rest_m: &[f32],
        joints: Vec<String>,
        animation: JsValue,
        rate_hz: Option<f64>,
        up: Option<String>,
        progress: &js_sys::Function,
    ) -> Result<CoreMotion, JsValue> {
        let options = read_options(
            &joints,
            animation_choice(&animation),
            rate_hz,
            up.as_deref(),
        )?;
        let rest_m = rest_joints(joints_rest_m)?;
        let mut tell = |done: f64| {
            // Whoever listens cannot stop the reading, so its errors are of no use here.
            let _ = progress.call1(&JsValue::NULL, &done.into());
        };
        Ok(Self::watched(bytes, &options, &rest_m, &mut tell)?)
    }

    /// The poses, 99 numbers each, one after the other.
    ///
    /// # Errors
    /// None in practice: every pose has its numbers.
    pub fn poses(&self) -> Result<Vec<f64>, JsValue> {
        let mut numbers = vec![0.0; self.clip.frames.len() * pose::POSE_LENGTH];
        let rows = numbers.chunks_exact_mut(pose::POSE_LENGTH);
        for (frame, row) in self.clip.frames.iter().zip(rows) {
            pose::to_numbers(frame, row)?;
        }
        Ok(numbers)
    }

    /// Name of the clip; for a file, of its animation, empty where it has none.
    #[wasm_bindgen(getter)]
    pub fn name(&self) -> String {
        self.clip.name.clone()
    }

    /// Time from the first to the last frame.
    #[wasm_bindgen(getter, js_name = durationSeconds)]
    pub fn duration_seconds(&self) -> f64 {
        self.clip.duration_seconds()
    }

    /// For a file, what it did not say or lacks, what was found other than usual, and what was made of
    /// it: a sentence each.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Names of the motions that can be made.
    #[wasm_bindgen(js_name = proceduralNames)]
    pub fn procedural_names() -> Vec<String> {
        ProceduralKind::ALL
            .map(|kind| kind.name().to_owned())
            .into()
    }

    /// Writes the pose at `time_seconds` into the 99 numbers of `out`.
    ///
    /// # Errors
    /// Throws `argument` for an array of another length or a time that is not finite.
    #[wasm_bindgen(js_name = poseAt)]
    pub fn pose_at(&self, time_seconds: f64, out: &mut [f64]) -> Result<(), JsValue> {
        if !time_seconds.is_finite() {
            let message = format!("The time is {time_seconds} s; give a finite number.");
            return Err(Thrown::argument(message).into());
        }
        Ok(pose::to_numbers(&self.clip.pose_at(time_seconds), out)?)
    }

    /// Turns the motion about the vertical so that the body faces +Z at its beginning.
    #[wasm_bindgen(js_name = turnToFront)]
    pub fn turn_to_front(&mut self) {
        self.clip.turn_to_front();
    }

    /// Name of the procedural motion that resembles it most, of a body with these rest joints, `[joint][3]` in metres.
    ///
    /// # Errors
    /// Throws `argument` for other than 24 joints, and `motion` in the slim core, where files are not read.
    pub fn nearest(&self, joints_rest_m: &[f32]) -> Result<String, JsValue> {
        if !READS_FILES {
            return Err(no_files().into());
        }
        let rest_m = rest_joints(joints_rest_m)?;
        let kind = ProceduralKind::nearest(&self.clip, &rest_m).map_err(Thrown::from)?;
        Ok(kind.name().to_owned())
    }

    /// For a file of named joints, what became of them: an object with `mapped`, `missing`, `unmapped`,
    /// `unit`, `frameSeconds` and `notes`; for other clips null.
    ///
    /// # Errors
    /// None in practice: the report is valid JSON.
    #[wasm_bindgen(js_name = jointReport)]
    pub fn joint_report(&self) -> Result<JsValue, JsValue> {
        match &self.report {
            Some(report) => js_sys::JSON::parse(&report_json(report).to_string()),
            None => Ok(JsValue::NULL),
        }
    }
}

/// Rest joints from three numbers each.
fn rest_joints(numbers_m: &[f32]) -> Result<[Vec3; JOINT_COUNT], Thrown> {
    let rest_m: Vec<Vec3> = numbers_m.chunks_exact(3).map(Vec3::from_slice).collect();
    rest_m.try_into().map_err(|_| {
        Thrown::argument(format!(
            "There are {JOINT_COUNT} rest joints, three numbers each."
        ))
    })
}

fn report_json(report: &JointReport) -> Value {
    let mapped = report
        .mapped
        .iter()
        .map(|(joint, source)| json!({ "joint": joint.name(), "source": source }));
    json!({
        "mapped": mapped.collect::<Vec<_>>(),
        "missing": report.missing.iter().map(|joint| joint.name()).collect::<Vec<_>>(),
        "unmapped": report.unmapped,
        "unit": report.unit.name(),
        "frameSeconds": report.frame_seconds,
        "notes": report.notes,
    })
}
