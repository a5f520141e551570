//! The deformed rest surface: offsets scattered over the body's vertices, and normals.

mod normals;
pub(crate) mod skinning;
mod vertex_controls;

use std::cell::RefCell;

use dynaskin_skeleton::soft_limited;
use glam::{Vec3, Vec3A};

use normals::NormalsRoom;
pub(crate) use normals::Topology;
pub(crate) use vertex_controls::{VertexControls, vertex_controls};

/// The surface of a shape without offsets.
#[derive(Debug)]
pub(crate) struct RestSurface {
    /// In metres.
    pub positions_m: Vec<Vec3>,
    /// Positions of the moving vertices ([`Topology`]) in metres.
    moving_m: Vec<Vec3A>,
    /// Sums over the faces that no soft vertex moves of area-weighted normals, per moving vertex.
    still_normals: Vec<Vec3A>,
    /// Unit normals.
    normals: Vec<Vec3>,
}

impl RestSurface {
    /// With the positions `positions_m` of all vertices, in metres.
    pub fn new(topology: &Topology, positions_m: Vec<Vec3>) -> Self {
        let (still_normals, normals) = topology.still_normals(&positions_m);
        Self {
            moving_m: topology.moving(&positions_m),
            positions_m,
            still_normals,
            normals,
        }
    }
}

/// Room to work in, for the moving vertices of one surface.
#[derive(Default)]
struct Room {
    positions_m: Vec<Vec3A>,
    normals: NormalsRoom,
}

thread_local! {
    /// One a thread, not one an avatar: it holds nothing from one surface to the next.
    static ROOM: RefCell<Room> = RefCell::default();
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
        let moving_m = topology.moving(&self.positions_m);
        let mut room = NormalsRoom::default();
        topology.update_normals(&rest.still_normals, &moving_m, &mut room, &mut self.normals);
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
        ROOM.with_borrow_mut(|room| {
            room.positions_m.clone_from(&rest.moving_m);
            let triples = offsets_m.as_chunks::<3>().0;
            let places = soft_vertices.iter().zip(topology.soft_places());
            for (((&vertex, &place), offset_m), controls) in places.zip(triples).zip(controls) {
                // Offsets up to half the limit are left alone.
                let offset_m = soft_limited(
                    Vec3::from_array(*offset_m) * controls.gain,
                    0.5 * controls.limit_m,
                    controls.limit_m,
                );
                self.offsets_m[vertex as usize] = offset_m;
                let position_m = &mut room.positions_m[place as usize];
                *position_m += Vec3A::from(offset_m);
                self.positions_m[vertex as usize] = Vec3::from(*position_m);
            }
            let (moving_m, normals) = (&room.positions_m, &mut room.normals);
            topology.update_normals(&rest.still_normals, moving_m, normals, &mut self.normals);
        });
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
}
