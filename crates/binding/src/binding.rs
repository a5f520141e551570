//! A binding: what an avatar's vertices take from a body's, and which bones turn its joints.

use dynaskin_body::{BodyModel, JOINT_COUNT, SHAPE_COUNT};
use glam::{DQuat, DVec4, Mat3, Quat, Vec3};
use sha2::{Digest as _, Sha256};

use crate::report::Report;
use crate::rig::Rig;

/// What tells files apart.
pub type Fingerprint = [u8; 32];

/// How a body's tissue moves an avatar's skin.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// Tells the body.
    pub body: Fingerprint,
    /// The body's shape under the avatar's skin, standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// Avatar's metres per body's metre.
    pub size: f32,
    /// The bones and how they stood.
    pub rig: Rig,
    /// The rows, shared by all meshes.
    pub rows: Rows,
    /// The avatar's skinned meshes, in its order.
    pub meshes: Vec<MeshBinding>,
    /// What was found.
    pub report: Report,
}

/// Rows: each takes the offsets of some of the body's vertices and turns them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Where each row's entries begin, and where the last ones end.
    pub starts: Vec<u32>,
    /// Vertices of the body, `[entry]`.
    pub vertices: Vec<u16>,
    /// Their weights, `[entry]`; at most 1 in sum over a row.
    pub weights: Vec<f32>,
    /// From the body's rest pose to the avatar's bind pose, `[row]`.
    pub turns: Vec<Quat>,
}

/// The vertices of a skinned mesh that move.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshBinding {
    /// The mesh's name.
    pub name: String,
    /// Tells the mesh.
    pub fingerprint: Fingerprint,
    /// How many vertices the mesh has.
    pub vertex_count: u32,
    /// Vertices that move, ascending.
    pub vertices: Vec<u32>,
    /// The row of each of them.
    pub rows: Vec<u32>,
    /// From metres in the avatar's space to the mesh's own unit and axes.
    pub mesh_from_root: Mat3,
    /// How joints that were bound in different poses turn each vertex that moves; empty where they were
    /// bound in one.
    pub turns: Vec<Quat>,
}

impl Rows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entries of a row.
    pub fn entries(&self, row: usize) -> impl Iterator<Item = (u16, f32)> + '_ {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        let vertices = self.vertices[range.clone()].iter().copied();
        vertices.zip(self.weights[range].iter().copied())
    }

    /// What each row makes of a vector by vertex of the body, in the avatar's bind pose. `out` has one
    /// place a row.
    pub fn apply(&self, of_body: &[Vec3], out: &mut [Vec3]) {
        for (row, out) in out.iter_mut().enumerate().take(self.len()) {
            let sum: Vec3 = self
                .entries(row)
                .map(|(vertex, weight)| of_body[usize::from(vertex)] * weight)
                .sum();
            *out = self.turns[row] * sum;
        }
    }
}

impl Binding {
    /// Offsets in metres in the avatar's bind pose of every row, `[row]`, from those of the body's
    /// vertices in its rest pose (metres, `[vertex]`).
    pub fn row_offsets_m(&self, body_offsets_m: &[Vec3]) -> Vec<Vec3> {
        let mut offsets = vec![Vec3::ZERO; self.rows.len()];
        self.rows.apply(body_offsets_m, &mut offsets);
        offsets.iter_mut().for_each(|offset| *offset *= self.size);
        offsets
    }

    /// The number of the mesh with these positions, in the mesh's own space; none where the binding has
    /// no such mesh.
    pub fn mesh_of(&self, positions: &[Vec3]) -> Option<usize> {
        let count = positions.len();
        let is_as_large = |mesh: &MeshBinding| mesh.vertex_count as usize == count;
        if !self.meshes.iter().any(is_as_large) {
            return None;
        }
        let fingerprint = fingerprint_of_mesh(positions);
        self.meshes
            .iter()
            .position(|mesh| mesh.fingerprint == fingerprint)
    }
}

impl MeshBinding {
    /// Offsets of the vertices that move, in the mesh's own unit and axes, before skinning; beside
    /// [`Self::vertices`].
    pub fn offsets(&self, row_offsets_m: &[Vec3]) -> Vec<Vec3> {
        let turned = |at: usize, offset: Vec3| match self.turns.get(at) {
            Some(turn) => *turn * offset,
            None => offset,
        };
        let rows = self.rows.iter().enumerate();
        rows.map(|(at, row)| turned(at, self.mesh_from_root * row_offsets_m[*row as usize]))
            .collect()
    }
}

impl Rows {
    /// `rows` of vertices of the body and their weights, with turns worked out from the body.
    pub fn new<'a>(
        rows: impl Iterator<Item = &'a [(u16, f32)]>,
        body: &BodyModel,
        rig: &Rig,
    ) -> Self {
        let mut all = Self {
            starts: vec![0],
            ..Self::default()
        };
        for row in rows {
            for (vertex, weight) in row {
                all.vertices.push(*vertex);
                all.weights.push(*weight);
            }
            all.starts.push(all.vertices.len() as u32);
            all.turns.push(row_turn(body, &rig.turns, row));
        }
        all
    }
}

/// How far a row turns the body's offsets: from the body's rest pose to the avatar's bind pose, by the
/// joints of the body that move the row's vertices.
pub fn row_turn(body: &BodyModel, turns: &[DQuat; JOINT_COUNT], row: &[(u16, f32)]) -> Quat {
    let mut sum = DVec4::ZERO;
    for (vertex, weight) in row {
        let skin = &body.skin[usize::from(*vertex)];
        for (joint, share) in skin.joints.iter().zip(skin.weights) {
            let turn = DVec4::from(turns[usize::from(*joint)]);
            // A quaternion and its negative are one turn.
            let sign = if turn.dot(sum) < 0.0 { -1.0 } else { 1.0 };
            sum += turn * sign * f64::from(weight * share);
        }
    }
    match sum.try_normalize() {
        Some(turn) => DQuat::from_vec4(turn).as_quat(),
        None => Quat::IDENTITY,
    }
}

/// Tells meshes apart: by the positions of their vertices in the mesh's own space.
pub fn fingerprint_of_mesh(positions: &[Vec3]) -> Fingerprint {
    let mut hash = Sha256::new();
    for position in positions {
        // Negative zero is zero: engines lose its sign.
        for component in (*position + Vec3::ZERO).to_array() {
            hash.update(component.to_le_bytes());
        }
    }
    hash.finalize().into()
}

/// Tells bodies apart: template, shape and skin.
pub fn fingerprint_of_body(body: &BodyModel) -> Fingerprint {
    let mut hash = Sha256::new();
    hash.update(body.name.as_bytes());
    let mut vectors = |vectors: &[Vec3]| {
        for component in vectors.iter().flat_map(|vector| vector.to_array()) {
            hash.update(component.to_le_bytes());
        }
    };
    vectors(&body.template_m);
    body.shape_dirs_m.iter().for_each(|dirs| vectors(dirs));
    vectors(&body.joint_template_m);
    for skin in &body.skin {
        hash.update(skin.joints);
    }
    hash.finalize().into()
}
