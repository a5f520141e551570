//! Vertex normals of a body of which only some vertices move.

use dynaskin_body::BodyModel;
use glam::Vec3;

/// Which faces and normals can change when the soft vertices move.
#[derive(Debug)]
pub(crate) struct Topology {
    /// Faces with a soft corner.
    moving_faces: Vec<[u32; 3]>,
    /// Faces without one.
    still_faces: Vec<[u32; 3]>,
    /// Corners of the moving faces, ascending.
    moving_vertices: Vec<u32>,
}

impl Topology {
    /// `soft_vertices` must be indices of `body`'s vertices.
    pub fn new(body: &BodyModel, soft_vertices: &[u32]) -> Self {
        let mut soft = vec![false; body.vertex_count()];
        for &vertex in soft_vertices {
            soft[vertex as usize] = true;
        }
        let (moving_faces, still_faces): (Vec<_>, Vec<_>) = body
            .faces
            .iter()
            .copied()
            .partition(|face| face.iter().any(|&corner| soft[corner as usize]));
        let mut moving_vertices: Vec<u32> = moving_faces.iter().flatten().copied().collect();
        moving_vertices.sort_unstable();
        moving_vertices.dedup();
        Self {
            moving_faces,
            still_faces,
            moving_vertices,
        }
    }

    /// For a surface without offsets: sums over the still faces of area-weighted normals, and the
    /// unit normals over all faces, per vertex.
    pub fn still_normals(&self, positions_m: &[Vec3]) -> (Vec<Vec3>, Vec<Vec3>) {
        let mut still = vec![Vec3::ZERO; positions_m.len()];
        add_normals(&self.still_faces, positions_m, &mut still);
        let mut normals: Vec<Vec3> = still.iter().map(|sum| sum.normalize_or(Vec3::Y)).collect();
        self.update_normals(&still, positions_m, &mut normals);
        (still, normals)
    }

    /// Unit normals of the vertices whose faces can have moved.
    pub fn update_normals(&self, still: &[Vec3], positions_m: &[Vec3], normals: &mut [Vec3]) {
        for &vertex in &self.moving_vertices {
            normals[vertex as usize] = still[vertex as usize];
        }
        add_normals(&self.moving_faces, positions_m, normals);
        for &vertex in &self.moving_vertices {
            let normal = &mut normals[vertex as usize];
            *normal = normal.normalize_or(Vec3::Y);
        }
    }
}

/// Adds each face's normal, times twice its area, to its corners.
fn add_normals(faces: &[[u32; 3]], positions_m: &[Vec3], sums: &mut [Vec3]) {
    for face in faces {
        let [a, b, c] = face.map(|corner| corner as usize);
        let origin = positions_m[a];
        let normal = (positions_m[b] - origin).cross(positions_m[c] - origin);
        sums[a] += normal;
        sums[b] += normal;
        sums[c] += normal;
    }
}
