//! Limits strain: neighbouring vertices move relative to each other by less than their distance.
//!
//! Offsets that change along the surface by less than the distance map it one to one, so nothing turns
//! inside out. Where they change by more, the two ends of an edge share the difference, edge after edge
//! (Gauss and Seidel's method, as strain limiting of cloth does it).

use std::collections::HashSet;

use glam::Vec3;

/// Sweeps over all edges at most, between two looks for triangles that turned over.
const MOST_SWEEPS: usize = 64;
/// So often at most triangles are turned back and edges limited again.
const MOST_ROUNDS: usize = 8;
/// An edge this little beyond the limit is left alone, as a share of its length.
const TOLERANCE: f32 = 0.02;

/// The edges of soft skin.
#[derive(Debug)]
pub(crate) struct Guard {
    /// Two vertices, and whether each is soft: a vertex that is not stays where it is.
    edges: Vec<([u32; 2], [bool; 2])>,
    /// The triangles with a soft corner, and which corners are soft.
    faces: Vec<([u32; 3], [bool; 3])>,
}

impl Guard {
    /// Of `faces` with vertices of which some are `soft`.
    pub fn new(faces: &[[u32; 3]], soft: &[bool]) -> Self {
        let mut known = HashSet::new();
        let mut edges = Vec::new();
        let is_soft = |vertex: u32| soft[vertex as usize];
        for &[a, b, c] in faces {
            for pair in [[a, b], [b, c], [c, a]] {
                let ends = pair.map(is_soft);
                let key = [pair[0].min(pair[1]), pair[0].max(pair[1])];
                if ends != [false; 2] && known.insert(key) {
                    edges.push((pair, ends));
                }
            }
        }
        let corners = faces.iter().map(|face| (*face, face.map(is_soft)));
        Self {
            edges,
            faces: corners.filter(|(_, soft)| *soft != [false; 3]).collect(),
        }
    }

    /// Limits `offsets_m` from `rest_m` (both of all vertices) to `max_strain`, as a share of each edge's
    /// length; those within it stay as they are. Returns whether any was beyond.
    pub fn limit(&self, rest_m: &[Vec3], offsets_m: &mut [Vec3], max_strain: f32) -> bool {
        let mut has_moved = false;
        for _ in 0..MOST_ROUNDS {
            has_moved |= self.limit_edges(rest_m, offsets_m, max_strain);
            // Thin triangles can still turn over within that, and turning them back stretches others.
            if !self.unfold_all(rest_m, offsets_m) {
                break;
            }
            has_moved = true;
        }
        has_moved
    }

    /// Lets the ends of edges beyond the limit share what is too much. Returns whether there were any.
    fn limit_edges(&self, rest_m: &[Vec3], offsets_m: &mut [Vec3], max_strain: f32) -> bool {
        for sweep in 0..MOST_SWEEPS {
            // There and back, or one end of the mesh would be preferred.
            let moved = if sweep % 2 == 0 {
                sweep_over(self.edges.iter(), rest_m, offsets_m, max_strain)
            } else {
                sweep_over(self.edges.iter().rev(), rest_m, offsets_m, max_strain)
            };
            if !moved {
                return sweep > 0;
            }
        }
        true
    }

    /// Turns triangles back until none faces the other way. Returns whether there were any.
    fn unfold_all(&self, rest_m: &[Vec3], offsets_m: &mut [Vec3]) -> bool {
        for sweep in 0..MOST_SWEEPS {
            if !self.unfold(rest_m, offsets_m) {
                return sweep > 0;
            }
        }
        true
    }

    /// Moves the corners of triangles that face the other way as one. Returns whether there were any.
    fn unfold(&self, rest_m: &[Vec3], offsets_m: &mut [Vec3]) -> bool {
        let mut has_moved = false;
        for &(face, soft) in &self.faces {
            let [a, b, c] = face.map(|corner| corner as usize);
            let normal = |[a_m, b_m, c_m]: [Vec3; 3]| (b_m - a_m).cross(c_m - a_m);
            let before = normal([rest_m[a], rest_m[b], rest_m[c]]);
            let moved_m = [a, b, c].map(|corner| rest_m[corner] + offsets_m[corner]);
            if before.dot(normal(moved_m)) >= 0.0 {
                continue;
            }
            let mean_m = (offsets_m[a] + offsets_m[b] + offsets_m[c]) / 3.0;
            for (corner, is_soft) in [a, b, c].into_iter().zip(soft) {
                if is_soft {
                    offsets_m[corner] = mean_m;
                }
            }
            has_moved = true;
        }
        has_moved
    }
}

fn sweep_over<'a>(
    edges: impl Iterator<Item = &'a ([u32; 2], [bool; 2])>,
    rest_m: &[Vec3],
    offsets_m: &mut [Vec3],
    max_strain: f32,
) -> bool {
    let mut has_moved = false;
    for &(pair, soft) in edges {
        let [a, b] = pair.map(|vertex| vertex as usize);
        let apart_m = offsets_m[a] - offsets_m[b];
        let limit_squared = max_strain * max_strain * rest_m[a].distance_squared(rest_m[b]);
        let beyond = (1.0 + TOLERANCE) * (1.0 + TOLERANCE) * limit_squared;
        if apart_m.length_squared() <= beyond {
            continue;
        }
        let excess_m = apart_m * (1.0 - (limit_squared / apart_m.length_squared()).sqrt());
        let [share_a, share_b] = match soft {
            [true, true] => [0.5, 0.5],
            [true, false] => [1.0, 0.0],
            _ => [0.0, 1.0],
        };
        offsets_m[a] -= excess_m * share_a;
        offsets_m[b] += excess_m * share_b;
        has_moved = true;
    }
    has_moved
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of 40 by 2 vertices, 10 mm apart; the first and last columns are not soft.
    fn strip() -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<bool>) {
        let rest_m = (0..80)
            .map(|idx| Vec3::new(0.01 * (idx / 2) as f32, 0.01 * (idx % 2) as f32, 0.0))
            .collect();
        let faces = (0..39)
            .flat_map(|column| {
                let at = 2 * column;
                [[at, at + 2, at + 1], [at + 1, at + 2, at + 3]]
            })
            .collect();
        let soft = (0..80).map(|idx| (2..78).contains(&idx)).collect();
        (rest_m, faces, soft)
    }

    fn largest_strain(rest_m: &[Vec3], offsets_m: &[Vec3], faces: &[[u32; 3]]) -> f32 {
        let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges
            .map(|[a, b]| [a as usize, b as usize])
            .map(|[a, b]| offsets_m[a].distance(offsets_m[b]) / rest_m[a].distance(rest_m[b]))
            .fold(0.0, f32::max)
    }

    #[test]
    fn a_fold_is_opened_up_to_the_limit_and_still_skin_stays() {
        let (rest_m, faces, soft) = strip();
        let mut offsets_m = vec![Vec3::ZERO; 80];
        for (idx, offset_m) in offsets_m.iter_mut().enumerate().take(44).skip(36) {
            *offset_m = Vec3::new(0.03, 0.0, 0.0) * if idx < 40 { 1.0 } else { -1.0 };
        }
        assert!(largest_strain(&rest_m, &offsets_m, &faces) > 5.0);
        let guard = Guard::new(&faces, &soft);
        assert!(guard.limit(&rest_m, &mut offsets_m, 0.6));
        let strain = largest_strain(&rest_m, &offsets_m, &faces);
        assert!(strain < 0.75, "{strain}");
        let normal = |[a, b, c]: [u32; 3]| {
            let at = |vertex: u32| rest_m[vertex as usize] + offsets_m[vertex as usize];
            (at(b) - at(a)).cross(at(c) - at(a))
        };
        assert!(faces.iter().all(|face| normal(*face).z >= 0.0));
        for idx in [0, 1, 78, 79] {
            assert_eq!(offsets_m[idx], Vec3::ZERO);
        }
    }

    #[test]
    fn skin_within_the_limit_is_left_alone() {
        let (rest_m, faces, soft) = strip();
        let slope = |idx: usize| Vec3::new(0.0, 0.0, 0.004 * (idx / 2).min(39 - idx / 2) as f32);
        let mut offsets_m: Vec<Vec3> = (0..80).map(slope).collect();
        let before = offsets_m.clone();
        assert!(!Guard::new(&faces, &soft).limit(&rest_m, &mut offsets_m, 0.6));
        assert_eq!(offsets_m, before);
    }
}
