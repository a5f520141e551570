//! What tests of binding share.

// Each test uses its own part of it.
#![allow(dead_code)]
// What is skipped is said.
#![allow(clippy::print_stdout)]

use std::path::PathBuf;

use dynaskin_avatars::{MadeAvatar, Recipe, make};
use dynaskin_bind::{Avatar, BindOptions, Bound, bind};
use dynaskin_body::{BodyModel, Joint};
use glam::Vec3;

/// A default body of the repository.
pub fn body(name: &str) -> BodyModel {
    let path =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../models/{name}/body.glb"));
    BodyModel::from_glb(&std::fs::read(path).unwrap()).unwrap()
}

/// Avatars of other people; none where the folder is not there.
pub fn shared_avatar(name: &str) -> Option<Vec<u8>> {
    shared_file(&format!("avatars/{name}"))
}

/// A file beside the repository; none where it is not there.
pub fn shared_file(name: &str) -> Option<Vec<u8>> {
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    while folder.pop() {
        if let Ok(bytes) = std::fs::read(folder.join("shared").join(name)) {
            return Some(bytes);
        }
    }
    println!("skipped: shared/{name} is not there");
    None
}

/// Smooth offsets of the soft vertices, up to a few centimetres.
pub fn offsets_m(body: &BodyModel) -> Vec<Vec3> {
    let template = body.template_m.iter().enumerate();
    template
        .map(|(vertex, at)| {
            let wave = Vec3::new(
                (9.0 * at.y + 4.0 * at.z).sin(),
                (7.0 * at.x + 6.0 * at.y + 1.0).cos(),
                (5.0 * at.z + 8.0 * at.y + 2.0).sin(),
            );
            0.02 * body.softness(vertex) * wave
        })
        .collect()
}

/// What is measured of a made avatar, for skin or garment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measured {
    /// Mean error over the mean true offset.
    pub error: f32,
    /// Largest error over the largest true offset.
    pub worst: f32,
    /// Vertices that take offsets from the other side of the body.
    pub wrong_side: usize,
    /// Vertices that take offsets from a limb that they do not belong to.
    pub wrong_limb: usize,
    /// Largest offset of head, hands and feet, metres.
    pub still_m: f32,
}

/// A made avatar and its binding.
pub struct Case {
    pub body: BodyModel,
    pub made: MadeAvatar,
    pub avatar: Avatar,
    pub bound: Bound,
}

impl Case {
    pub fn new(recipe: &Recipe) -> Self {
        let body = body("female");
        let made = make(&body, recipe);
        let avatar = Avatar::from_glb(&made.bytes).unwrap();
        let bound = bind(&avatar, &body, &BindOptions::adult()).unwrap();
        Self {
            body,
            made,
            avatar,
            bound,
        }
    }

    /// Skin and garment.
    pub fn measured(&self) -> [Measured; 2] {
        [false, true].map(|is_garment| self.measured_of(is_garment))
    }

    fn measured_of(&self, is_garment: bool) -> Measured {
        let offsets = offsets_m(&self.body);
        let truth = self.made.true_offsets_m(&offsets);
        let of_rows = self.bound.binding.row_offsets_m(&offsets);
        let mut measured = Measured::default();
        let (mut errors, mut sizes, mut peak) = (0.0_f64, 0.0_f64, 0.0_f32);
        for (mesh, (known, truth)) in self.made.truth.iter().zip(&truth).enumerate() {
            if known.is_garment != is_garment {
                continue;
            }
            let binding = &self.bound.binding.meshes[mesh];
            let mut found = vec![None; truth.len()];
            for (vertex, row) in binding.vertices.iter().zip(&binding.rows) {
                found[*vertex as usize] = Some(*row as usize);
            }
            for (vertex, (row, truth)) in found.iter().zip(truth).enumerate() {
                let offset = row.map_or(Vec3::ZERO, |row| of_rows[row]);
                let error = offset.distance(*truth);
                errors += f64::from(error);
                sizes += f64::from(truth.length());
                peak = peak.max(truth.length());
                measured.worst = measured.worst.max(error);
                let source = &known.sources[vertex];
                if is_still(limb(&self.body, source.corners[0] as usize)) {
                    measured.still_m = measured.still_m.max(offset.length());
                }
                if let Some(row) = row {
                    let at = source.mix(&self.body.template_m);
                    measured.wrong_side += usize::from(self.is_other_side(*row, at.x));
                    measured.wrong_limb += usize::from(self.is_other_limb(*row, source.corners[0]));
                }
            }
        }
        measured.error = (errors / sizes.max(1e-12)) as f32;
        measured.worst /= peak.max(1e-9);
        measured
    }

    /// Offsets of every vertex, mesh by mesh, metres in the bind pose.
    fn offsets_by_vertex_m(&self) -> Vec<Vec<Vec3>> {
        let of_rows = self.bound.binding.row_offsets_m(&offsets_m(&self.body));
        let meshes = self.bound.binding.meshes.iter();
        meshes
            .map(|mesh| {
                let mut offsets = vec![Vec3::ZERO; mesh.vertex_count as usize];
                for (vertex, row) in mesh.vertices.iter().zip(&mesh.rows) {
                    offsets[*vertex as usize] = of_rows[*row as usize];
                }
                offsets
            })
            .collect()
    }

    /// The 99th percentile of the change of the offset along an edge over its length: on the avatar, over
    /// that of the body.
    pub fn edge_ratio(&self) -> f32 {
        let offsets = self.offsets_by_vertex_m();
        let mut changes = Vec::new();
        for (mesh, (skin_m, offsets)) in self
            .avatar
            .meshes
            .iter()
            .zip(self.bound.skin_m.iter().zip(&offsets))
        {
            changes.extend(edge_changes(&mesh.faces, skin_m, offsets));
        }
        let of_body = edge_changes(
            &self.body.faces,
            &self.body.template_m,
            &offsets_m(&self.body),
        );
        percentile_99(changes) / percentile_99(of_body)
    }

    /// How deep the suit sinks below the skin that it covers with offsets `times` as large, metres.
    pub fn deepest_m(&self, times: f32) -> f32 {
        let offsets = self.offsets_by_vertex_m();
        let moved = |mesh: usize, vertex: usize| {
            self.bound.skin_m[mesh][vertex] + times * offsets[mesh][vertex]
        };
        let key = |mesh: usize, vertex: usize| {
            let source = &self.made.truth[mesh].sources[vertex];
            (source.corners, source.shares.map(f32::to_bits))
        };
        let mut skin = std::collections::HashMap::new();
        for (mesh, truth) in self
            .made
            .truth
            .iter()
            .enumerate()
            .filter(|(_, truth)| !truth.is_garment)
        {
            for vertex in 0..truth.sources.len() {
                skin.insert(key(mesh, vertex), (mesh, vertex));
            }
        }
        let mut deepest_m = 0.0_f32;
        for (mesh, truth) in self
            .made
            .truth
            .iter()
            .enumerate()
            .filter(|(_, truth)| truth.is_garment)
        {
            for vertex in 0..truth.sources.len() {
                let (under, below) = skin[&key(mesh, vertex)];
                let apart = self.bound.skin_m[mesh][vertex] - self.bound.skin_m[under][below];
                let now = moved(mesh, vertex) - moved(under, below);
                deepest_m = deepest_m.max(-now.dot(apart.normalize_or_zero()));
            }
        }
        deepest_m
    }

    fn is_other_side(&self, row: usize, x_m: f32) -> bool {
        let entries = self.bound.binding.rows.entries(row);
        let (mut sum, mut total) = (0.0, 0.0);
        for (vertex, weight) in entries {
            sum += self.body.template_m[usize::from(vertex)].x * weight;
            total += weight;
        }
        let mean = sum / total;
        mean * x_m < 0.0 && mean.abs() > 0.01 && x_m.abs() > 0.01
    }

    /// Whether a row lies on another limb, more than 5 cm from where the vertex comes from.
    fn is_other_limb(&self, row: usize, source: u32) -> bool {
        let own = limb(&self.body, source as usize);
        let (mut mean_m, mut other, mut total) = (Vec3::ZERO, 0.0, 0.0);
        for (vertex, weight) in self.bound.binding.rows.entries(row) {
            total += weight;
            mean_m += self.body.template_m[usize::from(vertex)] * weight;
            if !is_near(own, limb(&self.body, usize::from(vertex))) {
                other += weight;
            }
        }
        let away_m = (mean_m / total).distance(self.body.template_m[source as usize]);
        other > 0.5 * total && away_m > 0.05
    }
}

/// Change of the offset over the length of each edge.
fn edge_changes(faces: &[[u32; 3]], positions_m: &[Vec3], offsets_m: &[Vec3]) -> Vec<f32> {
    let edges = faces
        .iter()
        .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    edges
        .filter_map(|edge| {
            let [a, b] = edge.map(|vertex| vertex as usize);
            let change = offsets_m[a].distance(offsets_m[b]);
            let moves = offsets_m[a] != Vec3::ZERO || offsets_m[b] != Vec3::ZERO;
            let length = positions_m[a].distance(positions_m[b]);
            (moves && length > 1e-5).then(|| change / length)
        })
        .collect()
}

fn percentile_99(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() * 99 / 100]
}

fn limb(body: &BodyModel, vertex: usize) -> Joint {
    Joint::ALL[usize::from(body.skin[vertex].joints[0])]
}

fn is_still(joint: Joint) -> bool {
    matches!(
        joint,
        Joint::Head
            | Joint::LeftWrist
            | Joint::RightWrist
            | Joint::LeftHand
            | Joint::RightHand
            | Joint::LeftFoot
            | Joint::RightFoot
    )
}

/// Whether two joints are one, a bone apart, or both of the trunk.
fn is_near(a: Joint, b: Joint) -> bool {
    let is_trunk = |joint: Joint| {
        matches!(
            joint,
            Joint::Pelvis
                | Joint::Spine1
                | Joint::Spine2
                | Joint::Spine3
                | Joint::Neck
                | Joint::LeftCollar
                | Joint::RightCollar
        )
    };
    let is_above = |low: Joint, high: Joint| low.parent() == Some(high);
    a == b || (is_trunk(a) && is_trunk(b)) || is_above(a, b) || is_above(b, a)
}
