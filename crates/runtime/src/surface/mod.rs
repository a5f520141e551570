//! The deformed rest surface: offsets scattered over the body's vertices, and normals.

mod guard;
mod normals;
mod offsets;
mod pairs;
mod posed;
pub(crate) mod skinning;
mod triples;
mod vertex_controls;

use std::cell::RefCell;

use glam::{Vec3, Vec3A};
use wide::bytemuck::{cast_slice, cast_slice_mut};

pub(crate) use guard::Guard;
use normals::NormalsRoom;
pub(crate) use normals::Topology;
pub(crate) use posed::PosedRest;
pub(crate) use vertex_controls::{VertexControls, vertex_controls};

/// The surface of a shape without offsets.
#[derive(Clone, Debug)]
pub(crate) struct RestSurface {
    /// In metres.
    pub positions_m: Vec<Vec3>,
    /// Sums over the faces that no soft vertex moves of area-weighted normals, where vertices have
    /// both such faces and others: the vertex, and its sum.
    still_normals: Vec<(u32, Vec3A)>,
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

thread_local! {
    /// One a thread, not one an avatar.
    static ROOM: RefCell<NormalsRoom> = RefCell::default();
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
        self.set_positions(rest);
        self.normals.copy_from_slice(&rest.normals);
        self.update_normals(topology, rest);
    }

    /// As [`Self::set_rest`] without the normals, which are then to be updated.
    pub fn set_positions(&mut self, rest: &RestSurface) {
        let still = rest.positions_m.iter().zip(&self.offsets_m);
        for (position, (still, offset)) in self.positions_m.iter_mut().zip(still) {
            *position = *still + *offset;
        }
    }

    /// Takes over `offsets_m` of the soft vertices, three numbers a vertex, times their gains, softly
    /// limited; positions and normals follow.
    pub fn apply(
        &mut self,
        topology: &Topology,
        rest: &RestSurface,
        offsets_m: &[f32],
        controls: &VertexControls,
    ) {
        let rest_m: &[f32] = cast_slice(&rest.positions_m);
        let shown_m: &mut [f32] = cast_slice_mut(&mut self.offsets_m);
        let positions_m: &mut [f32] = cast_slice_mut(&mut self.positions_m);
        let mut first = 0;
        for run in topology.soft_runs() {
            let numbers = 3 * run.start..3 * run.end;
            let given_m = &offsets_m[3 * first..3 * (first + run.len())];
            offsets::shown(
                given_m,
                (controls, first),
                &rest_m[numbers.clone()],
                &mut shown_m[numbers.clone()],
                &mut positions_m[numbers],
            );
            first += run.len();
        }
        self.update_normals(topology, rest);
    }

    /// Limits how far neighbouring vertices move against each other; see [`Guard::limit`].
    pub fn hold_together(
        &mut self,
        topology: &Topology,
        guard: &Guard,
        rest: &RestSurface,
        max_strain: f32,
    ) {
        if !guard.limit(&rest.positions_m, &mut self.offsets_m, max_strain) {
            return;
        }
        self.set_positions(rest);
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
    pub fn update_normals(&mut self, topology: &Topology, rest: &RestSurface) {
        let (still, positions_m, normals) =
            (&rest.still_normals, &self.positions_m, &mut self.normals);
        ROOM.with_borrow_mut(|room| topology.update_normals(still, positions_m, room, normals));
    }
}
