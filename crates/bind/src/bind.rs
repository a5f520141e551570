//! The whole way from an avatar to its binding.

use dynaskin_binding::{
    Binding, CLOSE_M, MeshBinding, MeshReport, Proportions, RegionOff, Report, Rows,
    fingerprint_of_body, fingerprint_of_mesh, rotation_of,
};
use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use dynaskin_motion::Drive;
use dynaskin_skeleton::Joint;
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};

use crate::BindError;
use crate::align::alignment;
use crate::avatar::{Avatar, SkinnedMesh};
use crate::basis::Placement;
use crate::bones::Bones;
use crate::correspond::{Link, Places};
use crate::double_motion::is_tissue_bone;
use crate::drape::draped;
use crate::fit::fit_shape;
use crate::inpaint;
use crate::limbs::{FittedBody, fit_limbs};
use crate::parts::Part;
use crate::proportions::{self, GUARDED_CROWN_TO_SHOULDER, GUARDED_MEDIAN_M};
use crate::rig::rig;
use crate::rows::{Row, rows};
use crate::samples::Samples;
use crate::skin::Skin;

/// What the caller says of an avatar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BindOptions {
    /// What the avatar depicts; only `adult` is bound.
    pub depicts: Option<String>,
    /// Names of nodes for joints of the body, where names and tree fail.
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

/// A binding and what it was made of, for pictures.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The binding.
    pub binding: Binding,
    /// The body as it lies under the skin, metres, `[vertex]` of the body.
    pub fitted_m: Vec<Vec3>,
    /// The skin in the bind pose, metres, mesh by mesh.
    pub skin_m: Vec<Vec<Vec3>>,
    /// How much each vertex of the skin takes of the body's offsets, 0..=1, mesh by mesh.
    pub coverage: Vec<Vec<f32>>,
    /// How far each vertex of the skin lies from its place on the body, metres, mesh by mesh; not a
    /// number for what belongs to no part that moves.
    pub distances_m: Vec<Vec<f32>>,
    /// Where the avatar looks, level with the floor.
    pub ahead: Vec3,
}

/// Binds a body's tissue to an avatar.
///
/// # Errors
/// [`BindError::Undeclared`] and [`BindError::NotAdult`] for what is not declared or not proportioned as
/// an adult; [`BindError::NoHumanoid`], [`BindError::NotUpright`], [`BindError::Bones`],
/// [`BindError::NoSurface`] and [`BindError::NoFit`] for what is no person in a skin; as
/// [`Avatar::check`]; [`BindError::Body`] for a body without soft regions.
pub fn bind(avatar: &Avatar, body: &BodyModel, options: &BindOptions) -> Result<Bound, BindError> {
    bind_watched(avatar, body, options, &mut |_| {})
}

/// As [`bind`]; `progress` is told the fraction that is done.
///
/// # Errors
/// As [`bind`].
pub fn bind_watched(
    avatar: &Avatar,
    body: &BodyModel,
    options: &BindOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Bound, BindError> {
    if options.depicts.as_deref() != Some("adult") {
        return Err(BindError::Undeclared {
            declared: options.depicts.clone(),
        });
    }
    if body.region_weights.len() != REGION_COUNT {
        return Err(BindError::Body("it has no soft regions"));
    }
    if body.vertex_count() > usize::from(u16::MAX) {
        return Err(BindError::Body("it has more than 65,535 vertices"));
    }
    avatar.check()?;
    let bones = Bones::find(avatar, &options.bones)?;
    let skin = Skin::new(avatar, &bones)?;
    let largest: Vec<Option<Part>> = skin.parts.iter().map(|parts| parts.largest()).collect();
    let proportions = proportions::measured(&bones, &skin.positions_m, &largest);
    proportions::check(&proportions)?;
    progress(0.1);

    let samples = Samples::new(body, &skin);
    let turns = alignment(&bones, &body.joint_template_m);
    let placement = fit_shape(body, &bones, &samples, &turns)?;
    progress(0.3);
    let fitted = fit_limbs(body, &bones, &samples, &placement, turns)?;
    progress(0.45);
    let draped_m = draped(body, &samples, &fitted.positions_m)?;
    progress(0.6);
    let places = Places::new(body, &draped_m, &fitted.positions_m);
    let mut links = places.links(&skin);
    let closeness = Closeness::new(&skin, &places, &links);
    let distance_m = |link: &Option<Link>| link.map_or(f32::NAN, |link| link.distance_m);
    let distances_m = links.iter().map(distance_m).collect();
    progress(0.75);
    inpaint::fill(&skin, &places, &mut links)?;
    progress(0.9);
    let regions_off = regions_off(&proportions, &closeness);
    let rows = rows(&skin, &links, &takes(body, !regions_off.is_empty()));
    Ok(assembled(&Found {
        avatar,
        body,
        bones,
        skin,
        proportions,
        placement,
        fitted,
        draped_m: draped_m.clone(),
        closeness,
        regions_off,
        rows,
        distances_m,
    }))
}

/// How closely the fitted body lies under the skin.
struct Closeness {
    share_close: f32,
    share_close_bare: f32,
    /// Without the drape.
    median_m: f32,
}

impl Closeness {
    fn new(skin: &Skin, places: &Places<'_>, links: &[Option<Link>]) -> Self {
        let found = || {
            links
                .iter()
                .enumerate()
                .filter_map(|(vertex, link)| Some((vertex, (*link)?)))
        };
        let draped_m: Vec<f32> = found().map(|(_, link)| link.distance_m).collect();
        let mut bare_m: Vec<f32> = found()
            .map(|(vertex, link)| places.bare_distance_m(skin.positions_m[vertex], &link.at))
            .collect();
        bare_m.sort_by(f32::total_cmp);
        let share = |distances_m: &[f32]| {
            let close = distances_m
                .iter()
                .filter(|distance_m| **distance_m <= CLOSE_M)
                .count();
            close as f32 / distances_m.len().max(1) as f32
        };
        Self {
            share_close: share(&draped_m),
            share_close_bare: share(&bare_m),
            // Nothing near the body fits it badly.
            median_m: bare_m
                .get(bare_m.len() / 2)
                .copied()
                .unwrap_or(f32::INFINITY),
        }
    }
}

/// Chest and buttocks, where proportions or fit do not show an adult for sure. No option turns them on.
fn regions_off(proportions: &Proportions, closeness: &Closeness) -> Vec<RegionOff> {
    let reason = if proportions::is_guarded(proportions) {
        format!(
            "crown to shoulder is {:.3} of the stature, {GUARDED_CROWN_TO_SHOULDER} and more",
            proportions.crown_to_shoulder
        )
    } else if !matches!(f64::from(closeness.median_m), 0.0..=GUARDED_MEDIAN_M) {
        format!(
            "half of the skin lies {:.0} mm and more from the body",
            1e3 * closeness.median_m
        )
    } else {
        return Vec::new();
    };
    [Region::Chest, Region::Buttocks]
        .map(|region| RegionOff {
            region: region.name().to_owned(),
            reason: reason.clone(),
        })
        .to_vec()
}

/// How much of each body vertex's offset may be taken: none where it never moves, and none of chest and
/// buttocks where these are off.
fn takes(body: &BodyModel, is_guarded: bool) -> Vec<f32> {
    let weight = |region: Region, vertex: usize| body.region_weights[region as usize][vertex];
    (0..body.vertex_count())
        .map(|vertex| {
            let softness = body.softness(vertex);
            if softness <= 0.0 {
                return 0.0;
            }
            if !is_guarded {
                return 1.0;
            }
            let off = weight(Region::Chest, vertex) + weight(Region::Buttocks, vertex);
            (1.0 - off / softness).clamp(0.0, 1.0)
        })
        .collect()
}

/// Everything that was found of an avatar.
struct Found<'a> {
    avatar: &'a Avatar,
    body: &'a BodyModel,
    bones: Bones,
    skin: Skin,
    proportions: Proportions,
    placement: Placement,
    fitted: FittedBody,
    draped_m: Vec<Vec3>,
    closeness: Closeness,
    regions_off: Vec<RegionOff>,
    rows: Vec<Row>,
    /// Metres, `[welded]`.
    distances_m: Vec<f32>,
}

fn assembled(found: &Found<'_>) -> Bound {
    let rig = rig(found.avatar, &found.bones, found.fitted.turns);
    // Rows are numbered in the order in which vertices first need them.
    let mut number: Vec<Option<u32>> = vec![None; found.rows.len()];
    let mut kept: Vec<&[(u16, f32)]> = Vec::new();
    let mut meshes = Vec::new();
    let (mut skin_m, mut coverage, mut distances_m) = (Vec::new(), Vec::new(), Vec::new());
    let mut first = 0;
    for mesh in &found.avatar.meshes {
        let welded = &found.skin.welded[first..first + mesh.positions.len()];
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
                .map(|at| found.skin.positions_m[*at as usize])
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
        let distance_m = |at: &u32| found.distances_m[*at as usize];
        distances_m.push(welded.iter().map(distance_m).collect());
        meshes.push(found.mesh(mesh, vertices, of_vertices));
    }
    let rows = Rows::new(kept.into_iter(), found.body, &rig);
    let report = found.report(&meshes);
    Bound {
        binding: Binding {
            body: fingerprint_of_body(found.body),
            shape: found.placement.shape.map(|beta| beta as f32),
            size: found.placement.size as f32,
            rig,
            rows,
            meshes,
            report,
        },
        fitted_m: found.draped_m.clone(),
        skin_m,
        coverage,
        distances_m,
        ahead: found.bones.left().cross(DVec3::Y).as_vec3(),
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
            let bind = &self.bones.bind;
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
            let name = match self.bones.drives[joint as usize] {
                Drive::Joint(node) => name(node),
                Drive::Between(low, high, _) => format!("{} + {}", name(low), name(high)),
                Drive::Parent => return None,
            };
            Some((joint.name().to_owned(), name))
        };
        let is_missing = |joint: &Joint| self.bones.drives[*joint as usize] == Drive::Parent;
        let missing = Joint::ALL.iter().filter(|joint| is_missing(joint));
        let of_meshes = self.avatar.meshes.iter().zip(meshes);
        let mut double_motion: Vec<String> = self
            .avatar
            .meshes
            .iter()
            .flat_map(|mesh| &mesh.joints)
            // What is called a chest may well be the spine.
            .filter(|node| !self.bones.drives.iter().any(|drive| turns(*drive, **node)))
            .map(|node| name(*node))
            .filter(|name| is_tissue_bone(name))
            .collect();
        double_motion.sort_unstable();
        double_motion.dedup();
        Report {
            bones: Joint::ALL.into_iter().filter_map(bone).collect(),
            missing: missing.map(|joint| joint.name().to_owned()).collect(),
            proportions: self.proportions,
            share_close: self.closeness.share_close,
            share_close_bare: self.closeness.share_close_bare,
            median_m: self.closeness.median_m,
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
            regions_off: self.regions_off.clone(),
            double_motion,
            notes: self.bones.notes.clone(),
        }
    }
}
