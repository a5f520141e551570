//! Bodies as glTF 2.0 binary files.
//!
//! Any viewer shows the skinned, colourful body with its ten shape coefficients as morph targets
//! `shape_0` to `shape_9`. Everything is in metres, with no scale anywhere, because not every program undoes
//! one of the inverse bind matrices. Positions are floats that are whole multiples of [`POSITION_STEP_M`]. Morphs are
//! too, but stored as normalised 16-bit integers (`KHR_mesh_quantization`), of which 32,767 is a metre: others see
//! them within 0.02 mm, reading a body rounds them to its steps. Normals are such integers. Bodies of earlier versions,
//! in steps that the inverse bind matrices scale, are read as well. What glTF has no
//! place for stands in the mesh's `extras.dynaskin`, each entry an accessor index:
//!
//! | key | accessor | meaning |
//! |---|---|---|
//! | `joint_template` | 24 × VEC3 f32 | rest joints at β = 0, metres |
//! | `joint_shape_dirs` | 240 × VEC3 f32 | metres per standard deviation, coefficient by coefficient |
//! | `thickness` | 11 × V SCALAR i16 | template, then ten directions, steps of [`THICKNESS_STEP_M`] |
//! | `region_weights` | 6 × V SCALAR u8 | in [`Region::ALL`](crate::Region::ALL) order, 255 is 1 |
//! | `colors` | V VEC4 u8 | sRGB and opacity of the vertices of a body painted in two colours |
//! | `pose_dirs` | 207 × V VEC3 i16 | pose correctives, field by field, each in steps of its own |
//! | `pose_dir_steps` | 207 SCALAR f32 | the step of each field in metres, a power of two |
//!
//! A body that is painted in two colours and mixtures of them, such as skin and clothes, shows a sharp line between
//! them in any viewer: `TEXCOORD_0` says how far from that line a vertex is, and the base colour is a texture that
//! steps from one colour to the other in its middle. Other colours are `COLOR_0`.
//!
//! `name` is the body's name and `version` is 1. `thickness`, `region_weights`, the pose correctives
//! and the colours are left out where a model knows none. `asset.copyright` is the body's. Reading a
//! written body and writing it again gives the same bytes.

mod painting;
mod pose_dirs;
mod read;
mod write;

use serde::{Deserialize, Serialize};

pub(crate) use pose_dirs::smallest_step_m;

/// Step of quantised positions and morphs, metres.
pub const POSITION_STEP_M: f32 = 1e-4;
/// Step of quantised tissue thickness, metres.
pub const THICKNESS_STEP_M: f32 = 1e-5;
/// Farthest position along an axis, metres.
const MAX_POSITION_M: f32 = 3.2767;
/// The whole number that stands for 1.
const NORMALIZED: f32 = 32_767.0;
const EXTRAS_VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct MeshExtras {
    dynaskin: BodyExtras,
}

#[derive(Serialize, Deserialize)]
struct BodyExtras {
    version: u32,
    name: String,
    joint_template: usize,
    joint_shape_dirs: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    thickness: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    region_weights: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    colors: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose_dirs: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose_dir_steps: Option<usize>,
}
