//! Tissue pressed against tissue of another limb: arms on the trunk, thighs on each other.

use dynaskin_body::{JOINT_COUNT, Joint, SkinWeights, vertex_normals};
use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;
use wide::f32x4;

use crate::nearby::{Edges, Nearby};

/// Surface points further apart than this do not meet within a tick.
const REACH_M: f32 = 0.05;
/// Surface points nearer than this along the skin never press on each other: linear skinning lets
/// them overlap in every fold at armpit, groin and elbow, with no tissue behind it.
const FOLD_M: f32 = 0.12;
/// Pairs count as facing each other below this cosine of their normals.
const FACING: f32 = -0.3;
/// Overlap that is left alone, so that rounding at rest makes no force.
const SLACK_M: f32 = 5e-4;
/// Overlap, as a share of the tissue's depth, above which the push grows no further: skinning
/// drives limbs centimetres into each other where the bones leave no room.
const MOST_SHARE: f32 = 0.4;

/// What contact needs to know of a shell, the same in every pose.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactSurface {
    /// Limb of each slot.
    limb: Vec<u8>,
    /// Slots of other limbs within [`FOLD_M`] along the skin, ascending, of each slot.
    beside: Vec<Vec<u32>>,
    rest_m: Vec<Vec3>,
    rest_normal: Vec<Vec3>,
    /// Stiffness of each slot's whole column against pressure, in N/m.
    stiffness_n_per_m: Vec<f32>,
    /// Depth of each slot's column in metres.
    depth_m: Vec<f32>,
    /// Triangles of the columns (slots and ring), for normals.
    faces: Vec<[u32; 3]>,
}

/// Number of limbs that [`limb_of`] tells apart.
const LIMBS: usize = 5;

/// The limb that a joint moves: 0 trunk, then left and right arm, left and right leg.
fn limb_of(joint: Joint) -> u8 {
    let mut at = joint;
    loop {
        match at {
            Joint::LeftShoulder => return 1,
            Joint::RightShoulder => return 2,
            Joint::LeftHip => return 3,
            Joint::RightHip => return 4,
            _ => {}
        }
        match at.parent() {
            Some(parent) => at = parent,
            None => return 0,
        }
    }
}

impl ContactSurface {
    /// From the rest positions of all columns (slots first, then the ring), their skin weights and
    /// faces, and per slot stiffness and depth.
    pub fn new(
        columns_rest_m: &[Vec3],
        skin: &[SkinWeights],
        faces: &[[u32; 3]],
        stiffness_n_per_m: Vec<f32>,
        depth_m: Vec<f32>,
    ) -> Self {
        let slots = depth_m.len();
        let of_joint: [u8; JOINT_COUNT] = Joint::ALL.map(limb_of);
        let limb: Vec<u8> = skin[..slots]
            .iter()
            .map(|skin| {
                let strongest = (0..4)
                    .max_by(|a, b| skin.weights[*a].total_cmp(&skin.weights[*b]))
                    .unwrap_or(0);
                of_joint[usize::from(skin.joints[strongest])]
            })
            .collect();
        let edges = Edges::new(columns_rest_m, faces);
        let mut nearby = Nearby::new(&edges);
        let beside = (0..slots)
            .map(|slot| {
                let mut found: Vec<u32> = nearby
                    .within(slot as u32, FOLD_M)
                    .iter()
                    .map(|(other, _)| *other)
                    .filter(|other| {
                        limb.get(*other as usize)
                            .is_some_and(|other| *other != limb[slot])
                    })
                    .collect();
                found.sort_unstable();
                found
            })
            .collect();
        Self {
            limb,
            beside,
            rest_m: columns_rest_m[..slots].to_vec(),
            rest_normal: vertex_normals(columns_rest_m, faces)[..slots].to_vec(),
            stiffness_n_per_m,
            depth_m,
            faces: faces.to_vec(),
        }
    }
}

/// Two slots that face each other in one tick.
#[derive(Clone, Debug)]
struct Pair {
    a: u32,
    b: u32,
    /// Unit normal of b, from b towards a.
    normal: f32x4,
    /// Distance of the skinned surfaces along the normal at the last tick and now, in metres.
    gap_before_m: f32,
    gap_now_m: f32,
    /// Gap below which they press.
    touch_m: f32,
    stiffness_n_per_m: f32,
    most_m: f32,
}

/// The pairs in reach during one tick. Deterministic: pairs come in the order of their slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contacts {
    skinned_before_m: Vec<Vec3>,
    skinned_now_m: Vec<Vec3>,
    pairs: Vec<Pair>,
}

impl Contacts {
    /// Finds the pairs of a tick. `skinned_m`: where skinning puts all columns, relative to the
    /// pelvis; `displacement` of the slots, of which only the first three numbers are used.
    pub fn find(&mut self, surface: &ContactSurface, skinned_m: Vec<Vec3>, displacement: &[f32x4]) {
        self.skinned_before_m = std::mem::replace(&mut self.skinned_now_m, skinned_m);
        if self.skinned_before_m.len() != self.skinned_now_m.len() {
            self.skinned_before_m.clone_from(&self.skinned_now_m);
        }
        self.pairs.clear();
        let slots = surface.limb.len();
        let now = &self.skinned_now_m;
        let at: Vec<Vec3> = (0..slots)
            .map(|slot| {
                let [x, y, z, _] = displacement[slot].to_array();
                now[slot] + Vec3::new(x, y, z)
            })
            .collect();
        let normals = vertex_normals(now, &surface.faces);
        let near = near_other_limbs(surface, &at);
        let mut grid = Grid::default();
        for (slot, p) in at.iter().enumerate() {
            if near[slot] {
                // Casts saturate: a body out of all bounds meets nothing.
                grid.entry(cell(*p)).or_default().push(slot as u32);
            }
        }
        for a in (0..slots).filter(|a| near[*a]) {
            let Some(b) = nearest_of_other_limb(surface, &grid, &at, &normals, a) else {
                continue;
            };
            let normal = normals[b];
            let along = |p: &[Vec3]| (p[a] - p[b]).dot(normal);
            let rest_gap_m = (surface.rest_m[a] - surface.rest_m[b]).dot(surface.rest_normal[b]);
            let shallower_m = surface.depth_m[a].min(surface.depth_m[b]);
            self.pairs.push(Pair {
                a: a as u32,
                b: b as u32,
                normal: f32x4::new([normal.x, normal.y, normal.z, 0.0]),
                gap_before_m: along(&self.skinned_before_m),
                gap_now_m: along(now),
                touch_m: rest_gap_m.min(0.0) - SLACK_M,
                // Each of the two finds the other: half the stiffness each.
                stiffness_n_per_m: 0.5
                    * surface.stiffness_n_per_m[a].min(surface.stiffness_n_per_m[b]),
                most_m: MOST_SHARE * shallower_m,
            });
        }
    }

    /// Adds the contact forces in newtons at `displacement`, `share` of the tick after its start.
    pub fn add_forces(&self, share: f32, displacement: &[f32x4], force: &mut [f32x4]) {
        for pair in &self.pairs {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let moved_m = ((displacement[a] - displacement[b]) * pair.normal).reduce_add();
            let skinned_m = pair.gap_before_m + (pair.gap_now_m - pair.gap_before_m) * share;
            let overlap_m = pair.touch_m - skinned_m - moved_m;
            if overlap_m > 0.0 {
                let push = pair.stiffness_n_per_m * overlap_m.min(pair.most_m);
                let push = pair.normal * f32x4::splat(push);
                force[a] += push;
                force[b] -= push;
            }
        }
    }
}

/// Surface points by the cell of space that they lie in; hashed fast, as there are thousands.
type Grid = FxHashMap<IVec3, Vec<u32>>;

fn cell(p: Vec3) -> IVec3 {
    (p / REACH_M).floor().as_ivec3()
}

/// Which slots lie in reach of the box around another limb: most do not, and need no search.
fn near_other_limbs(surface: &ContactSurface, at: &[Vec3]) -> Vec<bool> {
    let mut boxes = [(Vec3::INFINITY, Vec3::NEG_INFINITY); LIMBS];
    for (limb, p) in surface.limb.iter().zip(at) {
        let (low, high) = &mut boxes[usize::from(*limb)];
        (*low, *high) = (low.min(*p), high.max(*p));
    }
    surface
        .limb
        .iter()
        .zip(at)
        .map(|(own, p)| {
            boxes.iter().enumerate().any(|(limb, (low, high))| {
                limb != usize::from(*own)
                    && p.cmpge(*low - REACH_M).all()
                    && p.cmple(*high + REACH_M).all()
            })
        })
        .collect()
}

/// The nearest slot of another limb whose surface faces that of `a`.
fn nearest_of_other_limb(
    surface: &ContactSurface,
    grid: &Grid,
    at: &[Vec3],
    normals: &[Vec3],
    a: usize,
) -> Option<usize> {
    let centre = cell(at[a]);
    let mut best: Option<(f32, usize)> = None;
    for dx in -1..=1 {
        for dy in -1..=1 {
            for dz in -1..=1 {
                let cell = centre.saturating_add(IVec3::new(dx, dy, dz));
                for &other in grid.get(&cell).into_iter().flatten() {
                    let b = other as usize;
                    let distance2 = at[a].distance_squared(at[b]);
                    let nearer = best.is_none_or(|(least, known)| {
                        distance2 < least || (distance2 == least && b < known)
                    });
                    if surface.limb[b] != surface.limb[a]
                        && distance2 < REACH_M * REACH_M
                        && nearer
                        && normals[a].dot(normals[b]) < FACING
                        && surface.beside[a].binary_search(&other).is_err()
                    {
                        best = Some((distance2, b));
                    }
                }
            }
        }
    }
    best.map(|(_, b)| b)
}
