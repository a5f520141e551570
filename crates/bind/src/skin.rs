//! An avatar's skin in one piece: vertices of all meshes in the bind pose, welded where they coincide.

use dynaskin_body::vertex_normals;
use glam::{DVec3, IVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::BindError;
use crate::avatar::Avatar;
use crate::bones::Bones;
use crate::parts::PartWeights;

/// Vertices nearer than this are one, metres.
const WELD_M: f32 = 2e-4;
/// Edge of the cells in which they are looked for, metres.
const CELL_M: f32 = 2.0 * WELD_M;
/// Farther away than this nothing of an avatar lies, metres.
const MOST_EXTENT_M: f32 = 1e4;
/// Less surface than this is none, of a square whose edge is a leg.
const LEAST_AREA: f64 = 1e-2;

/// Welded vertices and the surface between them.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Metres, bind pose, `[welded]`.
    pub positions_m: Vec<Vec3>,
    /// Unit normals, `[welded]`.
    pub normals: Vec<Vec3>,
    /// `[welded]`.
    pub parts: Vec<PartWeights>,
    /// Triangles over welded vertices, those without area left out.
    pub faces: Vec<[u32; 3]>,
    /// The welded vertex of each vertex, mesh by mesh.
    pub welded: Vec<u32>,
    /// Neighbours of each welded vertex along edges, sorted: `around[starts[v]..starts[v + 1]]`.
    pub starts: Vec<u32>,
    pub around: Vec<u32>,
    /// Of vertices where the skin ends, such as those of a hem: the neighbours along its end.
    hems: FxHashMap<u32, Vec<u32>>,
}

impl Skin {
    /// # Errors
    /// [`BindError::NoSurface`], [`BindError::NotFinite`] where matrices throw vertices far away.
    pub fn new(avatar: &Avatar, bones: &Bones) -> Result<Self, BindError> {
        let mut positions_m = Vec::with_capacity(avatar.vertex_count());
        for mesh in &avatar.meshes {
            let placed = bones.bind.positions_m(mesh);
            let far = placed
                .iter()
                .enumerate()
                .find(|(_, at)| !matches!(at.length(), ..MOST_EXTENT_M));
            if let Some((vertex, at)) = far {
                return Err(BindError::NotFinite {
                    place: format!(
                        "mesh `{}`, vertex {vertex} as its joints place it",
                        mesh.name
                    ),
                    found: f64::from(at.length()),
                });
            }
            positions_m.extend(placed);
        }
        let parts = PartWeights::of_all(avatar, bones);
        let welded = weld(&positions_m, &parts);
        let count = welded.iter().max().map_or(0, |last| *last as usize + 1);
        let mut skin = Self {
            positions_m: vec![Vec3::ZERO; count],
            normals: Vec::new(),
            parts: vec![PartWeights::default(); count],
            faces: Vec::new(),
            welded,
            starts: Vec::new(),
            around: Vec::new(),
            hems: FxHashMap::default(),
        };
        for (vertex, welded) in skin.welded.iter().enumerate() {
            skin.positions_m[*welded as usize] = positions_m[vertex];
            skin.parts[*welded as usize] = parts[vertex];
        }
        let (mut first, mut declared) = (0, 0);
        for mesh in &avatar.meshes {
            declared += mesh.faces.len();
            let faces = mesh
                .faces
                .iter()
                .map(|face| face.map(|corner| skin.welded[first + corner as usize]));
            let positions_m = &skin.positions_m;
            skin.faces
                .extend(faces.filter(|face| area_m2(positions_m, face) > 1e-12));
            first += mesh.positions.len();
        }
        let total_m2: f64 = skin
            .faces
            .iter()
            .map(|face| f64::from(area_m2(&skin.positions_m, face)))
            .sum();
        let least_m2 = LEAST_AREA * bones.leg().powi(2);
        // Written so that what is not a number is no surface.
        let has_surface = total_m2 > 0.0 && total_m2 >= least_m2;
        if !has_surface {
            return Err(BindError::NoSurface {
                faces: declared,
                area_m2: total_m2,
            });
        }
        if skin.encloses_outside() {
            skin.faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        skin.normals = vertex_normals(&skin.positions_m, &skin.faces);
        (skin.starts, skin.around) = neighbours(count, &skin.faces);
        skin.hems = hems(&skin.faces);
        Ok(skin)
    }

    /// Whether triangles look inwards, as those of mirrored files and of some exporters do.
    fn encloses_outside(&self) -> bool {
        let middle_m = self
            .positions_m
            .iter()
            .map(|at| at.as_dvec3())
            .sum::<DVec3>()
            / self.positions_m.len().max(1) as f64;
        let volume_m3 = |face: &[u32; 3]| {
            let [a, b, c] =
                face.map(|corner| self.positions_m[corner as usize].as_dvec3() - middle_m);
            a.cross(b).dot(c) / 6.0
        };
        self.faces.iter().map(volume_m3).sum::<f64>() < 0.0
    }

    /// Number of welded vertices.
    pub fn len(&self) -> usize {
        self.positions_m.len()
    }

    /// Neighbours of a welded vertex.
    pub fn around(&self, vertex: usize) -> &[u32] {
        &self.around[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    /// The neighbours whose mean lies beside a vertex: all, or those along the hem on which it is. The others
    /// of a hem lie on one side of it.
    pub fn beside(&self, vertex: usize) -> &[u32] {
        let along = self.hems.get(&(vertex as u32));
        along.map_or_else(|| self.around(vertex), Vec::as_slice)
    }
}

pub fn area_m2(positions_m: &[Vec3], face: &[u32; 3]) -> f32 {
    let [a, b, c] = face.map(|corner| positions_m[corner as usize]);
    0.5 * (b - a).cross(c - a).length()
}

/// The welded vertex of each vertex. Vertices at one place that belong to different limbs stay apart:
/// hands that touch thighs.
fn weld(positions_m: &[Vec3], parts: &[PartWeights]) -> Vec<u32> {
    let cell = |position: Vec3| (position / CELL_M).floor().as_ivec3();
    let mut cells: FxHashMap<IVec3, Vec<u32>> = FxHashMap::default();
    let mut kept: Vec<usize> = Vec::new();
    positions_m
        .iter()
        .enumerate()
        .map(|(vertex, position)| {
            let own = cell(*position);
            // The neighbouring cells that the weld's radius reaches into.
            let inside = (*position / CELL_M) - own.as_vec3();
            let step = IVec3::new(side(inside.x), side(inside.y), side(inside.z));
            for corner in 0..8 {
                let shift = IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2 & 1) * step;
                let near = cells.get(&(own + shift)).into_iter().flatten();
                for other in near {
                    let at = kept[*other as usize];
                    let is_same = positions_m[at].distance(*position) < WELD_M
                        && parts[at].in_common(&parts[vertex]) > 0.5;
                    if is_same {
                        return *other;
                    }
                }
            }
            let new = kept.len() as u32;
            kept.push(vertex);
            cells.entry(own).or_default().push(new);
            new
        })
        .collect()
}

fn side(inside: f32) -> i32 {
    if inside < 0.5 { -1 } else { 1 }
}

/// The neighbours along edges that belong to one face alone.
fn hems(faces: &[[u32; 3]]) -> FxHashMap<u32, Vec<u32>> {
    let edges = faces
        .iter()
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[from, to]| [*from.min(to), *from.max(to)]);
    let mut edges: Vec<[u32; 2]> = edges.collect();
    edges.sort_unstable();
    let mut hems: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for same in edges.chunk_by(|a, b| a == b) {
        if let [[a, b]] = *same {
            hems.entry(a).or_default().push(b);
            hems.entry(b).or_default().push(a);
        }
    }
    hems
}

fn neighbours(count: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let edges = || {
        faces
            .iter()
            .flat_map(|[a, b, c]| [(*a, *b), (*b, *a), (*b, *c), (*c, *b), (*c, *a), (*a, *c)])
    };
    let mut starts = vec![0_u32; count + 1];
    for (from, _) in edges() {
        starts[from as usize + 1] += 1;
    }
    for vertex in 0..count {
        starts[vertex + 1] += starts[vertex];
    }
    let mut next = starts.clone();
    let mut around = vec![0; starts[count] as usize];
    for (from, to) in edges() {
        let place = &mut next[from as usize];
        around[*place as usize] = to;
        *place += 1;
    }
    // Each inner edge stands there twice.
    let mut unique_starts = vec![0_u32; count + 1];
    let mut unique = Vec::with_capacity(around.len() / 2);
    for vertex in 0..count {
        let own = &mut around[starts[vertex] as usize..starts[vertex + 1] as usize];
        own.sort_unstable();
        let before = unique.len();
        for neighbour in own.iter() {
            if unique.len() == before || unique.last() != Some(neighbour) {
                unique.push(*neighbour);
            }
        }
        unique_starts[vertex + 1] = unique.len() as u32;
    }
    (unique_starts, unique)
}
