//! What a frame does: the body's offsets become those of an avatar's vertices.

use dynaskin_body::BodyModel;
use glam::{Mat3, Mat3A, Quat, Vec3, Vec3A};

use crate::binding::{Binding, MeshBinding};
use crate::error::BindingError;
use crate::vertex_stage::SOURCES_PER_LINE;

/// How far a vertex moves and how much its normal changes; a row's, or the body's. Two times four floats, of
/// which the fourth means nothing.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Change {
    /// Metres.
    pub offset_m: Vec3A,
    /// Of the unit normal.
    pub normal: Vec3A,
}

/// A vertex of the body in a row: its place in [`Player::changes`], and its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) place: u32,
    pub(crate) weight: f32,
}

/// The body's changes on an avatar's meshes, frame by frame.
#[derive(Debug)]
pub struct Player {
    binding: Binding,
    /// Vertices of the body that rows name, ascending.
    sources: Vec<u32>,
    /// The body's normals without offsets, `[source]`.
    still_normals: Vec<Vec3A>,
    /// `[source]`, padded to whole lines of a texture.
    pub(crate) changes: Vec<Change>,
    /// Where each row's entries begin, and where the last ones end.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    /// From the body's rest pose to the avatar's bind pose, `[row]`.
    turns: Vec<Mat3A>,
    /// In the avatar's bind pose, `[row]`.
    of_rows: Vec<Change>,
    surfaces: Vec<Surface>,
    /// Whether a vertex stage works out rows and surfaces.
    pub(crate) leaves_surfaces: bool,
}

/// The surface of a mesh that an engine draws: its own positions and normals with those of the body's
/// tissue on them, in the mesh's own space before skinning.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The mesh's name.
    name: String,
    pub(crate) vertices: Vec<MovingVertex>,
    /// From a row's offset in metres to the mesh's own unit and axes.
    pub(crate) mesh_from_row: Mat3A,
    /// The same for normals.
    pub(crate) normals_from_row: Mat3A,
    /// How joints that were bound in different poses turn each vertex; empty where they were bound in
    /// one.
    pub(crate) turns: Vec<Quat>,
    still_positions: Vec<f32>,
    still_normals: Vec<f32>,
    still_tangents: Vec<f32>,
    positions: Vec<f32>,
    normals: Vec<f32>,
    tangents: Vec<f32>,
    is_shown: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingVertex {
    pub(crate) vertex: u32,
    pub(crate) row: u32,
    /// How much of the row it takes.
    pub(crate) share: f32,
}

impl Player {
    /// `still_normals`: unit normals of the bound shape without offsets, `[vertex]`. The binding must be
    /// of `body`, as one that was read for it is.
    pub fn new(binding: Binding, body: &BodyModel, still_normals: &[Vec3]) -> Self {
        let mut place: Vec<Option<u32>> = vec![None; body.vertex_count()];
        let mut sources: Vec<u32> = binding
            .rows
            .vertices
            .iter()
            .copied()
            .map(u32::from)
            .collect();
        sources.sort_unstable();
        sources.dedup();
        for (at, source) in sources.iter().enumerate() {
            place[*source as usize] = Some(at as u32);
        }
        let rows = &binding.rows;
        let entries = rows.vertices.iter().zip(&rows.weights);
        let entries = entries.map(|(vertex, weight)| Entry {
            place: place[usize::from(*vertex)].unwrap_or(0),
            weight: *weight,
        });
        let normal = |source: &u32| {
            let normal = still_normals.get(*source as usize);
            Vec3A::from(normal.copied().unwrap_or(Vec3::Y))
        };
        Self {
            still_normals: sources.iter().map(normal).collect(),
            changes: vec![Change::default(); sources.len().next_multiple_of(SOURCES_PER_LINE)],
            starts: rows.starts.clone(),
            entries: entries.collect(),
            turns: rows
                .turns
                .iter()
                .map(|turn| Mat3A::from_quat(*turn))
                .collect(),
            of_rows: vec![Change::default(); rows.len()],
            surfaces: Vec::new(),
            leaves_surfaces: false,
            sources,
            binding,
        }
    }

    /// The binding that is played.
    pub fn binding(&self) -> &Binding {
        &self.binding
    }

    /// The surfaces, in the order in which they were added.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// The entries of a row.
    pub(crate) fn entries_of(&self, row: usize) -> &[Entry] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Adds a surface of the binding's mesh number `mesh` and gives its own number.
    ///
    /// `positions` and `normals` are as the engine has them, `[vertex][3]`, `normals` empty where there
    /// are none. `shares`: how much each vertex takes of the tissue, `[vertex]`, 0 to 1; empty for all
    /// of it.
    ///
    /// # Errors
    /// [`BindingError::NoMesh`], [`BindingError::Surface`].
    pub fn add_surface(
        &mut self,
        mesh: usize,
        positions: &[f32],
        normals: &[f32],
        shares: &[f32],
    ) -> Result<usize, BindingError> {
        let bound = self.binding.meshes.get(mesh).ok_or(BindingError::NoMesh {
            mesh,
            count: self.binding.meshes.len(),
        })?;
        let surface = Surface::new(bound, self.binding.size, (positions, normals, shares))?;
        self.surfaces.push(surface);
        Ok(self.surfaces.len() - 1)
    }

    /// Gives a surface tangents, `[vertex][4]`: the way and, last, its handedness. They keep to the plane of
    /// the normals.
    ///
    /// # Errors
    /// [`BindingError::Surface`] for a surface that is not there or has no normals, and for another number of tangents.
    pub fn set_tangents(&mut self, surface: usize, tangents: &[f32]) -> Result<(), BindingError> {
        let wrong = |mesh: &str, vertices: usize| BindingError::Surface {
            mesh: mesh.to_owned(),
            vertices: vertices as u32,
            what: format!("{} numbers for tangents", tangents.len()),
        };
        let Some(surface) = self.surfaces.get_mut(surface) else {
            return Err(wrong("", 0));
        };
        let vertices = surface.normals.len() / 3;
        if tangents.len() != 4 * vertices {
            return Err(wrong(&surface.name, vertices));
        }
        surface.still_tangents = tangents.to_vec();
        surface.tangents = tangents.to_vec();
        Ok(())
    }

    /// Whether a surface is seen; others stay as they are, and cost nothing.
    pub fn show(&mut self, surface: usize, is_shown: bool) {
        if let Some(surface) = self.surfaces.get_mut(surface) {
            surface.is_shown = is_shown;
        }
    }

    /// Takes over the body's offsets (metres, rest pose) and unit normals, `[vertex]`.
    pub fn update(&mut self, offsets_m: &[Vec3], normals: &[Vec3]) {
        if !self.surfaces.iter().any(|surface| surface.is_shown) {
            return;
        }
        for (at, source) in self.sources.iter().enumerate() {
            let source = *source as usize;
            self.changes[at] = Change {
                offset_m: offsets_m[source].into(),
                normal: Vec3A::from(normals[source]) - self.still_normals[at],
            };
        }
        if self.leaves_surfaces {
            return;
        }
        let ranges = self.starts.windows(2);
        for ((range, turn), out) in ranges.zip(&self.turns).zip(&mut self.of_rows) {
            let mut sum = Change::default();
            for entry in &self.entries[range[0] as usize..range[1] as usize] {
                let change = &self.changes[entry.place as usize];
                sum.offset_m += change.offset_m * entry.weight;
                sum.normal += change.normal * entry.weight;
            }
            *out = Change {
                offset_m: *turn * sum.offset_m,
                normal: *turn * sum.normal,
            };
        }
        let shown = self.surfaces.iter_mut().filter(|surface| surface.is_shown);
        shown.for_each(|surface| surface.update(&self.of_rows));
    }
}

impl Surface {
    fn new(
        bound: &MeshBinding,
        size: f32,
        (positions, normals, shares): (&[f32], &[f32], &[f32]),
    ) -> Result<Self, BindingError> {
        let count = bound.vertex_count as usize;
        let wrong = |what: &str, got: usize| BindingError::Surface {
            mesh: bound.name.clone(),
            vertices: bound.vertex_count,
            what: format!("{got} numbers for {what}"),
        };
        if positions.len() != 3 * count {
            return Err(wrong("positions", positions.len()));
        }
        if !normals.is_empty() && normals.len() != 3 * count {
            return Err(wrong("normals", normals.len()));
        }
        if !shares.is_empty() && shares.len() != count {
            return Err(wrong("shares", shares.len()));
        }
        let moving = bound.vertices.iter().zip(&bound.rows);
        let share = |vertex: u32| {
            shares
                .get(vertex as usize)
                .map_or(1.0, |share| share.clamp(0.0, 1.0))
        };
        let moving = moving.map(|(vertex, row)| MovingVertex {
            vertex: *vertex,
            row: *row,
            share: share(*vertex),
        });
        let takes: Vec<bool> = moving.clone().map(|moving| moving.share > 0.0).collect();
        let turns = bound.turns.iter().zip(&takes);
        let linear = bound.mesh_from_root;
        Ok(Self {
            name: bound.name.clone(),
            vertices: moving.filter(|moving| moving.share > 0.0).collect(),
            turns: turns
                .filter(|(_, takes)| **takes)
                .map(|(turn, _)| *turn)
                .collect(),
            mesh_from_row: Mat3A::from(linear * size),
            normals_from_row: Mat3A::from(normals_from(linear)),
            still_positions: positions.to_vec(),
            still_normals: normals.to_vec(),
            still_tangents: Vec::new(),
            positions: positions.to_vec(),
            normals: normals.to_vec(),
            tangents: Vec::new(),
            is_shown: true,
        })
    }

    /// The first vertex that moves and the one after the last; an empty range where none does.
    pub fn moving(&self) -> std::ops::Range<u32> {
        match (self.vertices.first(), self.vertices.last()) {
            (Some(first), Some(last)) => first.vertex..last.vertex + 1,
            _ => 0..0,
        }
    }

    /// How many vertices move.
    pub fn moving_count(&self) -> usize {
        self.vertices.len()
    }

    /// Positions with offsets, `[vertex][3]`.
    pub fn positions(&self) -> &[f32] {
        &self.positions
    }

    /// Unit normals, `[vertex][3]`; empty where the engine gave none.
    pub fn normals(&self) -> &[f32] {
        &self.normals
    }

    /// Unit tangents and their handedness, `[vertex][4]`; empty where the engine gave none.
    pub fn tangents(&self) -> &[f32] {
        &self.tangents
    }

    fn update(&mut self, of_rows: &[Change]) {
        let has_normals = !self.normals.is_empty();
        let has_tangents = !self.tangents.is_empty();
        for (at, moving) in self.vertices.iter().enumerate() {
            let row = &of_rows[moving.row as usize];
            let mut offset = self.mesh_from_row * row.offset_m;
            let mut normal = self.normals_from_row * row.normal;
            if let Some(turn) = self.turns.get(at) {
                offset = *turn * offset;
                normal = *turn * normal;
            }
            let share = moving.share;
            let from = 3 * moving.vertex as usize;
            let still = load(&self.still_positions, from);
            store(&mut self.positions, from, still + offset * share);
            if has_normals {
                let still = load(&self.still_normals, from);
                let changed = (still + normal * share).normalize_or(still);
                store(&mut self.normals, from, changed);
                if has_tangents {
                    let from = 4 * moving.vertex as usize;
                    let still = load(&self.still_tangents, from);
                    let within = still - changed * still.dot(changed);
                    store(&mut self.tangents, from, within.normalize_or(still));
                }
            }
        }
    }
}

/// Turns normals as `linear` turns the surface; without its size, the change of a unit vector stays one.
fn normals_from(linear: Mat3) -> Mat3 {
    let size = linear.determinant().abs().cbrt();
    let turned = linear.inverse().transpose() * size;
    if turned.is_finite() {
        turned
    } else {
        Mat3::IDENTITY
    }
}

fn load(numbers: &[f32], from: usize) -> Vec3A {
    Vec3A::from_slice(&numbers[from..from + 3])
}

fn store(numbers: &mut [f32], from: usize, value: Vec3A) {
    numbers[from..from + 3].copy_from_slice(&value.to_array());
}
