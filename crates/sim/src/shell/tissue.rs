//! What a shell holds.

use dynaskin_body::{JOINT_COUNT, SkinWeights};
use glam::Vec3;

use crate::contact::ContactSurface;
use crate::nearby::Blur;

/// One body shape's soft tissue, ready to be simulated.
///
/// Under each moving skin vertex hangs a *column* of nodes, down to the inner surface, whose nodes
/// follow the bones exactly; so do the columns of the ring around the moving ones. Faces between
/// columns become prisms, each split into three tetrahedra.
///
/// The elastic energy per volume is a neo-Hookean one (Macklin & Müller 2021, "A constraint-based
/// formulation of stable neo-Hookean materials") in `F = I + grad d`. d is the displacement from the
/// skinned surface; the gradient is taken in the rest shape rotated with the bones. The energy is `G/2 (i + k i²/2) - G (J - 1) + B/2 (J - 1)²` with `i = tr(FᵀF) - 3`, J the volume ratio, k
/// the stiffening and B the larger of `bulk_ratio` · G and `least_bulk_pa`. At small strain G is
/// the shear modulus and B - G Lamé's first parameter. It is exactly at rest at d = 0.
#[derive(Clone, Debug)]
pub struct Shell {
    /// Body vertices that move, ascending; index into it is a *slot*.
    pub(crate) vertices: Vec<u32>,
    /// Skin weights of each column; the first `vertices.len()` are the slots, then the ring.
    pub(crate) column_skin: Vec<SkinWeights>,
    /// Rest positions of the free nodes in metres: node `layer * vertices.len() + slot`.
    pub(crate) node_rest_m: Vec<Vec3>,
    /// Mass of each free node in kg, as the material has it.
    pub(crate) node_mass_kg: Vec<f32>,
    /// Damping rate of each free node in 1/s.
    pub(crate) node_damping_per_s: Vec<f32>,
    /// Prisms that have a tetrahedron.
    pub(crate) prisms: Vec<Prism>,
    pub(crate) triangles: Vec<Triangle>,
    /// The three columns under each face.
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) joints_rest_m: [Vec3; JOINT_COUNT],
    /// Depth of each slot's tissue in metres.
    pub(crate) depth_m: Vec<f32>,
    /// Rest positions of all columns in metres, slots first.
    pub(crate) column_rest_m: Vec<Vec3>,
    pub(crate) contact: ContactSurface,
    /// What skin evens out; over columns.
    pub(crate) skin_blur: Blur,
    pub(crate) report: ShellReport,
}

/// What building a [`Shell`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellReport {
    /// Moving vertices.
    pub vertices: usize,
    /// Tetrahedra.
    pub tets: usize,
    /// Tetrahedra left out because they are inverted or slivers.
    pub dropped_tets: usize,
    /// Columns whose depth was cut so that no element inverts.
    pub shortened_columns: usize,
    /// Mass of all free nodes in kg.
    pub mass_kg: f32,
    /// Least, mean and largest depth of the tissue in metres.
    pub depth_m: [f32; 3],
}

/// Tetrahedra that a prism is split into.
pub(crate) const TETS_PER_PRISM: usize = 3;

/// One layer under a face.
#[derive(Clone, Debug)]
pub(crate) struct Prism {
    /// Nodes: the upper corners a, b and c, then the lower ones. The number of free nodes stands for
    /// "fixed to the bone". The tetrahedra are (a, b, c, lower c), (a, b, lower b, lower c) and
    /// (a, lower a, lower b, lower c).
    pub nodes: [u32; 6],
    /// Face it lies under, whose rotation it follows.
    pub face: u32,
    pub tets: [Tet; TETS_PER_PRISM],
}

/// A linear tetrahedron.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tet {
    /// Rest gradients of the shape functions of corners 1..4, in 1/m; corner 0 has minus their sum.
    pub gradients_per_m: [Vec3; 3],
    /// Volume in m³ times shear modulus in Pa; 0 for one that was left out.
    pub stiffness_joules: f32,
    /// Volume in m³ times modulus of the volume term in Pa.
    pub bulk_joules: f32,
    /// How many times stiffer it gets at the strain it is expected to reach.
    pub strain_margin: f32,
}

impl Prism {
    /// Corners of each tetrahedron, as places in [`Self::nodes`].
    pub const CORNERS: [[usize; 4]; TETS_PER_PRISM] = [[0, 1, 2, 5], [0, 1, 4, 5], [0, 3, 4, 5]];
}

/// A piece of skin.
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    /// Nodes, as of [`Prism`].
    pub nodes: [u32; 3],
    /// Two unit vectors in its rest plane.
    pub tangents: [Vec3; 2],
    /// Rest gradients of corners 1 and 2 along the tangents, in 1/m.
    pub gradients_per_m: [[f32; 2]; 2],
    /// Area in m² times the skin's stiffness in N/m.
    pub stiffness_joules: f32,
    /// Face that it is, whose rotation it follows.
    pub face: u32,
}
