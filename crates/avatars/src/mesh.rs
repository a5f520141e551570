//! Skin and garment of an avatar, vertex by vertex from known places of the body.

use std::collections::HashMap;

use dynaskin_body::{BodyModel, Joint, vertex_normals};
use glam::Vec3;

use crate::Source;
use crate::recipe::Recipe;
use crate::rig::Rig;
use crate::sportswear;

/// How far a garment lies from the skin, metres: least, and how much more in its folds.
const GARMENT_M: (f32, f32) = (0.008, 0.01);

/// A mesh to be written.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub name: String,
    pub is_garment: bool,
    /// Number of its material in the file.
    pub material: usize,
    pub sources: Vec<Source>,
    /// Metres.
    pub positions_m: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// Bones and weights, largest first.
    pub weights: Vec<[(u16, f32); 4]>,
    pub faces: Vec<[u32; 3]>,
}

/// The meshes of a recipe; `positions_m` are the body's vertices in the avatar's bind pose.
pub fn meshes(body: &BodyModel, recipe: &Recipe, positions_m: &[Vec3], rig: &Rig) -> Vec<Mesh> {
    let corner = |vertex: u32| Source {
        corners: [vertex; 3],
        shares: [1.0, 0.0, 0.0],
    };
    let mut sources: Vec<Source> = (0..positions_m.len() as u32).map(corner).collect();
    let mut faces = body.faces.clone();
    if recipe.fine {
        faces = divided(&faces, &mut sources);
    }
    let placed: Vec<Vec3> = sources
        .iter()
        .map(|source| source.mix(positions_m))
        .collect();
    if recipe.sportswear {
        return sportswear::meshes(body, &sources, &placed, &faces, rig);
    }
    let limb = |face: &[u32; 3]| limb_of(body, &sources[face[0] as usize]);
    let part = |name: &str, wanted: &dyn Fn(&[u32; 3]) -> bool| {
        let faces: Vec<[u32; 3]> = faces.iter().filter(|face| wanted(face)).copied().collect();
        Mesh::new(
            name,
            None,
            (&sources, &placed, &faces),
            rig,
            &|face| match recipe.seams {
                true => limb(face),
                false => 0,
            },
        )
    };
    let mut meshes = if recipe.seams {
        vec![
            part("Body", &|face| !is_leg(limb(face))),
            part("Legs", &|face| is_leg(limb(face))),
        ]
    } else {
        vec![part("Body", &|_| true)]
    };
    if recipe.garment {
        meshes.push(garment(body, &sources, &placed, &faces, rig));
    }
    meshes
}

fn garment(
    body: &BodyModel,
    sources: &[Source],
    placed: &[Vec3],
    faces: &[[u32; 3]],
    rig: &Rig,
) -> Mesh {
    let is_worn = |face: &&[u32; 3]| {
        face.iter().all(|vertex| {
            let limb = limb_of(body, &sources[*vertex as usize]);
            matches!(
                Joint::ALL[limb],
                Joint::Pelvis
                    | Joint::Spine1
                    | Joint::Spine2
                    | Joint::Spine3
                    | Joint::LeftHip
                    | Joint::RightHip
                    | Joint::LeftKnee
                    | Joint::RightKnee
                    | Joint::LeftShoulder
                    | Joint::RightShoulder
            )
        })
    };
    let faces: Vec<[u32; 3]> = faces.iter().filter(is_worn).copied().collect();
    let normals = vertex_normals(placed, &faces);
    let worn: Vec<Vec3> = placed
        .iter()
        .zip(&normals)
        .map(|(at, normal)| {
            let fold = 0.5 + 0.5 * (40.0 * at.y + 25.0 * at.x).sin();
            *at + *normal * (GARMENT_M.0 + GARMENT_M.1 * fold)
        })
        .collect();
    Mesh::new("Suit", Some(1), (sources, &worn, &faces), rig, &|_| 0)
}

/// The joint that moves a place most.
pub fn limb_of(body: &BodyModel, source: &Source) -> usize {
    let skin = &body.skin[source.corners[0] as usize];
    usize::from(skin.joints[0])
}

fn is_leg(limb: usize) -> bool {
    let joint = Joint::ALL[limb];
    ["hip", "knee", "ankle", "foot"]
        .iter()
        .any(|word| joint.name().ends_with(word))
}

impl Mesh {
    /// The vertices that `faces` need, once for each group of faces.
    ///
    /// `garment`: the number of its material, if it is one.
    pub fn new(
        name: &str,
        garment: Option<usize>,
        (sources, positions_m, faces): (&[Source], &[Vec3], &[[u32; 3]]),
        rig: &Rig,
        group: &dyn Fn(&[u32; 3]) -> usize,
    ) -> Self {
        let normals = vertex_normals(positions_m, faces);
        let mut mesh = Self {
            name: name.to_owned(),
            is_garment: garment.is_some(),
            material: garment.unwrap_or(0),
            sources: Vec::new(),
            positions_m: Vec::new(),
            normals: Vec::new(),
            weights: Vec::new(),
            faces: Vec::new(),
        };
        let mut known: HashMap<(u32, usize), u32> = HashMap::new();
        for face in faces {
            let group = group(face);
            let corners = face.map(|vertex| {
                *known.entry((vertex, group)).or_insert_with(|| {
                    let idx = vertex as usize;
                    mesh.sources.push(sources[idx]);
                    mesh.positions_m.push(positions_m[idx]);
                    mesh.normals.push(normals[idx]);
                    mesh.weights.push(largest(rig, &sources[idx]));
                    mesh.sources.len() as u32 - 1
                })
            });
            mesh.faces.push(corners);
        }
        mesh
    }
}

/// The four largest weights at a place, summing to 1.
fn largest(rig: &Rig, source: &Source) -> [(u16, f32); 4] {
    let mut row: Vec<(u16, f32)> = (0..rig.bones.len())
        .map(|bone| {
            let corners = source.corners.iter().zip(source.shares);
            let weight = corners.map(|(corner, share)| rig.weights[*corner as usize][bone] * share);
            (bone as u16, weight.sum())
        })
        .collect();
    row.sort_by(|a, b| b.1.total_cmp(&a.1));
    row.resize(4, (0, 0.0));
    let sum: f32 = row.iter().map(|(_, weight)| weight).sum();
    [0, 1, 2, 3].map(|slot| (row[slot].0, row[slot].1 / sum))
}

/// Each face in four.
fn divided(faces: &[[u32; 3]], sources: &mut Vec<Source>) -> Vec<[u32; 3]> {
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut all = Vec::with_capacity(4 * faces.len());
    for [a, b, c] in faces {
        let mut middle = |from: u32, to: u32| {
            *middles
                .entry([from.min(to), from.max(to)])
                .or_insert_with(|| {
                    sources.push(Source {
                        corners: [from, to, to],
                        shares: [0.5, 0.5, 0.0],
                    });
                    sources.len() as u32 - 1
                })
        };
        let (ab, bc, ca) = (middle(*a, *b), middle(*b, *c), middle(*c, *a));
        all.extend([[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]);
    }
    all
}
