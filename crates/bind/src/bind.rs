//! All steps from an avatar to its binding.

use dynaskin_binding::{
    Binding, MeshBinding, MeshReport, Report, Rows, fingerprint_of_body, fingerprint_of_mesh,
    rotation_of,
};
use dynaskin_body::BodyModel;
use dynaskin_motion::Drive;
use dynaskin_skeleton::Joint;
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};

use crate::BindError;
use crate::avatar::{Avatar, SkinnedMesh};
use crate::double_motion::is_tissue_bone;
use crate::matched::{Matched, matched, takes};
use crate::rig::rig;
use crate::rows::{Row, rows};

/// What the caller declares about an avatar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BindOptions {
    /// What the avatar depicts; only `adult` is bound.
    pub depicts: Option<String>,
    /// Names of nodes for joints of the body that are not recognised by name and hierarchy.
    pub bones: Vec<(Joint, String)>,
}

impl BindOptions {
    /// For an avatar that depicts an adult.
    pub fn adult() -> Self {
        Self {
            depicts: Some("adult".to_owned()),
            bones: Vec::new(),
        }
    }
}

/// A binding and intermediate results, for pictures.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The binding.
    pub binding: Binding,
    /// The body as it lies under the skin, metres, `[vertex]` of the body.
    pub fitted_m: Vec<Vec3>,
    /// The skin in the bind pose, metres, mesh by mesh.
    pub skin_m: Vec<Vec<Vec3>>,
    /// Share of the body's offsets that each vertex of the skin takes, 0..=1, mesh by mesh.
    pub coverage: Vec<Vec<f32>>,
    /// Distance of each vertex of the skin from its point on the body, metres, mesh by mesh; NaN for
    /// vertices of parts that do not move.
    pub distances_m: Vec<Vec<f32>>,
    /// Forward direction of the avatar, horizontal, unit length.
    pub ahead: Vec3,
}

/// Binds a body's tissue to an avatar.
///
/// # Errors
/// [`BindError::Undeclared`] and [`BindError::NotAdult`] if the avatar is not declared or not proportioned as
/// an adult; [`BindError::NoHumanoid`], [`BindError::NotUpright`], [`BindError::Bones`],
/// [`BindError::NoSurface`] and [`BindError::NoFit`] if it is not a skinned person; as
/// [`Avatar::check`]; [`BindError::Body`] for a body without soft regions.
pub fn bind(avatar: &Avatar, body: &BodyModel, options: &BindOptions) -> Result<Bound, BindError> {
    bind_watched(avatar, body, options, &mut |_| {})
}

/// As [`bind`]; `progress` receives the fraction that is done, 0 to 1.
///
/// # Errors
/// As [`bind`].
pub fn bind_watched(
    avatar: &Avatar,
    body: &BodyModel,
    options: &BindOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Bound, BindError> {
    let matched = matched(avatar, body, options, progress)?;
    let is_guarded = !matched.regions_off.is_empty();
    let rows = rows(&matched.skin, &matched.links, &takes(body, is_guarded));
    Ok(assembled(&Found {
        avatar,
        body,
        matched,
        rows,
    }))
}

/// Everything that was found of an avatar.
struct Found<'a> {
    avatar: &'a Avatar,
    body: &'a BodyModel,
    matched: Matched,
    rows: Vec<Row>,
}

fn assembled(found: &Found<'_>) -> Bound {
    let rig = rig(
        found.avatar,
        &found.matched.bones,
        found.matched.fitted.turns,
    );
    // Rows are numbered in the order in which vertices first need them.
    let mut number: Vec<Option<u32>> = vec![None; found.rows.len()];
    let mut kept: Vec<&[(u16, f32)]> = Vec::new();
    let mut meshes = Vec::new();
    let (mut skin_m, mut coverage, mut distances_m) = (Vec::new(), Vec::new(), Vec::new());
    let mut first = 0;
    for mesh in &found.avatar.meshes {
        let welded = &found.matched.skin.welded[first..first + mesh.positions.len()];
        first += mesh.positions.len();
        let (mut vertices, mut of_vertices) = (Vec::new(), Vec::new());
        for (vertex, welded) in welded.iter().enumerate() {
            let welded = *welded as usize;
            let row = &found.rows[welded].0;
            if row.is_empty() {
                continue;
            }
            let row = *number[welded].get_or_insert_with(|| {
                kept.push(row);
                kept.len() as u32 - 1
            });
            vertices.push(vertex as u32);
            of_vertices.push(row);
        }
        skin_m.push(
            welded
                .iter()
                .map(|at| found.matched.skin.positions_m[*at as usize])
                .collect(),
        );
        let taken = |at: &u32| {
            found.rows[*at as usize]
                .0
                .iter()
                .map(|(_, weight)| weight)
                .sum()
        };
        coverage.push(welded.iter().map(taken).collect());
        let distance_m = |at: &u32| found.matched.distances_m[*at as usize];
        distances_m.push(welded.iter().map(distance_m).collect());
        meshes.push(found.mesh(mesh, vertices, of_vertices));
    }
    let rows = Rows::new(kept.into_iter(), found.body, &rig);
    let report = found.report(&meshes);
    Bound {
        binding: Binding {
            body: fingerprint_of_body(found.body),
            shape: found.matched.placement.shape.map(|beta| beta as f32),
            size: found.matched.placement.size as f32,
            rig,
            rows,
            meshes,
            report,
        },
        fitted_m: found.matched.draped_m.clone(),
        skin_m,
        coverage,
        distances_m,
        ahead: found.matched.bones.left().cross(DVec3::Y).as_vec3(),
    }
}

/// Turns below this are none: joints of a mesh that were bound in one pose, radians.
const SAME_TURN: f32 = 5e-3;

/// Whether this node turns a joint.
fn turns(drive: Drive, node: usize) -> bool {
    match drive {
        Drive::Joint(own) => own == node,
        Drive::Between(low, high, _) => low == node || high == node,
        Drive::Parent => false,
    }
}

impl Found<'_> {
    fn mesh(&self, mesh: &SkinnedMesh, vertices: Vec<u32>, rows: Vec<u32>) -> MeshBinding {
        let linear = |vertex: usize| {
            let bind = &self.matched.bones.bind;
            bind.world_from_vertex(mesh, &mesh.influences[vertex])
                .matrix3
        };
        let first = vertices
            .first()
            .map_or(DMat3::IDENTITY, |first| linear(*first as usize));
        let mesh_from_root = if first.determinant().abs() > 1e-30 {
            first.inverse()
        } else {
            DMat3::IDENTITY
        };
        let turn = |vertex: &u32| {
            let since_first = mesh_from_root * linear(*vertex as usize);
            let turn = rotation_of(since_first).unwrap_or_default();
            turn.conjugate().as_quat()
        };
        let turns: Vec<Quat> = vertices.iter().map(turn).collect();
        let is_one = turns
            .iter()
            .all(|turn| turn.angle_between(Quat::IDENTITY) < SAME_TURN);
        MeshBinding {
            name: mesh.name.clone(),
            fingerprint: fingerprint_of_mesh(&mesh.positions),
            vertex_count: mesh.positions.len() as u32,
            vertices,
            rows,
            mesh_from_root: Mat3::from_cols_array(
                &mesh_from_root.to_cols_array().map(|x| x as f32),
            ),
            turns: if is_one { Vec::new() } else { turns },
        }
    }

    fn report(&self, meshes: &[MeshBinding]) -> Report {
        let name = |node: usize| self.avatar.nodes[node].name.clone();
        let bone = |joint: Joint| {
            let name = match self.matched.bones.drives[joint as usize] {
                Drive::Joint(node) => name(node),
                Drive::Between(low, high, _) => format!("{} + {}", name(low), name(high)),
                Drive::Parent => return None,
            };
            Some((joint.name().to_owned(), name))
        };
        let is_missing =
            |joint: &Joint| self.matched.bones.drives[*joint as usize] == Drive::Parent;
        let missing = Joint::ALL.iter().filter(|joint| is_missing(joint));
        let of_meshes = self.avatar.meshes.iter().zip(meshes);
        let mut double_motion: Vec<String> = self
            .avatar
            .meshes
            .iter()
            .flat_map(|mesh| &mesh.joints)
            // What is called a chest may well be the spine.
            .filter(|node| {
                !self
                    .matched
                    .bones
                    .drives
                    .iter()
                    .any(|drive| turns(*drive, **node))
            })
            .map(|node| name(*node))
            .filter(|name| is_tissue_bone(name))
            .collect();
        double_motion.sort_unstable();
        double_motion.dedup();
        Report {
            bones: Joint::ALL.into_iter().filter_map(bone).collect(),
            missing: missing.map(|joint| joint.name().to_owned()).collect(),
            proportions: self.matched.proportions,
            share_close: self.matched.closeness.share_close,
            share_close_bare: self.matched.closeness.share_close_bare,
            median_m: self.matched.closeness.median_m,
            vertices: self.avatar.vertex_count() as u32,
            moving: meshes.iter().map(|mesh| mesh.vertices.len() as u32).sum(),
            meshes: of_meshes
                .map(|(mesh, bound)| MeshReport {
                    name: mesh.name.clone(),
                    material: mesh.material.clone(),
                    vertices: bound.vertex_count,
                    moving: bound.vertices.len() as u32,
                })
                .collect(),
            regions_off: self.matched.regions_off.clone(),
            double_motion,
            notes: self.matched.bones.notes.clone(),
        }
    }
}
