//! Closest points on a surface, by parry's bounding volume hierarchy.

use glam::Vec3;
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::{PointQueryWithLocation as _, Ray, RayCast as _};
use parry3d::shape::{Triangle, TrianglePointLocation};

/// Nearer than this a face below a point is the point's own, metres.
const NEAREST_M: f32 = 1e-3;

/// A triangle's point: the corners and their shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub face: u32,
    /// Its corners.
    pub corners: [u32; 3],
    /// Barycentric coordinates.
    pub shares: [f32; 3],
    /// How far away it is, metres.
    pub distance_m: f32,
}

impl SurfacePoint {
    /// What a value by corner is at this point.
    pub fn mix<T>(&self, values: &[T]) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.corners.map(|corner| values[corner as usize]);
        a * self.shares[0] + b * self.shares[1] + c * self.shares[2]
    }
}

/// Triangles in space.
pub struct Surface<'a> {
    positions_m: &'a [Vec3],
    faces: &'a [[u32; 3]],
    tree: Bvh,
}

impl<'a> Surface<'a> {
    /// Corners must be indices of positions.
    pub fn new(positions_m: &'a [Vec3], faces: &'a [[u32; 3]]) -> Self {
        let boxes: Vec<Aabb> = faces
            .iter()
            .map(|face| {
                let [a, b, c] = face.map(|corner| positions_m[corner as usize]);
                Aabb::new(vector(a.min(b).min(c)), vector(a.max(b).max(c)))
            })
            .collect();
        Self {
            positions_m,
            faces,
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
        }
    }

    /// The corners' positions, metres.
    pub fn positions_m(&self) -> &'a [Vec3] {
        self.positions_m
    }

    /// The closest point within `most_m`, where `extra_m` says what a point costs beside its distance
    /// (metres, at least 0): of two at one distance the one with less.
    pub fn closest(
        &self,
        position_m: Vec3,
        most_m: f32,
        extra_m: impl Fn(&SurfacePoint) -> f32,
    ) -> Option<SurfacePoint> {
        let at = vector(position_m);
        let found = self.tree.find_best(
            most_m,
            |node, _| {
                let outside = (node.mins() - at).max(at - node.maxs()).max(Vector::ZERO);
                outside.length()
            },
            |face, best_m| {
                let point = self.on_face(face, position_m);
                (point.distance_m < best_m).then(|| (point.distance_m + extra_m(&point), point))
            },
        );
        found.map(|(_, (_, point))| point)
    }

    /// Whether a face that `is_meant` and looks up lies within `most_m` below a point.
    pub fn has_below(
        &self,
        position_m: Vec3,
        up: Vec3,
        most_m: f32,
        is_meant: impl Fn(u32) -> bool,
    ) -> bool {
        let ray = Ray::new(vector(position_m), vector(-up));
        let found = self.tree.cast_ray(&ray, most_m, |face, best_m| {
            let corners = self.faces[face as usize];
            let [a, b, c] = corners.map(|corner| self.positions_m[corner as usize]);
            if (b - a).cross(c - a).dot(up) <= 0.0 {
                return None;
            }
            let triangle = Triangle::new(vector(a), vector(b), vector(c));
            let hit_m = triangle.cast_local_ray(&ray, best_m, false)?;
            (hit_m > NEAREST_M && is_meant(face)).then_some(hit_m)
        });
        found.is_some()
    }

    fn on_face(&self, face: u32, position_m: Vec3) -> SurfacePoint {
        let corners = self.faces[face as usize];
        let [a, b, c] = corners.map(|corner| vector(self.positions_m[corner as usize]));
        let triangle = Triangle::new(a, b, c);
        let (projected, location) =
            triangle.project_local_point_and_get_location(vector(position_m), true);
        let shares = match location {
            TrianglePointLocation::OnVertex(corner) => {
                std::array::from_fn(|own| f32::from(own as u32 == corner))
            }
            TrianglePointLocation::OnSolid => [1.0, 0.0, 0.0],
            other => other.barycentric_coordinates().unwrap_or([1.0, 0.0, 0.0]),
        };
        let point = projected.point;
        SurfacePoint {
            face,
            corners,
            shares,
            distance_m: Vec3::new(point.x, point.y, point.z).distance(position_m),
        }
    }
}

fn vector(position: Vec3) -> Vector {
    Vector::new(position.x, position.y, position.z)
}
