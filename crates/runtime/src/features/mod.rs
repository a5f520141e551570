//! What the network sees of the motion: features, once a 60 Hz tick.
//!
//! This is the only place that computes them: training and runtime call the same code, so a
//! network sees in the browser what it saw when it learned.
//!
//! Kind `inertial` (DESIGN.md section 5): for ten tissue-bearing joints, in each joint's own frame,
//! proper acceleration, angular velocity and angular acceleration; then local rotations and β. It
//! does not depend on where the body stands or which way it faces, unlike the pose-and-shape input
//! of DSNet (Seo, Zou, Cordier 2021).

mod kinematics;

use dynaskin_body::{JOINT_COUNT, Joint, Pose, SHAPE_COUNT, WorldJoints};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use glam::{DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};

pub use kinematics::{
    ANGULAR_ACCELERATION_LIMIT, ANGULAR_VELOCITY_LIMIT, GRAVITY_M_S2, LINEAR_ACCELERATION_LIMIT,
    SoftLimit, rotation_vector,
};

use crate::RuntimeError;
use crate::pose::normalized;
use crate::state::{Reader, Writer};
pub(crate) use kinematics::Kinematics;

/// The joints whose inertial motion is a feature, in feature order.
pub const INERTIAL_JOINTS: [Joint; 10] = [
    Joint::Pelvis,
    Joint::Spine1,
    Joint::Spine2,
    Joint::Spine3,
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftShoulder,
    Joint::RightShoulder,
];

/// The joints whose local rotation is a feature, in feature order.
pub const ROTATION_JOINTS: [Joint; 11] = [
    Joint::Spine1,
    Joint::Spine2,
    Joint::Spine3,
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftCollar,
    Joint::RightCollar,
    Joint::LeftShoulder,
    Joint::RightShoulder,
];

/// Number of features of kind `inertial`: 9 numbers for each of [`INERTIAL_JOINTS`], 6 for each
/// of [`ROTATION_JOINTS`], and β.
pub const INERTIAL_FEATURE_COUNT: usize =
    9 * INERTIAL_JOINTS.len() + 6 * ROTATION_JOINTS.len() + SHAPE_COUNT;

/// What a network takes as input, as named in `bundle.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureKind {
    /// Accelerations and angular motion in joint frames; see [`InertialFeatures`].
    Inertial,
}

impl FeatureKind {
    /// Number of features of this kind.
    pub const fn count(self) -> usize {
        match self {
            Self::Inertial => INERTIAL_FEATURE_COUNT,
        }
    }

    /// What each feature is, in order: `pelvis.proper_acceleration.x`, ..., `shape.9`.
    pub fn names(self) -> Vec<String> {
        let mut names = Vec::with_capacity(self.count());
        for joint in INERTIAL_JOINTS {
            for quantity in [
                "proper_acceleration",
                "angular_velocity",
                "angular_acceleration",
            ] {
                names.extend(["x", "y", "z"].map(|a| format!("{}.{quantity}.{a}", joint.name())));
            }
        }
        for joint in ROTATION_JOINTS {
            for column in ["x_axis", "y_axis"] {
                names.extend(["x", "y", "z"].map(|a| format!("{}.{column}.{a}", joint.name())));
            }
        }
        names.extend((0..SHAPE_COUNT).map(|idx| format!("shape.{idx}")));
        names
    }
}

/// Features of kind `inertial`, computed pose by pose at 60 Hz.
///
/// At tick t all derivatives are backward differences over the poses so far (ARCHITECTURE.md,
/// "Causal kinematics"): `a_t = (x_t - 2 x_{t-1} + x_{t-2}) / dt²`,
/// `ω_t = log(R_t R_{t-1}ᵀ) / dt`, `α_t = (ω_t - ω_{t-1}) / dt`. Before three poses exist the
/// accelerations are 0, before two the angular velocity is 0. Acceleration and angular motion are
/// softly limited ([`LINEAR_ACCELERATION_LIMIT`] and its siblings), because captured motion has
/// whips far above what tissue was simulated with (342 m/s² in one CMU clip).
///
/// For each of [`INERTIAL_JOINTS`], in the joint's own frame: acceleration minus gravity (m/s²),
/// angular velocity (rad/s), angular acceleration (rad/s²). For each of [`ROTATION_JOINTS`]: the
/// first two columns of `R - I`, R being the local rotation. Then β.
#[derive(Clone, Debug)]
pub struct InertialFeatures {
    joints_rest_m: [Vec3; JOINT_COUNT],
    kinematics: Kinematics,
    features: [f32; INERTIAL_FEATURE_COUNT],
    root_inertia: f64,
}

impl InertialFeatures {
    /// For a body with the rest joints `joints_rest_m` (metres, of the body shaped with `shape`,
    /// in model space) and shape coefficients β in standard deviations.
    pub fn new(joints_rest_m: &[Vec3; JOINT_COUNT], shape: &[f32; SHAPE_COUNT]) -> Self {
        let mut features = [0.0; INERTIAL_FEATURE_COUNT];
        features[INERTIAL_FEATURE_COUNT - SHAPE_COUNT..].copy_from_slice(shape);
        Self {
            joints_rest_m: *joints_rest_m,
            kinematics: Kinematics::default(),
            features,
            root_inertia: 1.0,
        }
    }

    /// Scales how much of the pelvis's own acceleration the joints are said to feel; 1 (all of it)
    /// is what networks are trained with.
    pub fn set_root_inertia(&mut self, root_inertia: f64) {
        self.root_inertia = root_inertia;
    }

    pub(crate) fn write(&self, writer: &mut Writer) {
        self.kinematics.write(writer);
    }

    /// Past poses of a saved state, for [`Self::set_past`].
    pub(crate) fn read_past(
        reader: &mut Reader<'_>,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Kinematics, RuntimeError> {
        Kinematics::read(reader, joints_rest_m)
    }

    pub(crate) fn set_past(&mut self, past: Kinematics) {
        self.kinematics = past;
    }

    /// Changes the unit of length of all poses to come; `ratio` is the old one over the new one.
    /// The past is converted, so that the change is not taken for motion.
    pub fn rescale(&mut self, ratio: f64) {
        self.kinematics.rescale(ratio, &self.joints_rest_m);
    }

    /// The features of the tick at which the body takes `pose`, one tick (1/60 s) after the pose
    /// pushed before. The pose must be valid ([`Pose::is_valid`]).
    pub fn push(&mut self, pose: &Pose) -> &[f32] {
        let pose = normalized(pose);
        let world = pose.world_joints(&self.joints_rest_m);
        self.write_inertial(&world);
        self.write_rotations(&pose);
        self.kinematics.advance(pose, world);
        &self.features
    }

    /// The features of the tick that was pushed last.
    pub fn values(&self) -> &[f32] {
        &self.features
    }

    /// Forgets the poses pushed so far: the next one counts as the first.
    pub fn reset(&mut self) {
        self.kinematics = Kinematics::default();
    }

    /// Changes the body's shape. Past joint positions are recomputed, so that the change is not
    /// taken for an acceleration.
    pub fn set_shape(&mut self, joints_rest_m: &[Vec3; JOINT_COUNT], shape: &[f32; SHAPE_COUNT]) {
        self.joints_rest_m = *joints_rest_m;
        self.features[INERTIAL_FEATURE_COUNT - SHAPE_COUNT..].copy_from_slice(shape);
        self.kinematics.move_joints(joints_rest_m);
    }

    fn write_inertial(&mut self, world: &WorldJoints) {
        let pelvis = self.kinematics.of_joint(Joint::Pelvis, world).acceleration;
        let left_out = pelvis * (1.0 - self.root_inertia);
        for (slot, joint) in INERTIAL_JOINTS.into_iter().enumerate() {
            let motion = self.kinematics.of_joint(joint, world);
            let joint_from_world = world.rotation[joint as usize].conjugate();
            let gravity = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);
            let proper = LINEAR_ACCELERATION_LIMIT.apply(motion.acceleration - left_out) - gravity;
            let quantities = [
                proper,
                ANGULAR_VELOCITY_LIMIT.apply(motion.angular_velocity),
                ANGULAR_ACCELERATION_LIMIT.apply(motion.angular_acceleration),
            ];
            for (k, quantity) in quantities.into_iter().enumerate() {
                let start = 9 * slot + 3 * k;
                let local = (joint_from_world * quantity).as_vec3();
                self.features[start..start + 3].copy_from_slice(&local.to_array());
            }
        }
    }

    fn write_rotations(&mut self, pose: &Pose) {
        let first = 9 * INERTIAL_JOINTS.len();
        for (slot, joint) in ROTATION_JOINTS.into_iter().enumerate() {
            let rotation = DMat3::from_quat(pose.parent_from_joint[joint as usize]);
            let start = first + 6 * slot;
            let x = (rotation.x_axis - DVec3::X).as_vec3();
            let y = (rotation.y_axis - DVec3::Y).as_vec3();
            self.features[start..start + 3].copy_from_slice(&x.to_array());
            self.features[start + 3..start + 6].copy_from_slice(&y.to_array());
        }
    }
}

/// Features of every frame of `clip`, `[frame][feature]` row-major, for a body with the rest joints
/// `joints_rest_m` and shape `shape`. The first frame has no past.
///
/// # Errors
/// [`RuntimeError::ClipRate`] where the clip is not at 60 Hz; [`RuntimeError::InvalidPose`] where a
/// frame holds a number that is not finite or a quaternion that is not of unit length.
pub fn clip_features(
    kind: FeatureKind,
    clip: &Clip,
    joints_rest_m: &[Vec3; JOINT_COUNT],
    shape: &[f32; SHAPE_COUNT],
) -> Result<Vec<f32>, RuntimeError> {
    if (clip.rate_hz - MODEL_RATE_HZ).abs() > 1e-6 * MODEL_RATE_HZ {
        return Err(RuntimeError::ClipRate {
            name: clip.name.clone(),
            got_hz: clip.rate_hz,
        });
    }
    let mut features = Vec::with_capacity(clip.frames.len() * kind.count());
    let FeatureKind::Inertial = kind;
    let mut inertial = InertialFeatures::new(joints_rest_m, shape);
    for pose in &clip.frames {
        crate::pose::check(pose)?;
        features.extend_from_slice(inertial.push(pose));
    }
    Ok(features)
}
