//! The deformed rest surface: offsets scattered over the body's vertices, and normals.

use dynaskin_body::BodyModel;
use glam::Vec3;

/// No offset is longer than this, in metres, whatever the networks and controls say. Offsets up to
/// half of it are left alone: tissue of an adult does not move further against its bones in any
/// motion of the training data.
pub const OFFSET_LIMIT_M: f32 = 0.20;

/// What is done to the offset of one vertex before it is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexControls {
    /// Factor.
    pub gain: f32,
    /// Longest offset, in metres.
    pub limit_m: f32,
}

impl VertexControls {
    /// Shows nothing.
    pub const NONE: Self = Self {
        gain: 0.0,
        limit_m: 0.0,
    };
}

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
}

/// The surface of one avatar in the rest pose.
#[derive(Debug)]
pub(crate) struct Surface {
    /// Positions without offsets, in metres.
    still_positions_m: Vec<Vec3>,
    /// Sums over the still faces of area-weighted normals, per vertex.
    still_normals: Vec<Vec3>,
    /// Scratch: sums over all faces.
    normal_sums: Vec<Vec3>,
    pub offsets_m: Vec<Vec3>,
    pub positions_m: Vec<Vec3>,
    pub normals: Vec<Vec3>,
}

impl Surface {
    /// A surface without offsets.
    pub fn new(topology: &Topology, still_positions_m: Vec<Vec3>) -> Self {
        let count = still_positions_m.len();
        let mut surface = Self {
            still_positions_m: Vec::new(),
            still_normals: vec![Vec3::ZERO; count],
            normal_sums: vec![Vec3::ZERO; count],
            offsets_m: vec![Vec3::ZERO; count],
            positions_m: vec![Vec3::ZERO; count],
            normals: vec![Vec3::Y; count],
        };
        surface.set_still(topology, still_positions_m);
        surface
    }

    /// Changes the positions without offsets (as many as before).
    pub fn set_still(&mut self, topology: &Topology, still_positions_m: Vec<Vec3>) {
        self.still_positions_m = still_positions_m;
        for (position, (still, offset)) in self
            .positions_m
            .iter_mut()
            .zip(self.still_positions_m.iter().zip(&self.offsets_m))
        {
            *position = *still + *offset;
        }
        self.still_normals.fill(Vec3::ZERO);
        add_normals(
            &topology.still_faces,
            &self.positions_m,
            &mut self.still_normals,
        );
        self.normal_sums.copy_from_slice(&self.still_normals);
        for (normal, sum) in self.normals.iter_mut().zip(&self.normal_sums) {
            *normal = sum.normalize_or(Vec3::Y);
        }
        self.update_normals(topology);
    }

    /// Takes over `offsets_m` of `soft_vertices`, three numbers a vertex, times their gains, softly
    /// limited; positions and normals follow.
    pub fn apply(
        &mut self,
        topology: &Topology,
        soft_vertices: &[u32],
        offsets_m: &[f32],
        controls: &[VertexControls],
    ) {
        let triples = offsets_m.as_chunks::<3>().0;
        for ((&vertex, offset_m), controls) in soft_vertices.iter().zip(triples).zip(controls) {
            let offset_m = limited(
                Vec3::from_array(*offset_m) * controls.gain,
                controls.limit_m,
            );
            let idx = vertex as usize;
            self.offsets_m[idx] = offset_m;
            self.positions_m[idx] = self.still_positions_m[idx] + offset_m;
        }
        self.update_normals(topology);
    }

    /// Takes all offsets away.
    pub fn clear(&mut self, topology: &Topology) {
        self.offsets_m.fill(Vec3::ZERO);
        self.positions_m.copy_from_slice(&self.still_positions_m);
        self.update_normals(topology);
    }

    /// Area-weighted vertex normals, where faces can have moved.
    fn update_normals(&mut self, topology: &Topology) {
        for &vertex in &topology.moving_vertices {
            self.normal_sums[vertex as usize] = self.still_normals[vertex as usize];
        }
        add_normals(
            &topology.moving_faces,
            &self.positions_m,
            &mut self.normal_sums,
        );
        for &vertex in &topology.moving_vertices {
            self.normals[vertex as usize] = self.normal_sums[vertex as usize].normalize_or(Vec3::Y);
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

/// The offset with its length limited as by [`crate::features::SoftLimit`], the knee being half the
/// limit.
fn limited(offset_m: Vec3, limit_m: f32) -> Vec3 {
    let knee_m = 0.5 * limit_m;
    let squared = offset_m.length_squared();
    if squared <= knee_m * knee_m {
        return offset_m;
    }
    if limit_m <= 0.0 {
        return Vec3::ZERO;
    }
    let length = squared.sqrt();
    let room = limit_m - knee_m;
    let limited = knee_m + room * ((length - knee_m) / room).tanh();
    offset_m * (limited / length)
}
