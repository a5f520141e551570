//! What networks can take as input.

use dynaskin_body::{Joint, REGION_COUNT, Region, SHAPE_COUNT};
use serde::{Deserialize, Serialize};

#[cfg(feature = "guests")]
use super::guests::{
    POSE_SHAPE_JOINTS, POSE_SHAPE_POSE_COUNT, WINDOW_POSE_COUNT, WINDOW_POSES, pose_names,
};

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

/// The joints whose local rotation is a feature of kind `inertial-materials`, in feature order. Those after
/// the first eleven, elbows and ankles, bend the ends of the tissue of arms and calves.
pub const BENDING_JOINTS: [Joint; 15] = [
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
    Joint::LeftElbow,
    Joint::RightElbow,
    Joint::LeftAnkle,
    Joint::RightAnkle,
];

/// The joints whose local rotation is a feature of kind `inertial`, in feature order: the first of
/// [`BENDING_JOINTS`].
pub const ROTATION_JOINTS: [Joint; 11] = match BENDING_JOINTS.first_chunk() {
    Some(joints) => *joints,
    None => unreachable!(),
};

/// Motion features of kind `inertial`: 9 numbers for each of [`INERTIAL_JOINTS`], 6 for each of
/// [`ROTATION_JOINTS`].
const INERTIAL_MOTION_COUNT: usize = 9 * INERTIAL_JOINTS.len() + 6 * ROTATION_JOINTS.len();

/// Number of features of kind `inertial`: its motion, and β.
pub const INERTIAL_FEATURE_COUNT: usize = INERTIAL_MOTION_COUNT + SHAPE_COUNT;

/// Numbers that tell a body's materials: stiffness and damping of each region.
pub const MATERIAL_COUNT: usize = 2 * REGION_COUNT;

/// What a network takes as input, as named in `bundle.json`. Each kind is some numbers about the
/// motion, then some about the body: its materials where the kind has them, and β last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FeatureKind {
    /// For each of [`INERTIAL_JOINTS`], in the joint's own frame: acceleration minus gravity
    /// (m/s²), angular velocity (rad/s), angular acceleration (rad/s²). For each of
    /// [`ROTATION_JOINTS`]: the first two columns of `R - I`, R being the local rotation. Then β.
    /// It does not depend on where the body stands or which way it faces. Collars count at the shoulders.
    Inertial,
    /// For each of [`INERTIAL_JOINTS`] the same. For each of [`BENDING_JOINTS`] the first two columns of
    /// `R - I`; the shoulders' R is that of the upper arm against the trunk, whatever share of it the
    /// collar takes. Then the materials of the six regions: binary logarithms of the factors on stiffness,
    /// then of those on the damping ratio. Then β.
    InertialMaterials,
    /// DSNet's input (Seo, Zou, Cordier 2021, section 4): the root's translation (m), a rotation
    /// vector (rad) for each joint but the hands, and β.
    #[cfg(feature = "guests")]
    PoseShape,
    /// The poses that Casas & Otaduy (2018, section 3.4) regress from, of this tick and of the two
    /// before it, newest first. Each is a root translation (m) and a rotation vector (rad) for each
    /// joint. Then β, which they did not need because they trained one network a subject.
    #[cfg(feature = "guests")]
    PoseWindow,
}

/// Names of the kinds that exist only with the feature `guests`.
pub(crate) const GUEST_KINDS: [&str; 2] = ["pose-shape", "pose-window"];

impl FeatureKind {
    /// Number of features of this kind.
    pub const fn count(self) -> usize {
        self.motion_count() + self.condition_count()
    }

    /// How many of them, the first ones, are about the motion.
    pub const fn motion_count(self) -> usize {
        match self {
            Self::Inertial => INERTIAL_MOTION_COUNT,
            Self::InertialMaterials => 9 * INERTIAL_JOINTS.len() + 6 * BENDING_JOINTS.len(),
            #[cfg(feature = "guests")]
            Self::PoseShape => POSE_SHAPE_POSE_COUNT,
            #[cfg(feature = "guests")]
            Self::PoseWindow => WINDOW_POSES * WINDOW_POSE_COUNT,
        }
    }

    /// How many, the last ones, are about the body.
    pub const fn condition_count(self) -> usize {
        if self.has_materials() {
            MATERIAL_COUNT + SHAPE_COUNT
        } else {
            SHAPE_COUNT
        }
    }

    /// The joints whose local rotation is a feature, in feature order, where the kind is an inertial one.
    pub const fn rotation_joints(self) -> &'static [Joint] {
        match self {
            Self::Inertial => &ROTATION_JOINTS,
            Self::InertialMaterials => &BENDING_JOINTS,
            #[cfg(feature = "guests")]
            Self::PoseShape | Self::PoseWindow => &[],
        }
    }

    /// Whether materials are among them.
    pub const fn has_materials(self) -> bool {
        matches!(self, Self::InertialMaterials)
    }

    /// What each feature is, in order: `pelvis.proper_acceleration.x`, ..., `shape.9`.
    pub fn names(self) -> Vec<String> {
        let mut names = match self {
            Self::Inertial | Self::InertialMaterials => inertial_names(self.rotation_joints()),
            #[cfg(feature = "guests")]
            Self::PoseShape => pose_names("", POSE_SHAPE_JOINTS),
            #[cfg(feature = "guests")]
            Self::PoseWindow => ["", ".before", ".earlier"]
                .into_iter()
                .flat_map(|suffix| pose_names(suffix, dynaskin_body::JOINT_COUNT))
                .collect(),
        };
        if self.has_materials() {
            for quantity in ["stiffness", "damping"] {
                names.extend(Region::ALL.map(|region| format!("{}.{quantity}", region.name())));
            }
        }
        names.extend((0..SHAPE_COUNT).map(|idx| format!("shape.{idx}")));
        names
    }
}

fn inertial_names(rotation_joints: &[Joint]) -> Vec<String> {
    let mut names = Vec::new();
    for joint in INERTIAL_JOINTS {
        for quantity in [
            "proper_acceleration",
            "angular_velocity",
            "angular_acceleration",
        ] {
            names.extend(["x", "y", "z"].map(|a| format!("{}.{quantity}.{a}", joint.name())));
        }
    }
    for joint in rotation_joints {
        for column in ["x_axis", "y_axis"] {
            names.extend(["x", "y", "z"].map(|a| format!("{}.{column}.{a}", joint.name())));
        }
    }
    names
}
