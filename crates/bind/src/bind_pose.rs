//! The pose in which an avatar's skin was bound.
//!
//! Inverse bind matrices give the joints in the space of the mesh; nodes give them in the world of the
//! loaded file. The pelvis is the same in both, which gives the map from one to the other. In
//! that pose a mesh is as its author made it, whatever quantisation or armature scale its matrices contain.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::avatar::{Avatar, Influences, SkinnedMesh};

/// Where the nodes stood when the skin was bound.
#[derive(Clone, Debug)]
pub struct BindPose {
    /// `[node]`, metres, +Y up.
    pub world_from_node: Vec<DAffine3>,
    /// Metres of the world per unit of the file.
    pub metres_per_unit: f64,
}

impl BindPose {
    /// `pelvis`: the node that stands at one place as bound and as loaded.
    pub fn new(avatar: &Avatar, pelvis: usize) -> Self {
        let mut known: Vec<Option<DAffine3>> = vec![None; avatar.nodes.len()];
        let mut open: Vec<&SkinnedMesh> = avatar.meshes.iter().collect();
        // The skin that tells most of the pelvis's tree first; its joints place those of the others.
        open.sort_by_key(|mesh| {
            (
                !mesh.joints.contains(&pelvis),
                usize::MAX - mesh.joints.len(),
            )
        });
        known[pelvis] = Some(avatar.nodes[pelvis].world_from_node);
        for mesh in open {
            let Some(world_from_mesh) = mesh.placed(avatar, &known) else {
                continue;
            };
            for (node, inverse) in mesh.joints.iter().zip(&mesh.inverse_binds) {
                let bind = world_from_mesh * inverse.inverse();
                if known[*node].is_none() && is_sound(&bind) {
                    known[*node] = Some(bind);
                }
            }
        }
        Self {
            world_from_node: filled(avatar, known),
            metres_per_unit: 1.0,
        }
    }

    /// World from mesh for one vertex.
    pub fn world_from_vertex(&self, mesh: &SkinnedMesh, influences: &Influences) -> DAffine3 {
        let mut matrix = DMat3::ZERO;
        let mut translation = DVec3::ZERO;
        for (joint, weight) in influences.joints.iter().zip(influences.weights) {
            if weight > 0.0 {
                let joint = usize::from(*joint);
                let part = self.world_from_node[mesh.joints[joint]] * mesh.inverse_binds[joint];
                matrix += part.matrix3 * f64::from(weight);
                translation += part.translation * f64::from(weight);
            }
        }
        DAffine3 {
            matrix3: matrix,
            translation,
        }
    }

    /// Positions of a mesh's vertices in the bind pose, metres.
    pub fn positions_m(&self, mesh: &SkinnedMesh) -> Vec<Vec3> {
        let vertices = mesh.positions.iter().zip(&mesh.influences);
        vertices
            .map(|(position, influences)| {
                let world = self.world_from_vertex(mesh, influences);
                world.transform_point3(position.as_dvec3()).as_vec3()
            })
            .collect()
    }
}

impl SkinnedMesh {
    /// World from mesh as bound: by the joint of the skin nearest to the root whose place is known, or
    /// by where it stands as loaded.
    fn placed(&self, avatar: &Avatar, known: &[Option<DAffine3>]) -> Option<DAffine3> {
        let depth = |node: usize| {
            std::iter::successors(Some(node), |node| avatar.nodes[*node].parent).count()
        };
        let joints = || self.joints.iter().zip(&self.inverse_binds);
        let by_known = joints()
            .filter_map(|(node, inverse)| Some((depth(*node), known[*node]? * *inverse)))
            .min_by_key(|(depth, _)| *depth);
        let by_nodes = || {
            let (node, inverse) = joints().min_by_key(|(node, _)| depth(**node))?;
            Some(avatar.nodes[*node].world_from_node * *inverse)
        };
        let placed = by_known.map(|(_, placed)| placed).or_else(by_nodes)?;
        is_sound(&placed).then_some(placed)
    }
}

/// Nodes that no skin places stand to their parent as they are loaded.
fn filled(avatar: &Avatar, mut known: Vec<Option<DAffine3>>) -> Vec<DAffine3> {
    let loaded = |node: usize| avatar.nodes[node].world_from_node;
    for idx in 0..known.len() {
        let above = std::iter::successors(Some(idx), |node| avatar.nodes[*node].parent);
        let mut open: Vec<usize> = above.take_while(|node| known[*node].is_none()).collect();
        while let Some(node) = open.pop() {
            let parent = avatar.nodes[node].parent;
            let by_parent = parent.and_then(|parent| {
                let placed = known[parent]? * loaded(parent).inverse() * loaded(node);
                is_sound(&placed).then_some(placed)
            });
            known[node] = Some(by_parent.unwrap_or_else(|| loaded(node)));
        }
    }
    known.into_iter().map(Option::unwrap_or_default).collect()
}

fn is_sound(affine: &DAffine3) -> bool {
    affine.is_finite() && affine.matrix3.determinant().abs() > 1e-30
}
