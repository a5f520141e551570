//! An avatar as an engine has it: arrays instead of a file.

use glam::{DAffine3, DMat4, Vec3};

use crate::BindError;
use crate::avatar::{Influences, MAX_INFLUENCES, SkinnedMesh, is_face, wrong};

/// A skinned mesh as arrays of numbers.
#[derive(Clone, Copy, Debug)]
pub struct EngineMesh<'a> {
    /// Name of the mesh.
    pub name: &'a str,
    /// Name of the material.
    pub material: &'a str,
    /// `[vertex][3]`, the mesh's own space.
    pub positions: &'a [f32],
    /// Joints of each vertex, `[vertex][influence]`, as indices into [`Self::joints`].
    pub skin_joints: &'a [u16],
    /// Their weights.
    pub skin_weights: &'a [f32],
    /// Triangles, `[face][3]`.
    pub indices: &'a [u32],
    /// Nodes that are the skin's joints.
    pub joints: &'a [u32],
    /// From the mesh's space to each joint's in the bind pose, `[joint][16]`, column-major.
    pub inverse_binds: &'a [f64],
}

impl EngineMesh<'_> {
    /// The mesh as binding takes it; indices are checked with the avatar.
    ///
    /// # Errors
    /// [`BindError::Glb`] for arrays that do not belong together.
    pub fn read(&self) -> Result<SkinnedMesh, BindError> {
        let place = |what: &str| format!("mesh `{}`, {what}", self.name);
        let (positions, rest) = self.positions.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(wrong(place("positions"), "three numbers a vertex"));
        }
        let (matrices, rest) = self.inverse_binds.as_chunks::<16>();
        if !rest.is_empty() {
            return Err(wrong(place("inverse bind matrices"), "16 numbers a joint"));
        }
        let matrix = |m: &[f64; 16]| DAffine3::from_mat4(DMat4::from_cols_array(m));
        let faces = self.indices.as_chunks::<3>().0.iter().copied();
        Ok(SkinnedMesh {
            name: self.name.to_owned(),
            material: self.material.to_owned(),
            positions: positions.iter().copied().map(Vec3::from_array).collect(),
            influences: self.influences(positions.len())?,
            faces: faces.filter(is_face).collect(),
            joints: self.joints.iter().map(|node| *node as usize).collect(),
            inverse_binds: matrices.iter().map(matrix).collect(),
        })
    }

    fn influences(&self, vertex_count: usize) -> Result<Vec<Influences>, BindError> {
        let each = self.skin_joints.len() / vertex_count.max(1);
        let is_whole = self.skin_joints.len() == each * vertex_count
            && self.skin_weights.len() == self.skin_joints.len();
        if !is_whole || each == 0 || each > MAX_INFLUENCES {
            let place = format!("mesh `{}`, skin", self.name);
            return Err(wrong(place, "1 to 8 joints and weights for every vertex"));
        }
        let rows = self.skin_joints.chunks_exact(each);
        let rows = rows.zip(self.skin_weights.chunks_exact(each));
        Ok(rows
            .map(|(joints, weights)| {
                let mut influences = Influences::default();
                influences.joints[..each].copy_from_slice(joints);
                influences.weights[..each].copy_from_slice(weights);
                influences.normalise();
                influences
            })
            .collect())
    }
}
