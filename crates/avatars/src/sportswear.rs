//! Top, leggings and shoes over a body, and the skin that they leave bare.

use dynaskin_body::{BodyModel, Joint, vertex_normals};
use glam::Vec3;

use crate::Source;
use crate::mesh::{Mesh, limb_of};
use crate::rig::Rig;

/// A garment: its name, its distance from the skin in metres, and the joints whose places it covers.
struct Garment {
    name: &'static str,
    distance_m: f32,
    joints: &'static [Joint],
}

/// In the order of their materials, after the skin. Each lies over the hem of the next.
const GARMENTS: [Garment; 3] = [
    Garment {
        name: "Top",
        distance_m: 0.009,
        joints: &[
            Joint::Spine1,
            Joint::Spine2,
            Joint::Spine3,
            Joint::LeftCollar,
            Joint::RightCollar,
            Joint::LeftShoulder,
            Joint::RightShoulder,
        ],
    },
    Garment {
        name: "Leggings",
        distance_m: 0.005,
        joints: &[
            Joint::Pelvis,
            Joint::LeftHip,
            Joint::RightHip,
            Joint::LeftKnee,
            Joint::RightKnee,
        ],
    },
    Garment {
        name: "Shoes",
        distance_m: 0.008,
        joints: &[
            Joint::LeftAnkle,
            Joint::RightAnkle,
            Joint::LeftFoot,
            Joint::RightFoot,
        ],
    },
];

/// Bare skin and garments, vertex by vertex from `sources`, which `placed` has in metres.
pub fn meshes(
    body: &BodyModel,
    sources: &[Source],
    placed: &[Vec3],
    faces: &[[u32; 3]],
    rig: &Rig,
) -> Vec<Mesh> {
    let joints: Vec<Joint> = sources
        .iter()
        .map(|source| Joint::ALL[limb_of(body, source)])
        .collect();
    let normals = vertex_normals(placed, faces);
    let is_under = |garment: &Garment, face: &[u32; 3]| {
        face.iter()
            .any(|vertex| garment.joints.contains(&joints[*vertex as usize]))
    };
    // Skin ends one face below a hem.
    let is_bare = |face: &&[u32; 3]| {
        !face.iter().all(|vertex| {
            GARMENTS
                .iter()
                .any(|garment| garment.joints.contains(&joints[*vertex as usize]))
        })
    };
    let bare: Vec<[u32; 3]> = faces.iter().filter(is_bare).copied().collect();
    let mut meshes = vec![Mesh::new(
        "Skin",
        None,
        (sources, placed, &bare),
        rig,
        &|_| 0,
    )];
    for (idx, garment) in GARMENTS.iter().enumerate() {
        let worn = faces.iter().filter(|face| is_under(garment, face));
        let worn: Vec<[u32; 3]> = worn.copied().collect();
        let lifted: Vec<Vec3> = placed
            .iter()
            .zip(&normals)
            .map(|(at, normal)| *at + *normal * garment.distance_m)
            .collect();
        let vertices = (sources, lifted.as_slice(), worn.as_slice());
        meshes.push(Mesh::new(garment.name, Some(idx + 1), vertices, rig, &|_| 0));
    }
    meshes
}
