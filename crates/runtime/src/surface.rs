//! The deformed rest surface: offsets scattered over the body's vertices, and normals.

use dynaskin_body::BodyModel;
use glam::Vec3;

use crate::figure::Figure;

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
    fn update_normals(&self, still: &[Vec3], positions_m: &[Vec3], normals: &mut [Vec3]) {
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

/// The surface of one avatar in the rest pose.
#[derive(Debug)]
pub(crate) struct Surface {
    pub offsets_m: Vec<Vec3>,
    pub positions_m: Vec<Vec3>,
    pub normals: Vec<Vec3>,
}

impl Surface {
    /// A surface without offsets.
    pub fn new(figure: &Figure) -> Self {
        Self {
            offsets_m: vec![Vec3::ZERO; figure.positions_m.len()],
            positions_m: figure.positions_m.clone(),
            normals: figure.normals.clone(),
        }
    }

    /// Changes the figure (of as many vertices); the offsets stay.
    pub fn set_figure(&mut self, topology: &Topology, figure: &Figure) {
        let still = figure.positions_m.iter().zip(&self.offsets_m);
        for (position, (still, offset)) in self.positions_m.iter_mut().zip(still) {
            *position = *still + *offset;
        }
        self.normals.copy_from_slice(&figure.normals);
        self.update_normals(topology, figure);
    }

    /// Takes over `offsets_m` of `soft_vertices`, three numbers a vertex, times their gains, softly
    /// limited; positions and normals follow.
    pub fn apply(
        &mut self,
        topology: &Topology,
        figure: &Figure,
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
            self.positions_m[idx] = figure.positions_m[idx] + offset_m;
        }
        self.update_normals(topology, figure);
    }

    /// Takes over offsets of all vertices, three numbers a vertex, as they are.
    pub fn show(&mut self, topology: &Topology, figure: &Figure, offsets_m: &[f32]) {
        for (idx, offset_m) in offsets_m.as_chunks::<3>().0.iter().enumerate() {
            let offset_m = Vec3::from_array(*offset_m);
            self.offsets_m[idx] = offset_m;
            self.positions_m[idx] = figure.positions_m[idx] + offset_m;
        }
        // Any vertex may have moved, so no face counts as still.
        let (_, normals) = topology.still_normals(&self.positions_m);
        // Hosts keep the arrays' addresses.
        self.normals.copy_from_slice(&normals);
    }

    /// Takes all offsets away.
    pub fn clear(&mut self, figure: &Figure) {
        self.offsets_m.fill(Vec3::ZERO);
        self.positions_m.copy_from_slice(&figure.positions_m);
        self.normals.copy_from_slice(&figure.normals);
    }

    /// Area-weighted vertex normals, where faces can have moved.
    fn update_normals(&mut self, topology: &Topology, figure: &Figure) {
        topology.update_normals(&figure.still_normals, &self.positions_m, &mut self.normals);
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

/// The offset with its length limited as by [`dynaskin_skeleton::SoftLimit`], the knee being half the
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
