//! The input of the networks: features of the motion and the body, once per 60 Hz tick.
//!
//! This is the only place that computes them: training and runtime call the same code, so a
//! network gets the same input in the browser as in training.
//!
//! [`FeatureKind`] lists the kinds.

mod collars;
#[cfg(feature = "guests")]
mod guests;
mod kind;
mod limits;

pub use dynaskin_body::Materials;
use dynaskin_body::SHAPE_COUNT;
use dynaskin_skeleton::{
    GRAVITY_M_S2, JOINT_COUNT, Joint, Kinematics, MODEL_RATE_HZ, Pose, WorldJoints,
};
use glam::{DMat3, DVec3, Vec3};

pub(crate) use kind::GUEST_KINDS;
pub use kind::{
    BENDING_JOINTS, FeatureKind, INERTIAL_FEATURE_COUNT, INERTIAL_JOINTS, MATERIAL_COUNT,
    ROTATION_JOINTS,
};
pub use limits::{ANGULAR_ACCELERATION_LIMIT, ANGULAR_VELOCITY_LIMIT, LINEAR_ACCELERATION_LIMIT};

use crate::RuntimeError;
use crate::pose::normalized;

/// Features of one [`FeatureKind`], computed pose by pose at 60 Hz.
///
/// At tick t all derivatives are backward differences over the poses so far (ARCHITECTURE.md,
/// "Causal kinematics"): `a_t = (x_t - 2 x_{t-1} + x_{t-2}) / dt²`,
/// `ω_t = log(R_t R_{t-1}ᵀ) / dt`, `α_t = (ω_t - ω_{t-1}) / dt`. Before three poses exist the
/// accelerations are 0, before two the angular velocity is 0; kinds that take past poses themselves
/// are given the first one for those there are not. Acceleration and angular motion are softly
/// limited ([`LINEAR_ACCELERATION_LIMIT`] and its siblings), because captured motion has whips far
/// above what tissue was simulated with (342 m/s² in one CMU clip).
#[derive(Clone, Debug)]
pub struct MotionFeatures {
    kind: FeatureKind,
    joints_rest_m: [Vec3; JOINT_COUNT],
    kinematics: Kinematics,
    /// As many as the kind has.
    features: Vec<f32>,
    root_inertia: f64,
}

impl MotionFeatures {
    /// For a body of the usual tissue with the rest joints `joints_rest_m` (metres, of the body
    /// shaped with `shape`, in model space) and shape coefficients β in standard deviations.
    pub fn new(
        kind: FeatureKind,
        joints_rest_m: &[Vec3; JOINT_COUNT],
        shape: &[f32; SHAPE_COUNT],
    ) -> Self {
        let mut features = vec![0.0; kind.count()];
        features[kind.count() - SHAPE_COUNT..].copy_from_slice(shape);
        Self {
            kind,
            joints_rest_m: *joints_rest_m,
            kinematics: Kinematics::default(),
            features,
            root_inertia: 1.0,
        }
    }

    /// Changes what the tissue is made of. Kinds without materials know only the usual tissue.
    ///
    /// # Panics
    /// For factors that are not positive, in debug builds.
    pub fn set_materials(&mut self, materials: &Materials) {
        if !self.kind.has_materials() {
            return;
        }
        let factors = materials.stiffness.iter().chain(&materials.damping);
        let first = self.kind.motion_count();
        for (feature, factor) in self.features[first..].iter_mut().zip(factors) {
            debug_assert!(*factor > 0.0, "{factor}");
            *feature = factor.log2();
        }
    }

    /// Scales how much of the pelvis's own acceleration is in the features; 1 (all of it)
    /// is what networks are trained with.
    pub fn set_root_inertia(&mut self, root_inertia: f64) {
        self.root_inertia = root_inertia;
    }

    /// The poses before the current one, newest first.
    pub(crate) fn past(&self) -> [Option<Pose>; 2] {
        self.kinematics.past_poses().map(Option::<&Pose>::cloned)
    }

    /// Goes on from these poses instead.
    pub(crate) fn set_past(&mut self, past: [Option<Pose>; 2]) {
        self.kinematics = Kinematics::new(past, &self.joints_rest_m);
    }

    /// Changes the unit of length of all poses to come; `ratio` is the old one over the new one.
    /// The past is converted, so that the change is not taken for motion.
    pub fn rescale(&mut self, ratio: f64) {
        self.kinematics.rescale(ratio, &self.joints_rest_m);
    }

    /// The features of the tick at which the body takes `pose`, one tick (1/60 s) after the pose
    /// pushed before. The pose must be valid ([`Pose::is_valid`]).
    pub fn push(&mut self, pose: &Pose) -> &[f32] {
        let pose = match self.kind {
            FeatureKind::Inertial => collars::folded(normalized(pose)),
            FeatureKind::InertialMaterials => normalized(pose),
            #[cfg(feature = "guests")]
            FeatureKind::PoseShape | FeatureKind::PoseWindow => normalized(pose),
        };
        let world = pose.world_joints(&self.joints_rest_m);
        match self.kind {
            FeatureKind::Inertial => {
                self.write_inertial(&world);
                self.write_rotations(&pose);
            }
            FeatureKind::InertialMaterials => {
                self.write_inertial(&world);
                self.write_rotations(&collars::arms_against_trunk(pose.clone()));
            }
            #[cfg(feature = "guests")]
            FeatureKind::PoseShape => guests::write_pose_shape(&pose, &mut self.features),
            #[cfg(feature = "guests")]
            FeatureKind::PoseWindow => {
                guests::write_window(&pose, self.kinematics.past_poses(), &mut self.features);
            }
        }
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
        let first = self.kind.count() - SHAPE_COUNT;
        self.features[first..].copy_from_slice(shape);
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
        for (slot, joint) in self.kind.rotation_joints().iter().enumerate() {
            let rotation = DMat3::from_quat(pose.parent_from_joint[*joint as usize]);
            let start = first + 6 * slot;
            let x = (rotation.x_axis - DVec3::X).as_vec3();
            let y = (rotation.y_axis - DVec3::Y).as_vec3();
            self.features[start..start + 3].copy_from_slice(&x.to_array());
            self.features[start + 3..start + 6].copy_from_slice(&y.to_array());
        }
    }
}

/// Features of every one of `frames`, `rate_hz` a second, as `[frame][feature]` row-major, for a body
/// with the rest joints `joints_rest_m` (metres) and shape coefficients `shape`. The first frame has
/// no past.
///
/// # Errors
/// [`RuntimeError::ClipRate`] where the frames are not at 60 Hz; [`RuntimeError::InvalidPose`] where a
/// frame holds a number that is not finite or a quaternion that is not of unit length.
pub fn clip_features(
    kind: FeatureKind,
    frames: &[Pose],
    rate_hz: f64,
    joints_rest_m: &[Vec3; JOINT_COUNT],
    shape: &[f32; SHAPE_COUNT],
    materials: &Materials,
) -> Result<Vec<f32>, RuntimeError> {
    if (rate_hz - MODEL_RATE_HZ).abs() > 1e-6 * MODEL_RATE_HZ {
        return Err(RuntimeError::ClipRate { got_hz: rate_hz });
    }
    let mut features = Vec::with_capacity(frames.len() * kind.count());
    let mut motion = MotionFeatures::new(kind, joints_rest_m, shape);
    motion.set_materials(materials);
    for pose in frames {
        crate::pose::check(pose)?;
        features.extend_from_slice(motion.push(pose));
    }
    Ok(features)
}
