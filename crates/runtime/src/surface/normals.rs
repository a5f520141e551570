//! Vertex normals of a body of which only some vertices move.

use std::ops::Range;

use dynaskin_body::{BodyModel, add_face_normals};
use glam::{Vec3, Vec3A};
use wide::bytemuck::{cast_slice, cast_slice_mut};

use super::pairs::{FacePair, pairs};
use super::triples::{load, store_run};

/// Which faces and normals can change in the rest pose.
#[derive(Debug)]
pub(crate) struct Topology {
    /// Vertices side by side that are soft, ascending.
    soft_runs: Vec<Range<usize>>,
    /// Vertices side by side whose normals can change, ascending.
    moving_runs: Vec<Range<usize>>,
    /// Faces with a corner that can move against the skeleton.
    moving_faces: Vec<FacePair>,
    /// Faces without one.
    still_faces: Vec<[u32; 3]>,
    vertex_count: usize,
}

impl Topology {
    /// `soft_vertices` must be indices of `body`'s vertices, ascending. Pose correctives can move any
    /// vertex, so where a body has them all faces count as moving.
    pub fn new(body: &BodyModel, soft_vertices: &[u32]) -> Self {
        let mut soft = vec![false; body.vertex_count()];
        for &vertex in soft_vertices {
            soft[vertex as usize] = true;
        }
        let corrects = !body.pose_dirs_m.is_empty();
        let (moving_faces, still_faces): (Vec<[u32; 3]>, Vec<_>) = body
            .faces
            .iter()
            .copied()
            .partition(|face| corrects || face.iter().any(|&corner| soft[corner as usize]));
        let mut moving = vec![false; body.vertex_count()];
        for &corner in moving_faces.iter().flatten() {
            moving[corner as usize] = true;
        }
        Self {
            soft_runs: runs(&soft),
            moving_runs: runs(&moving),
            moving_faces: interleaved(&pairs(&moving_faces)),
            still_faces,
            vertex_count: body.vertex_count(),
        }
    }

    /// Vertices side by side that are soft, ascending.
    pub fn soft_runs(&self) -> &[Range<usize>] {
        &self.soft_runs
    }

    /// For a surface without offsets: sums over the still faces of area-weighted normals at those
    /// moving vertices that have such faces, and the unit normals over all faces at all vertices.
    pub fn still_normals(&self, positions_m: &[Vec3]) -> (Vec<(u32, Vec3A)>, Vec<Vec3>) {
        let mut sums = vec![Vec3::ZERO; positions_m.len()];
        add_face_normals(&self.still_faces, positions_m, &mut sums);
        let moving = self.moving_runs.iter().cloned().flatten();
        let still: Vec<(u32, Vec3A)> = moving
            .map(|vertex| (vertex as u32, Vec3A::from(sums[vertex])))
            .filter(|(_, sum)| *sum != Vec3A::ZERO)
            .collect();
        let mut normals: Vec<Vec3> = sums.iter().map(|sum| sum.normalize_or(Vec3::Y)).collect();
        self.update_normals(
            &still,
            positions_m,
            &mut NormalsRoom::default(),
            &mut normals,
        );
        (still, normals)
    }

    /// Writes the unit normals of the vertices whose faces can have moved.
    pub fn update_normals(
        &self,
        still: &[(u32, Vec3A)],
        positions_m: &[Vec3],
        room: &mut NormalsRoom,
        normals: &mut [Vec3],
    ) {
        let NormalsRoom { sums, factors } = room;
        sums.resize(self.vertex_count, Vec3A::ZERO);
        for run in &self.moving_runs {
            sums[run.clone()].fill(Vec3A::ZERO);
        }
        for &(vertex, sum) in still {
            sums[vertex as usize] = sum;
        }
        let positions_m: &[f32] = cast_slice(positions_m);
        for corners in &self.moving_faces {
            let [a, b, c, d] = corners.map(|corner| corner as usize);
            let origin_m = load(positions_m, 3 * a);
            let [b_m, c_m, d_m] = [b, c, d].map(|corner| load(positions_m, 3 * corner) - origin_m);
            let (first, second) = (b_m.cross(c_m), c_m.cross(d_m));
            let both = first + second;
            sums[a] += both;
            sums[b] += first;
            sums[c] += both;
            sums[d] += second;
        }
        let normals: &mut [f32] = cast_slice_mut(normals);
        for run in &self.moving_runs {
            let sums = &sums[run.clone()];
            factors.clear();
            factors.extend(sums.iter().map(|sum| sum.length_squared()));
            // A loop of its own: roots and quotients take longest, and here several are made at once.
            for factor in factors.iter_mut() {
                let has_direction = *factor > 0.0;
                let reciprocal = 1.0 / factor.sqrt();
                *factor = if has_direction { reciprocal } else { 0.0 };
            }
            let unit = sums.iter().zip(factors.iter()).map(|(&sum, &factor)| {
                if factor > 0.0 { sum * factor } else { Vec3A::Y }
            });
            store_run(&mut normals[3 * run.start..3 * run.end], unit);
        }
    }
}

/// Room for the normals of one surface; nothing in it is kept.
#[derive(Debug, Default)]
pub(crate) struct NormalsRoom {
    /// One a vertex.
    sums: Vec<Vec3A>,
    /// What each sum of a run is multiplied with to have length 1.
    factors: Vec<f32>,
}

/// The ranges in which `list` is true.
fn runs(list: &[bool]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for index in (0..list.len()).filter(|&index| list[index]) {
        match runs.last_mut() {
            Some(run) if run.end == index => run.end += 1,
            _ => runs.push(index..index + 1),
        }
    }
    runs
}

/// `faces` in an order in which neighbours do not share corners: each sum waits for the one before at
/// the same corner.
fn interleaved(faces: &[FacePair]) -> Vec<FacePair> {
    /// Parts of the list that are taken from in turn.
    const PARTS: usize = 4;
    let length = faces.len().div_ceil(PARTS).max(1);
    let parts = |index: usize| (0..PARTS).filter_map(move |part| faces.get(part * length + index));
    (0..length).flat_map(parts).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_where_a_list_is_true() {
        assert_eq!(runs(&[false, true, true, false, true]), [1..3, 4..5]);
        assert!(runs(&[false; 3]).is_empty());
        assert_eq!(runs(&[true, false]), vec![0..1; 1]);
    }

    #[test]
    fn every_face_stands_in_the_other_order_once() {
        for count in [0, 1, 3, 4, 9, 17] {
            let faces: Vec<FacePair> = (0..count).map(|face| [face; 4]).collect();
            let mut again = interleaved(&faces);
            again.sort_unstable();
            assert_eq!(again, faces);
        }
    }
}
