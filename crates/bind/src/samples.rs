//! Sample points on an avatar's skin, and their closest points on the body.

use dynaskin_body::{BodyModel, vertex_normals};
use glam::Vec3;

use crate::parts::PartWeights;
use crate::skin::{Skin, area_m2};
use crate::surface::{Surface, SurfacePoint};

/// Points of the skin that a fit looks at.
const SAMPLE_COUNT: usize = 2_500;
/// Farthest that a point is looked for, metres.
const FAR_M: f32 = 0.3;
/// Scale of Geman and McClure's weight, metres.
const ROBUST_M: f32 = 0.03;
/// Weight of points outside the body, which clothes are.
const OUTSIDE: f32 = 0.4;
/// Cosine of the widest angle between normals: 72 degrees.
const LEAST_COSINE: f32 = 0.309;
/// What a place of another part costs, metres.
const OTHER_PART_M: f32 = 0.08;

/// A point of the skin.
struct Sample {
    position_m: Vec3,
    normal: Vec3,
    parts: PartWeights,
}

/// A point of the skin and a place of the body.
pub struct Match {
    /// Of the skin, metres.
    pub position_m: Vec3,
    /// The place of the body.
    pub at: SurfacePoint,
    /// The body's normal there.
    pub normal: Vec3,
    /// How much it counts.
    pub weight: f32,
}

/// What fits look at: points of the skin, and the faces of the body, both without head, hands and feet.
pub struct Samples {
    samples: Vec<Sample>,
    faces: Vec<[u32; 3]>,
    parts: Vec<PartWeights>,
    /// The body's vertices that are looked at.
    pub wanted: Vec<bool>,
}

impl Samples {
    pub fn new(body: &BodyModel, skin: &Skin) -> Self {
        let parts: Vec<PartWeights> = body.skin.iter().map(PartWeights::of_body).collect();
        let is_moving = |face: &&[u32; 3]| {
            face.iter()
                .all(|corner| parts[*corner as usize].still() < 0.7)
        };
        let faces: Vec<[u32; 3]> = body.faces.iter().filter(is_moving).copied().collect();
        let mut wanted = vec![false; body.vertex_count()];
        for corner in faces.iter().flatten() {
            wanted[*corner as usize] = true;
        }
        Self {
            samples: spread(skin),
            faces,
            parts,
            wanted,
        }
    }

    /// The faces of the body that are looked at.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Each point's place on the body with these posed positions, where it has one.
    pub fn matches(&self, positions_m: &[Vec3]) -> Vec<Match> {
        let normals = vertex_normals(positions_m, &self.faces);
        let surface = Surface::new(positions_m, &self.faces);
        let samples = self.samples.iter();
        samples
            .filter_map(|sample| self.matched(sample, &surface, &normals))
            .collect()
    }

    fn matched(&self, sample: &Sample, surface: &Surface<'_>, normals: &[Vec3]) -> Option<Match> {
        let at = surface.closest(sample.position_m, FAR_M, |point| {
            let corners = point.corners.map(|corner| &self.parts[corner as usize]);
            let parts = PartWeights::mixed(corners, point.shares);
            let away = 1.0 - sample.parts.in_common(&parts).min(1.0);
            let opposed = 0.5 * (1.0 - point.mix(normals).dot(sample.normal));
            OTHER_PART_M * away + ROBUST_M * opposed
        })?;
        let normal = at.mix(normals).normalize_or_zero();
        if normal.dot(sample.normal) < LEAST_COSINE {
            return None;
        }
        let robust =
            (ROBUST_M * ROBUST_M / (ROBUST_M * ROBUST_M + at.distance_m * at.distance_m)).powi(2);
        let mut match_ = Match {
            position_m: sample.position_m,
            at,
            normal,
            weight: robust,
        };
        if match_.height_m(surface.positions_m()) > 0.0 {
            match_.weight *= OUTSIDE;
        }
        Some(match_)
    }
}

impl Match {
    /// How far the point of the skin lies outside the body, metres.
    pub fn height_m(&self, positions_m: &[Vec3]) -> f32 {
        (self.position_m - self.at.mix(positions_m)).dot(self.normal)
    }
}

/// Skin this close below a point is what it covers, metres.
const COVERED_M: f32 = 0.06;

/// Points at even steps of the skin's area, without head, hands and feet, and without what covers other
/// skin: of layers the lowest tells most of the body.
fn spread(skin: &Skin) -> Vec<Sample> {
    let mut samples = everywhere(skin);
    let surface = Surface::new(&skin.positions_m, &skin.faces);
    samples.retain(|sample| {
        let is_same_part = |face: u32| {
            let corner = skin.faces[face as usize][0];
            skin.parts[corner as usize].in_common(&sample.parts) > 0.3
        };
        !surface.has_below(sample.position_m, sample.normal, COVERED_M, is_same_part)
    });
    samples
}

fn everywhere(skin: &Skin) -> Vec<Sample> {
    let is_moving = |face: &&[u32; 3]| {
        face.iter().all(|corner| {
            let parts = &skin.parts[*corner as usize];
            parts.still() < 0.5 && parts.largest().is_some()
        })
    };
    let faces = || skin.faces.iter().filter(is_moving);
    let area = |face: &[u32; 3]| area_m2(&skin.positions_m, face);
    let total: f32 = faces().map(area).sum();
    let step = total / SAMPLE_COUNT as f32;
    let mut passed = 0.5 * step;
    let mut samples = Vec::with_capacity(SAMPLE_COUNT);
    for face in faces() {
        passed += area(face);
        let [a, b, c] = face.map(|corner| skin.positions_m[corner as usize]);
        let mut place = 0;
        while passed > step && step > 0.0 && samples.len() < 2 * SAMPLE_COUNT {
            passed -= step;
            // The corners in turn, so that a large face is not looked at in its middle alone.
            let shares = SHARES[place % SHARES.len()];
            place += 1;
            samples.push(Sample {
                position_m: a * shares[0] + b * shares[1] + c * shares[2],
                normal: (b - a).cross(c - a).normalize_or_zero(),
                parts: PartWeights::mixed(
                    face.each_ref().map(|corner| &skin.parts[*corner as usize]),
                    shares,
                ),
            });
        }
    }
    samples
}

/// Places within a face.
const SHARES: [[f32; 3]; 4] = [
    [0.34, 0.33, 0.33],
    [0.6, 0.2, 0.2],
    [0.2, 0.6, 0.2],
    [0.2, 0.2, 0.6],
];
