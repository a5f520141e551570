//! Top, leggings and shoes over a body, and the skin that they leave bare.

use std::collections::{BTreeMap, BTreeSet};

use dynaskin_body::{BodyModel, Joint, vertex_normals};
use glam::Vec3;

use crate::Source;
use crate::mesh::{Mesh, limb_of};
use crate::rig::Rig;

/// A garment: its name, its distance from the skin in metres, and the joints whose places it covers.
struct Garment {
    name: &'static str,
    distance_m: f32,
    /// Rounds in which its cloth is drawn even over what lies below it.
    evened: u8,
    joints: &'static [Joint],
}

/// In the order of their materials, after the skin. Each lies over the hem of the next.
const GARMENTS: [Garment; 3] = [
    Garment {
        name: "Top",
        distance_m: 0.014,
        evened: 8,
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
        distance_m: 0.008,
        evened: 4,
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
        distance_m: 0.012,
        evened: 6,
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
        let mut lifted: Vec<Vec3> = placed
            .iter()
            .zip(&normals)
            .map(|(at, normal)| *at + *normal * garment.distance_m)
            .collect();
        even(&mut lifted, &worn, garment.evened);
        let vertices = (sources, lifted.as_slice(), worn.as_slice());
        meshes.push(Mesh::new(
            garment.name,
            Some(idx + 1),
            vertices,
            rig,
            &|_| 0,
        ));
    }
    meshes
}

/// Draws each vertex of `faces` towards the middle of its neighbours; those of a hem along the hem.
fn even(positions_m: &mut [Vec3], faces: &[[u32; 3]], rounds: u8) {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for [a, b, c] in faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry([*from.min(to), *from.max(to)]).or_default() += 1;
        }
    }
    let hem: BTreeSet<u32> = edges
        .iter()
        .filter(|(_, faces)| **faces == 1)
        .flat_map(|(edge, _)| *edge)
        .collect();
    let mut neighbours: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ([from, to], faces) in &edges {
        let is_hem = *faces == 1;
        for (vertex, other) in [(from, to), (to, from)] {
            if is_hem || !hem.contains(vertex) {
                neighbours.entry(*vertex).or_default().push(*other);
            }
        }
    }
    for _ in 0..rounds {
        let before = positions_m.to_vec();
        for (vertex, others) in &neighbours {
            let sum: Vec3 = others.iter().map(|other| before[*other as usize]).sum();
            let at = before[*vertex as usize];
            positions_m[*vertex as usize] = at.lerp(sum / others.len() as f32, 0.5);
        }
    }
}
