//! Why an avatar cannot be bound, or a binding not be used.

use dynaskin_glb::GlbError;
use dynaskin_motion::MotionError;

use dynaskin_binding::BindingError;

use crate::proportions::{LEAST_HIP_HEIGHT, LEAST_STATURE_M, MOST_CROWN_TO_SHOULDER, Proportions};

/// Why an avatar cannot be bound.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BindError {
    /// The file is no binary glTF, or a part of it is missing, cut or of the wrong type.
    #[error("avatar file, {0}")]
    Glb(#[from] GlbError),
    /// No mesh of the file has a skin.
    #[error(
        "{}: soft tissue follows bones, so export the avatar with its armature and weights",
        unskinned(*meshes)
    )]
    Unskinned {
        /// Meshes in the file.
        meshes: usize,
    },
    /// The skinned meshes have more vertices than an avatar.
    #[error(
        "the avatar has {vertices} vertices, at most {limit} are bound: thin the mesh, or export a \
         lower level of detail"
    )]
    TooManyVertices {
        /// Vertices of all skinned meshes.
        vertices: usize,
        /// The most that are bound.
        limit: usize,
    },
    /// A number of a mesh or of the skeleton is not finite, or absurdly large.
    #[error("{place}: {found} is no usable number; export the avatar again")]
    NotFinite {
        /// Mesh and vertex, or node.
        place: String,
        /// The number.
        found: f64,
    },
    /// The skinned meshes have no surface.
    #[error(
        "the skinned meshes have {faces} triangles and no surface to speak of ({area_m2} m²); \
         export the avatar with its faces"
    )]
    NoSurface {
        /// Triangles of all skinned meshes.
        faces: usize,
        /// Their area in square metres.
        area_m2: f64,
    },
    /// Neither names nor shape of the skeleton show a person.
    #[error("no person was found in the skeleton: {0}")]
    NoHumanoid(MotionError),
    /// The caller's choice of bones cannot be used.
    #[error("{0}")]
    Bones(MotionError),
    /// The skeleton does not stand upright, as an animal's.
    #[error(
        "the trunk leans {lean_degrees:.0} degrees from upright where the avatar rests: this is no \
         person who stands, and soft tissue is made for people alone"
    )]
    NotUpright {
        /// Between the trunk and the way up.
        lean_degrees: f64,
    },
    /// The caller has not said that the avatar shows an adult.
    #[error(
        "soft tissue is for adults alone: say that the avatar depicts one (`depicts: \"adult\"`, \
         `--depicts adult`), got {}",
        .declared.as_deref().map_or_else(|| "nothing".to_owned(), |word| format!("`{word}`"))
    )]
    Undeclared {
        /// What the caller said.
        declared: Option<String>,
    },
    /// The avatar has the proportions of a child or of a toon.
    #[error(
        "the avatar has not the proportions of an adult: {}; soft tissue is for adults alone, and \
         there is no way around this", why(.0)
    )]
    NotAdult(Proportions),
    /// A binding cannot be read, or belongs to another avatar or body.
    #[error(transparent)]
    Binding(#[from] BindingError),
    /// The body lacks what a binding needs.
    #[error("the body cannot be bound to an avatar: {0}")]
    Body(&'static str),
    /// The equations of the fit have no solution.
    #[error("the body could not be fitted to the avatar: {0}")]
    NoFit(&'static str),
}

impl BindError {
    /// The kind of the error, as a string that programs can switch on: `avatar` (its meshes), `humanoid` (its
    /// bones), `adult`, `binding` or `body`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoHumanoid(_) | Self::Bones(_) | Self::NotUpright { .. } => "humanoid",
            Self::Undeclared { .. } | Self::NotAdult(_) => "adult",
            Self::Binding(_) => "binding",
            Self::Body(_) => "body",
            _ => "avatar",
        }
    }
}

/// What is wrong with a file of so many meshes, none of which is skinned.
fn unskinned(meshes: usize) -> String {
    match meshes {
        0 => "the file has no mesh".to_owned(),
        1 => "the file has one mesh, and it is not skinned".to_owned(),
        _ => format!("the file has {meshes} meshes and none of them is skinned"),
    }
}

/// Nobody is smaller: the file is in another unit, metres.
const LEAST_PERSON_M: f64 = 0.3;

/// Which proportions are not those of an adult.
fn why(found: &Proportions) -> String {
    let mut reasons = Vec::new();
    if found.crown_to_shoulder >= MOST_CROWN_TO_SHOULDER {
        reasons.push(format!(
            "crown to shoulder is {:.3} of the stature (below {MOST_CROWN_TO_SHOULDER} for adults)",
            found.crown_to_shoulder
        ));
    }
    if found.hip_height <= LEAST_HIP_HEIGHT {
        reasons.push(format!(
            "the hips stand at {:.3} of the stature (above {LEAST_HIP_HEIGHT} for adults)",
            found.hip_height
        ));
    }
    if let Some(stature_m) = found
        .stature_m
        .filter(|stature_m| *stature_m < LEAST_STATURE_M)
    {
        let unit = if stature_m < LEAST_PERSON_M {
            ", and a file's unit is the metre"
        } else {
            ""
        };
        reasons.push(format!(
            "it is {stature_m:.2} m tall (at least {LEAST_STATURE_M} m for adults{unit})"
        ));
    }
    if reasons.is_empty() {
        reasons.push("they cannot be measured".to_owned());
    }
    reasons.join(", ")
}
