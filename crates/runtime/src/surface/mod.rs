//! The deformed rest surface: offsets scattered over the body's vertices, and normals.

mod normals;
pub(crate) mod skinning;
mod vertex_controls;

use glam::Vec3;

pub(crate) use normals::Topology;
pub(crate) use vertex_controls::{VertexControls, vertex_controls};

/// The surface of a shape without offsets.
#[derive(Debug)]
pub(crate) struct RestSurface {
    /// In metres.
    pub positions_m: Vec<Vec3>,
    /// Sums over the faces that no soft vertex moves of area-weighted normals, per vertex.
    still_normals: Vec<Vec3>,
    /// Unit normals.
    normals: Vec<Vec3>,
}

impl RestSurface {
    /// With the positions `positions_m` of all vertices, in metres.
    pub fn new(topology: &Topology, positions_m: Vec<Vec3>) -> Self {
        let (still_normals, normals) = topology.still_normals(&positions_m);
        Self {
            positions_m,
            still_normals,
            normals,
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
    pub fn new(rest: &RestSurface) -> Self {
        Self {
            offsets_m: vec![Vec3::ZERO; rest.positions_m.len()],
            positions_m: rest.positions_m.clone(),
            normals: rest.normals.clone(),
        }
    }

    /// Changes the surface without offsets (of as many vertices); the offsets stay.
    pub fn set_rest(&mut self, topology: &Topology, rest: &RestSurface) {
        let still = rest.positions_m.iter().zip(&self.offsets_m);
        for (position, (still, offset)) in self.positions_m.iter_mut().zip(still) {
            *position = *still + *offset;
        }
        self.normals.copy_from_slice(&rest.normals);
        self.update_normals(topology, rest);
    }

    /// Takes over `offsets_m` of `soft_vertices`, three numbers a vertex, times their gains, softly
    /// limited; positions and normals follow.
    pub fn apply(
        &mut self,
        topology: &Topology,
        rest: &RestSurface,
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
            self.positions_m[idx] = rest.positions_m[idx] + offset_m;
        }
        self.update_normals(topology, rest);
    }

    /// Takes over offsets of all vertices, three numbers a vertex, as they are.
    pub fn show(&mut self, topology: &Topology, rest: &RestSurface, offsets_m: &[f32]) {
        for (idx, offset_m) in offsets_m.as_chunks::<3>().0.iter().enumerate() {
            let offset_m = Vec3::from_array(*offset_m);
            self.offsets_m[idx] = offset_m;
            self.positions_m[idx] = rest.positions_m[idx] + offset_m;
        }
        // Any vertex may have moved, so no face counts as still.
        let (_, normals) = topology.still_normals(&self.positions_m);
        // Hosts keep the arrays' addresses.
        self.normals.copy_from_slice(&normals);
    }

    /// Takes all offsets away.
    pub fn clear(&mut self, rest: &RestSurface) {
        self.offsets_m.fill(Vec3::ZERO);
        self.positions_m.copy_from_slice(&rest.positions_m);
        self.normals.copy_from_slice(&rest.normals);
    }

    /// Area-weighted vertex normals, where faces can have moved.
    fn update_normals(&mut self, topology: &Topology, rest: &RestSurface) {
        topology.update_normals(&rest.still_normals, &self.positions_m, &mut self.normals);
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
