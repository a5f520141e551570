//! Vertex normals of a body of which only some vertices move.

use dynaskin_body::{BodyModel, add_face_normals, add_face_normals_aligned};
use glam::{Vec3, Vec3A};

/// Which faces and normals can change when the soft vertices move.
#[derive(Debug)]
pub(crate) struct Topology {
    /// The soft vertices and all corners of faces with a soft corner, ascending: the moving vertices.
    moving_vertices: Vec<u32>,
    /// For each soft vertex, which of the moving vertices it is.
    soft_places: Vec<u32>,
    /// Faces with a soft corner, by place among the moving vertices.
    moving_faces: Vec<[u32; 3]>,
    /// Faces without one.
    still_faces: Vec<[u32; 3]>,
}

impl Topology {
    /// `soft_vertices` must be indices of `body`'s vertices.
    pub fn new(body: &BodyModel, soft_vertices: &[u32]) -> Self {
        let mut soft = vec![false; body.vertex_count()];
        for &vertex in soft_vertices {
            soft[vertex as usize] = true;
        }
        let (moving_faces, still_faces): (Vec<[u32; 3]>, Vec<_>) = body
            .faces
            .iter()
            .copied()
            .partition(|face| face.iter().any(|&corner| soft[corner as usize]));
        let corners = moving_faces.iter().flatten();
        let mut moving_vertices: Vec<u32> = corners.chain(soft_vertices).copied().collect();
        moving_vertices.sort_unstable();
        moving_vertices.dedup();
        let mut places = vec![0; body.vertex_count()];
        for (place, &vertex) in moving_vertices.iter().enumerate() {
            places[vertex as usize] = place as u32;
        }
        let place = |vertex: u32| places[vertex as usize];
        let moving_faces: Vec<_> = moving_faces.iter().map(|face| face.map(place)).collect();
        Self {
            soft_places: soft_vertices.iter().map(|&vertex| place(vertex)).collect(),
            moving_faces: interleaved(&moving_faces),
            still_faces,
            moving_vertices,
        }
    }

    /// For each soft vertex, which of the moving vertices it is.
    pub fn soft_places(&self) -> &[u32] {
        &self.soft_places
    }

    /// Those of `list`, one a vertex, that are the moving vertices'.
    pub fn moving(&self, list: &[Vec3]) -> Vec<Vec3A> {
        let vertices = self.moving_vertices.iter();
        vertices
            .map(|&vertex| list[vertex as usize].into())
            .collect()
    }

    /// For a surface without offsets: sums over the still faces of area-weighted normals at the
    /// moving vertices, and the unit normals over all faces at all vertices.
    pub fn still_normals(&self, positions_m: &[Vec3]) -> (Vec<Vec3A>, Vec<Vec3>) {
        let mut still = vec![Vec3::ZERO; positions_m.len()];
        add_face_normals(&self.still_faces, positions_m, &mut still);
        let mut normals: Vec<Vec3> = still.iter().map(|sum| sum.normalize_or(Vec3::Y)).collect();
        let still = self.moving(&still);
        let moving_m = self.moving(positions_m);
        self.update_normals(&still, &moving_m, &mut NormalsRoom::default(), &mut normals);
        (still, normals)
    }

    /// Writes the unit normals of the moving vertices, which are at `moving_m`, to `normals`, one a
    /// vertex of the body.
    pub fn update_normals(
        &self,
        still: &[Vec3A],
        moving_m: &[Vec3A],
        room: &mut NormalsRoom,
        normals: &mut [Vec3],
    ) {
        let NormalsRoom { sums, factors } = room;
        sums.clear();
        sums.extend_from_slice(still);
        add_face_normals_aligned(&self.moving_faces, moving_m, sums);
        factors.clear();
        factors.extend(sums.iter().map(|sum| sum.length_squared()));
        // A loop of its own: roots and quotients take longest, and here several are made at once.
        for factor in factors.iter_mut() {
            *factor = 1.0 / factor.sqrt();
        }
        let sums = sums.iter().zip(factors.iter());
        for (&vertex, (sum, &factor)) in self.moving_vertices.iter().zip(sums) {
            let has_direction = factor > 0.0 && factor.is_finite();
            let normal = if has_direction {
                *sum * factor
            } else {
                Vec3A::Y
            };
            normals[vertex as usize] = normal.into();
        }
    }
}

/// Room for the normals of the moving vertices; nothing in it is kept.
#[derive(Debug, Default)]
pub(crate) struct NormalsRoom {
    sums: Vec<Vec3A>,
    /// What each sum is multiplied with to have length 1.
    factors: Vec<f32>,
}

/// `faces` in an order in which neighbours do not share corners: each sum waits for the one before at
/// the same corner.
fn interleaved(faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    /// Parts of the list that are taken from in turn.
    const PARTS: usize = 8;
    let length = faces.len().div_ceil(PARTS).max(1);
    let parts = |index: usize| (0..PARTS).filter_map(move |part| faces.get(part * length + index));
    (0..length).flat_map(parts).copied().collect()
}
