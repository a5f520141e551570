//! The body model of dynaskin: template, shape, joints, skinning and its inverse.
//!
//! Equations 1-4 of DSNet (Seo, Zou, Cordier 2021) and of Casas & Otaduy (2018): a template plus
//! shape (and, where a model has them, pose) blend shapes, joints linear in the shape
//! coefficients, and skinning along SMPL's 24-joint tree. Offsets of the soft tissue are added in
//! the rest pose, before skinning.
//!
//! Conventions: metres, radians, seconds; right-handed, +Y up, facing +Z, the body's left at +X.
//! A joint's rest frame is aligned with the model's axes. The model's origin lies on the floor
//! under the pelvis, so a shape at zero pose and zero translation stands on y = 0.

mod correctives;
mod error;
mod figure;
mod glb;
mod materials;
mod measures;
mod model;
mod normals;
mod parts;
mod region;
mod sex;
mod skinning;
#[cfg(feature = "smpl")]
mod smpl;

pub use correctives::PoseCorrectives;
pub use dynaskin_skeleton::{JOINT_COUNT, Joint, Pose, Skinning, WorldJoints};
pub use error::BodyError;
pub use figure::{Figure, FigureError, Figures, LARGEST_DISTANCE, LEAST_STATURE_M, Trait};
pub use glb::{POSITION_STEP_M, THICKNESS_STEP_M};
pub use materials::Materials;
pub use measures::{DENSITY_KG_PER_M3, chest_girth_m, stature_m, volume_m3};
pub use model::{
    BodyModel, LEAST_THICKNESS_M, MAX_EXTENT_M, MAX_SHAPE_COEFFICIENT, POSE_DIR_COUNT, SHAPE_COUNT,
    SMPL_VERTEX_COUNT, ShapedBody, SkinWeights, add_correctives,
};
pub use normals::{add_face_normals, vertex_normals, vertex_normals_into};
pub use parts::PARTS;
pub use region::{REGION_COUNT, Region};
pub use sex::Sex;
pub use skinning::{
    SkinMatrices, Unposing, skin_dual_quaternion, skin_linear, skin_surface,
    unpose_dual_quaternion, unpose_linear,
};
#[cfg(feature = "smpl")]
pub use smpl::{SmplFile, SmplLayout};
