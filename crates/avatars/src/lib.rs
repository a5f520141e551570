//! Avatars with known soft tissue, to test binding: made from one of the default bodies, whose
//! sources are CC0, in the forms in which other people's exporters write avatars.
//!
//! Every vertex of such an avatar is a known point on the body, so its offset is known, too. Adults, in a
//! suit or in sportswear.

mod mesh;
mod recipe;
mod rig;
mod sportswear;
mod write;

use dynaskin_body::{BodyModel, SkinMatrices};
use glam::{Affine3A, DAffine3, Quat, Vec3};

pub use recipe::{Container, EXAMPLES, RECIPES, Recipe, RestPose, RigStyle, Unit};

/// A place of the body: corners of one of its faces and their shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Vertices of the body.
    pub corners: [u32; 3],
    /// Barycentric coordinates.
    pub shares: [f32; 3],
}

impl Source {
    /// What a value by vertex of the body is at this place.
    pub fn mix(&self, values: &[Vec3]) -> Vec3 {
        let corners = self.corners.iter().zip(self.shares);
        corners
            .map(|(corner, share)| values[*corner as usize] * share)
            .sum()
    }
}

/// What is known of a mesh of a made avatar.
#[derive(Clone, Debug)]
pub struct MeshTruth {
    /// Name of the mesh's node.
    pub name: String,
    /// Whether it is worn over the skin.
    pub is_garment: bool,
    /// The place of the body that each vertex comes from.
    pub sources: Vec<Source>,
}

/// A made avatar.
#[derive(Clone, Debug)]
pub struct MadeAvatar {
    /// The file: GLB or VRM.
    pub bytes: Vec<u8>,
    /// What is known of its meshes, in the file's order.
    pub truth: Vec<MeshTruth>,
    /// Linear part of the avatar's bind pose by vertex of the body.
    posed: Vec<Affine3A>,
}

impl MadeAvatar {
    /// What the body's offsets (metres, rest pose, `[vertex]`) do to each vertex of each mesh: offsets in
    /// metres in the avatar's bind pose.
    pub fn true_offsets_m(&self, body_offsets_m: &[Vec3]) -> Vec<Vec<Vec3>> {
        let posed = self.posed.iter().zip(body_offsets_m);
        let posed: Vec<Vec3> = posed
            .map(|(posed, offset)| posed.transform_vector3(*offset))
            .collect();
        let meshes = self.truth.iter();
        meshes
            .map(|mesh| {
                mesh.sources
                    .iter()
                    .map(|source| source.mix(&posed))
                    .collect()
            })
            .collect()
    }
}

/// Makes the avatar of a recipe from a body.
pub fn make(body: &BodyModel, recipe: &Recipe) -> MadeAvatar {
    let shaped = body.shaped(&recipe.shape);
    let pose = rig::rest_pose(&shaped.joints_m, recipe.pose);
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let yaw = match recipe.container {
        // VRM before 1.0 faces -Z.
        Container::Vrm0 => Quat::from_rotation_y(std::f32::consts::PI),
        _ => Quat::IDENTITY,
    };
    let placed = Affine3A::from_quat(yaw);
    let posed: Vec<Affine3A> = body
        .skin
        .iter()
        .map(|skin| placed * matrices.blended(skin))
        .collect();
    let positions_m: Vec<Vec3> = posed
        .iter()
        .zip(&shaped.positions_m)
        .map(|(posed, rest)| posed.transform_point3(*rest))
        .collect();
    let world = pose.world_joints(&shaped.joints_m);
    let placed_f64 = DAffine3::from_quat(yaw.as_dquat());
    let joints_m = world.position_m.map(|at| placed_f64.transform_point3(at));
    let rig = rig::Rig::new(body, recipe, &joints_m, &positions_m, placed_f64);
    let meshes = mesh::meshes(body, recipe, &positions_m, &rig);
    let truth = meshes
        .iter()
        .map(|mesh| MeshTruth {
            name: mesh.name.clone(),
            is_garment: mesh.is_garment,
            sources: mesh.sources.clone(),
        })
        .collect();
    MadeAvatar {
        bytes: write::glb(recipe, &rig, &meshes),
        truth,
        posed,
    }
}
