//! An avatar from a file or an engine: nodes, skinned meshes, and names for parts of a person.

use std::collections::HashMap;

use dynaskin_binding::{Binding, BindingError, fingerprint_of_body};
use dynaskin_body::BodyModel;
use glam::{DAffine3, Vec3};

use crate::BindError;

/// Largest number of vertices of all skinned meshes together.
pub const MAX_VERTICES: usize = 400_000;
/// The farthest that anything of an avatar lies from the origin, in the file's unit.
const MAX_EXTENT: f64 = 1e6;
/// Largest number of joints per vertex.
pub const MAX_INFLUENCES: usize = 8;

/// A node of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its name in the file.
    pub name: String,
    /// The name by which it is recognised as a part of a person: VRM's or its own; empty if it must not
    /// be recognised as one.
    pub part_name: String,
    /// Index of its parent.
    pub parent: Option<usize>,
    /// Its transform in the loaded file, in the file's unit, +Y up.
    pub world_from_node: DAffine3,
}

/// The joints that move a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Influences {
    /// Indices into the mesh's joints; unused slots have weight 0.
    pub joints: [u16; MAX_INFLUENCES],
    /// Weights, summing to 1, or all 0 if the file has none.
    pub weights: [f32; MAX_INFLUENCES],
}

/// A skinned mesh: one primitive of the file, one draw of the engine.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinnedMesh {
    /// Name of the node or mesh, and number of the primitive.
    pub name: String,
    /// Name of the material; empty where it has none.
    pub material: String,
    /// Positions in the mesh's own space, `[vertex]`.
    pub positions: Vec<Vec3>,
    /// `[vertex]`.
    pub influences: Vec<Influences>,
    /// Triangles, `[face][corner]`.
    pub faces: Vec<[u32; 3]>,
    /// The nodes that are the skin's joints.
    pub joints: Vec<usize>,
    /// From the mesh's space to that of each joint, in the bind pose.
    pub inverse_binds: Vec<DAffine3>,
}

/// An avatar: everything that binding needs, whichever file or engine it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Avatar {
    /// The scene's nodes.
    pub nodes: Vec<Node>,
    /// Its skinned meshes.
    pub meshes: Vec<SkinnedMesh>,
}

impl Avatar {
    /// Vertices of all meshes.
    pub fn vertex_count(&self) -> usize {
        self.meshes.iter().map(|mesh| mesh.positions.len()).sum()
    }

    /// Refuses unusable numbers and indices.
    ///
    /// # Errors
    /// [`BindError::Unskinned`], [`BindError::TooManyVertices`], [`BindError::NotFinite`], and
    /// [`BindError::Glb`] for indices of what is not there.
    pub fn check(&self) -> Result<(), BindError> {
        if self.meshes.is_empty() {
            return Err(BindError::Unskinned { meshes: 0 });
        }
        let vertices = self.vertex_count();
        if vertices > MAX_VERTICES {
            return Err(BindError::TooManyVertices {
                vertices,
                limit: MAX_VERTICES,
            });
        }
        for (idx, node) in self.nodes.iter().enumerate() {
            let numbers = node.world_from_node.to_cols_array();
            check_numbers(&numbers, || format!("node {idx} (`{}`)", node.name))?;
            // Parents are followed upwards, which must end.
            let above = std::iter::successors(Some(idx), |node| self.nodes.get(*node)?.parent);
            if above.take(self.nodes.len() + 1).count() > self.nodes.len() {
                return Err(wrong(format!("node {idx}"), "a hierarchy without circles"));
            }
        }
        self.meshes
            .iter()
            .try_for_each(|mesh| mesh.check(self.nodes.len()))
    }
}

impl Avatar {
    /// Sets the names by which nodes are recognised as parts of a person: VRM's names (`humanoid`: node and
    /// name) if there are any, else their own, for joints only.
    pub fn name_parts(&mut self, mut humanoid: HashMap<usize, String>) {
        let mut is_joint = vec![false; self.nodes.len()];
        for joint in self.meshes.iter().flat_map(|mesh| &mesh.joints) {
            if let Some(is_joint) = is_joint.get_mut(*joint) {
                *is_joint = true;
            }
        }
        let by_name = humanoid.is_empty();
        for (idx, (node, is_joint)) in self.nodes.iter_mut().zip(is_joint).enumerate() {
            node.part_name = match humanoid.remove(&idx) {
                Some(name) => name,
                None if by_name && is_joint => node.name.trim().to_owned(),
                None => String::new(),
            };
        }
    }

    /// Refuses a binding of another avatar or body.
    ///
    /// # Errors
    /// [`BindError::Binding`].
    pub fn check_binding(&self, binding: &Binding, body: &BodyModel) -> Result<(), BindError> {
        let is_bound = |mesh: &SkinnedMesh| binding.mesh_of(&mesh.positions).is_some();
        if !self.meshes.iter().all(is_bound) {
            return Err(BindingError::AnotherFile { what: "avatar" }.into());
        }
        if binding.body != fingerprint_of_body(body) {
            return Err(BindingError::AnotherFile { what: "body" }.into());
        }
        Ok(())
    }
}

impl SkinnedMesh {
    fn check(&self, node_count: usize) -> Result<(), BindError> {
        let name = &self.name;
        let place = |what: &str| format!("mesh `{name}`, {what}");
        let count = self.positions.len();
        if self.influences.len() != count {
            return Err(wrong(place("skin"), "joints and weights for every vertex"));
        }
        if self.inverse_binds.len() != self.joints.len() {
            return Err(wrong(
                place("skin"),
                "an inverse bind matrix for every joint",
            ));
        }
        if self.joints.iter().any(|node| *node >= node_count) {
            return Err(wrong(place("skin"), "joints that the file has"));
        }
        let is_outside = |corner: &u32| *corner as usize >= count;
        if self.faces.iter().flatten().any(is_outside) {
            return Err(wrong(place("indices"), "triangles over its own vertices"));
        }
        for (vertex, position) in self.positions.iter().enumerate() {
            let numbers = position.to_array().map(f64::from);
            check_numbers(&numbers, || place(&format!("position of vertex {vertex}")))?;
        }
        for (vertex, influences) in self.influences.iter().enumerate() {
            let numbers = influences.weights.map(f64::from);
            check_numbers(&numbers, || place(&format!("weights of vertex {vertex}")))?;
            let used = influences.joints.iter().zip(&influences.weights);
            let mut used = used.filter(|(_, weight)| **weight > 0.0);
            if used.any(|(joint, _)| usize::from(*joint) >= self.joints.len()) {
                return Err(wrong(place("JOINTS"), "joints that its skin has"));
            }
        }
        for (joint, matrix) in self.inverse_binds.iter().enumerate() {
            let numbers = matrix.to_cols_array();
            check_numbers(&numbers, || place(&format!("inverse bind matrix {joint}")))?;
        }
        Ok(())
    }
}

pub(crate) fn wrong(place: String, expected: &str) -> BindError {
    dynaskin_glb::GlbError::new(place, expected).into()
}

fn check_numbers(numbers: &[f64], place: impl Fn() -> String) -> Result<(), BindError> {
    // Written so that what is not a number counts as too large.
    let is_usable = |number: &&f64| matches!(number.abs(), 0.0..=MAX_EXTENT);
    match numbers.iter().find(|number| !is_usable(number)) {
        None => Ok(()),
        Some(found) => Err(BindError::NotFinite {
            place: place(),
            found: *found,
        }),
    }
}

/// Whether a triangle has three corners.
pub(crate) fn is_face(face: &[u32; 3]) -> bool {
    face[0] != face[1] && face[1] != face[2] && face[2] != face[0]
}

impl Influences {
    /// Weights that are negative count 0; the others sum to 1.
    pub(crate) fn normalise(&mut self) {
        let sum: f32 = self.weights.iter().map(|weight| weight.max(0.0)).sum();
        if sum > 0.0 && sum.is_finite() {
            self.weights = self.weights.map(|weight| weight.max(0.0) / sum);
        }
    }
}
