//! Which point of the body moves each vertex of an avatar's skin, and how much.

use dynaskin_body::{BodyModel, vertex_normals};
use glam::Vec3;

use crate::parts::PartWeights;
use crate::skin::Skin;
use crate::surface::{Surface, SurfacePoint};

/// What a place of a part that a vertex does not belong to costs, metres.
const OTHER_PART_M: f32 = 0.08;
/// What a place that faces the other way costs, metres.
const OPPOSED_M: f32 = 0.03;
/// Up to here a vertex moves as the body does, metres.
const FULL_M: f32 = 0.03;
/// From here on it stays still, metres.
const NONE_M: f32 = 0.10;
/// Farthest that a place is looked for, metres: what is farther away stays still.
const FAR_M: f32 = 0.3;
/// Above this share of head, hands and feet a vertex stays still.
const STILL: f32 = 0.7;
/// A place is sure from this much of the same parts, this cosine between normals, and up to this far.
const SURE_IN_COMMON: f32 = 0.5;
const SURE_COSINE: f32 = 0.3;
const SURE_M: f32 = 0.05;

/// A way to the body that differs more than this from those around it is not sure, metres.
const STRAY_M: f32 = 0.006;
/// Steps from the closest place to the one straight below a point, at most.
const SLIDES: usize = 6;
/// Nearer than this to straight below is straight below, metres.
const LEAST_SLIDE_M: f32 = 2e-4;
/// The place below is at most this many times as far away as the closest one.
const MOST_SLIDE: f32 = 1.5;

/// The place of the body that moves a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// The place.
    pub at: SurfacePoint,
    /// How far the vertex lies from it, metres.
    pub distance_m: f32,
    /// How much of the body's offset it takes, 0..=1.
    pub strength: f32,
    /// Whether the place was found for sure; others are filled in from their neighbours.
    pub is_sure: bool,
}

/// The fitted body's surface, to find places on.
pub struct Places<'a> {
    surface: Surface<'a>,
    /// Without its drape, metres.
    bare_m: &'a [Vec3],
    normals: Vec<Vec3>,
    parts: Vec<PartWeights>,
}

impl<'a> Places<'a> {
    /// `draped_m`: the fitted body with its drape; `bare_m`: without it.
    pub fn new(body: &'a BodyModel, draped_m: &'a [Vec3], bare_m: &'a [Vec3]) -> Self {
        Self {
            surface: Surface::new(draped_m, &body.faces),
            bare_m,
            normals: vertex_normals(draped_m, &body.faces),
            parts: body.skin.iter().map(PartWeights::of_body).collect(),
        }
    }

    /// The place of every welded vertex; none for what stays still.
    pub fn links(&self, skin: &Skin) -> Vec<Option<Link>> {
        let mut links: Vec<Option<Link>> = (0..skin.len())
            .map(|vertex| self.link(skin, vertex))
            .collect();
        let strays: Vec<usize> = (0..skin.len())
            .filter(|vertex| self.is_stray(skin, &links, *vertex))
            .collect();
        for vertex in strays {
            if let Some(link) = &mut links[vertex] {
                link.is_sure = false;
            }
        }
        links
    }

    /// Whether the way from a vertex to its place is none of those around it: in a narrow fold the other
    /// side may be nearer.
    fn is_stray(&self, skin: &Skin, links: &[Option<Link>], vertex: usize) -> bool {
        let way = |vertex: usize| {
            let link = links[vertex].filter(|link| link.is_sure)?;
            Some(self.position_m(&link.at) - skin.positions_m[vertex])
        };
        let Some(own) = way(vertex) else {
            return false;
        };
        let around = skin.around(vertex).iter();
        let around: Vec<Vec3> = around.filter_map(|other| way(*other as usize)).collect();
        let mean = around.iter().sum::<Vec3>() / around.len().max(1) as f32;
        around.len() >= 3 && own.distance(mean) > STRAY_M
    }

    fn link(&self, skin: &Skin, vertex: usize) -> Option<Link> {
        let parts = &skin.parts[vertex];
        if parts.still() > STILL || parts.largest().is_none() {
            return None;
        }
        let normal = skin.normals[vertex];
        let at = self.closest(skin.positions_m[vertex], parts, Some(normal))?;
        let at = self.below(skin.positions_m[vertex], parts, normal, at);
        let cosine = at.mix(&self.normals).normalize_or_zero().dot(normal);
        let is_sure = self.in_common(&at, parts) >= SURE_IN_COMMON
            && cosine >= SURE_COSINE
            && at.distance_m <= SURE_M;
        Some(Link {
            at,
            distance_m: at.distance_m,
            strength: strength(self.bare_distance_m(skin.positions_m[vertex], &at)),
            is_sure,
        })
    }

    /// The place from which a point stands straight up, near the closest one.
    ///
    /// Above a fold (armpit, crotch, under a breast) the closest place lies on one of its sides, millimetres
    /// from the fold that the point covers. The normals between vertices turn smoothly over it.
    fn below(
        &self,
        position_m: Vec3,
        parts: &PartWeights,
        normal: Vec3,
        closest: SurfacePoint,
    ) -> SurfacePoint {
        // Where the point's foot would be, and how far that is from the place.
        let foot = |at: &SurfacePoint| {
            let (place_m, up) = (
                self.position_m(at),
                at.mix(&self.normals).normalize_or_zero(),
            );
            let foot_m = position_m - up * (position_m - place_m).dot(up);
            (foot_m, foot_m.distance(place_m))
        };
        let most_m = closest.distance_m * MOST_SLIDE;
        let mut at = closest;
        let (mut foot_m, mut miss_m) = foot(&at);
        for _ in 0..SLIDES {
            if miss_m < LEAST_SLIDE_M {
                break;
            }
            let Some(mut next) = self.closest(foot_m, parts, Some(normal)) else {
                break;
            };
            next.distance_m = self.position_m(&next).distance(position_m);
            let (next_foot_m, next_miss_m) = foot(&next);
            if next_miss_m >= miss_m || next.distance_m > most_m {
                break;
            }
            (at, foot_m, miss_m) = (next, next_foot_m, next_miss_m);
        }
        at
    }

    /// The place closest to a point, of the same parts and facing the same way where it can be.
    pub fn closest(
        &self,
        position_m: Vec3,
        parts: &PartWeights,
        normal: Option<Vec3>,
    ) -> Option<SurfacePoint> {
        self.surface.closest(position_m, FAR_M, |point| {
            let away = 1.0 - self.in_common(point, parts).min(1.0);
            let opposed = normal.map_or(0.0, |normal| {
                0.5 * (1.0 - point.mix(&self.normals).dot(normal)).clamp(0.0, 2.0)
            });
            OTHER_PART_M * away + OPPOSED_M * opposed
        })
    }

    /// A place in space, metres.
    pub fn position_m(&self, at: &SurfacePoint) -> Vec3 {
        at.mix(self.surface.positions_m())
    }

    /// How far a point lies from a place without its drape, metres.
    pub fn bare_distance_m(&self, position_m: Vec3, at: &SurfacePoint) -> f32 {
        // A place slides along the surface as the drape grows: what counts is how high the point stands.
        let lift_m = self.position_m(at).distance(at.mix(self.bare_m));
        let bare_m = position_m.distance(at.mix(self.bare_m));
        bare_m.min(at.distance_m + lift_m)
    }

    fn in_common(&self, at: &SurfacePoint, parts: &PartWeights) -> f32 {
        let corners = at.corners.map(|corner| &self.parts[corner as usize]);
        parts.compatible(&PartWeights::mixed(corners, at.shares))
    }
}

/// Full up to [`FULL_M`], none from [`NONE_M`], smooth between.
pub fn strength(distance_m: f32) -> f32 {
    let t = ((distance_m - FULL_M) / (NONE_M - FULL_M)).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}
