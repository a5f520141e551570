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
        (0..skin.len())
            .map(|vertex| self.link(skin, vertex))
            .collect()
    }

    fn link(&self, skin: &Skin, vertex: usize) -> Option<Link> {
        let parts = &skin.parts[vertex];
        if parts.still() > STILL || parts.largest().is_none() {
            return None;
        }
        let normal = skin.normals[vertex];
        let at = self.closest(skin.positions_m[vertex], parts, Some(normal))?;
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
