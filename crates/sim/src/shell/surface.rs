//! The outer surface of the tissue.

use dynaskin_body::{BodyModel, JOINT_COUNT, Region, SHAPE_COUNT, SkinWeights};
use glam::Vec3;

/// Why no shell could be built.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum ShellError {
    /// The model tells no tissue thickness or region weights.
    #[error(
        "body {body} has no {what}: only bodies built by `dynaskin body build` can be simulated"
    )]
    NoTissue {
        /// The body model.
        body: String,
        /// What is missing.
        what: &'static str,
    },
    /// Nothing is soft enough to move.
    #[error("body {body}: no vertex has region weights above {threshold}")]
    NothingSoft {
        /// The body model.
        body: String,
        /// The threshold that no vertex passes.
        threshold: f32,
    },
}

/// A surface over bone, from which [`super::Shell::new`] builds: a body, or a slab in a test.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Rest positions in metres, `[vertex]`.
    pub positions_m: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// Skin weights, `[vertex]`.
    pub skin: Vec<SkinWeights>,
    /// Rest joint positions in metres.
    pub joints_rest_m: [Vec3; JOINT_COUNT],
    /// Depth of the tissue in metres, `[vertex]`.
    pub depth_m: Vec<f32>,
    /// Weight of each region, `[region][vertex]`; a vertex moves where they sum to more than
    /// [`crate::SimSettings::softness_threshold`].
    pub region_weights: Vec<Vec<f32>>,
    /// One number per vertex by which faces are split into tetrahedra. Equal for mirrored
    /// vertices, so that the two sides of a body are split alike.
    pub split_order: Vec<f32>,
}

impl Surface {
    /// The surface of a body at one shape.
    ///
    /// # Errors
    /// [`ShellError::NoTissue`] if the model has no thickness or no region weights.
    pub fn of_body(model: &BodyModel, shape: &[f32; SHAPE_COUNT]) -> Result<Self, ShellError> {
        let missing = |what| ShellError::NoTissue {
            body: model.name.clone(),
            what,
        };
        let shaped = model.shaped(shape);
        if shaped.thickness_m.len() != model.vertex_count() {
            return Err(missing("tissue thickness"));
        }
        if model.region_weights.len() != Region::ALL.len() {
            return Err(missing("region weights"));
        }
        Ok(Self {
            positions_m: shaped.positions_m,
            faces: model.faces.clone(),
            skin: model.skin.clone(),
            joints_rest_m: shaped.joints_m,
            depth_m: shaped.thickness_m,
            region_weights: model.region_weights.clone(),
            split_order: model
                .template_m
                .iter()
                .map(|p| p.y + 0.37 * p.x.abs() + 0.21 * p.z)
                .collect(),
        })
    }
}
