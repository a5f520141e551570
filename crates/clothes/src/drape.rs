//! Lets painted clothes span hollows as cloth does; otherwise they would show every hollow and every
//! small rise of the skin.
//!
//! The painted surface is smoothed in the rest pose (Taubin 1995: towards the neighbours' mean, and back
//! again a little further), so that what is smaller than a few centimetres goes, and the body's form and
//! girth stay. What a fine patch of the mesh holds is laid flat before (`pocket`). Skin beside the cloth holds the hem.

use std::sync::OnceLock;

use glam::Vec3;

use crate::pocket::Pocket;

/// How often each vertex is moved towards its neighbours and back.
const ROUNDS: usize = 30;

/// How far of the way it goes there and back. The steps there alone would draw a trouser leg in.
const STEPS: [f32; 2] = [0.65, -0.666];

/// A part of a surface that is smoothed whenever it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drape {
    /// The vertices that move, and how much of the way.
    movers: Vec<(u32, f32)>,
    /// Where the neighbours of mover i begin; `[movers + 1]`.
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// Triangles that have a mover among their corners.
    faces: Vec<[u32; 3]>,
    /// Fine patches of the mesh, as the first surface shows them.
    pockets: OnceLock<Vec<Pocket>>,
}

impl Drape {
    /// For painted clothes: `cloth_shares` (`[V]`, 0..=1: how much of each vertex is cloth) and `faces` (`[F][3]`
    /// flattened, indices below V); None where there are none, or only narrow ones.
    pub fn of_clothes(cloth_shares: &[f32], faces: &[u32]) -> Option<Self> {
        let inside: Vec<bool> = cloth_shares
            .iter()
            .map(|&share| share > CLOTH_SHARE)
            .collect();
        Self::new(&inner_shares(&inside, faces), faces)
    }

    /// For `shares` of vertices (`[V]`, 0..=1: how much of the smoothing they take) and `faces` (`[F][3]`
    /// flattened, indices below V); None where nothing is to be smoothed.
    pub fn new(shares: &[f32], faces: &[u32]) -> Option<Self> {
        let mut sets: Vec<Vec<u32>> = vec![Vec::new(); shares.len()];
        let mut touched = Vec::new();
        for face in faces.as_chunks::<3>().0 {
            if face.iter().all(|&corner| shares[corner as usize] <= 0.0) {
                continue;
            }
            touched.push(*face);
            for &corner in face {
                let others = face.iter().filter(|&&other| other != corner);
                sets[corner as usize].extend(others);
            }
        }
        let mut drape = Self {
            movers: Vec::new(),
            starts: vec![0],
            neighbours: Vec::new(),
            faces: touched,
            pockets: OnceLock::new(),
        };
        for (vertex, (mut set, &share)) in sets.into_iter().zip(shares).enumerate() {
            if share <= 0.0 || set.is_empty() {
                continue;
            }
            set.sort_unstable();
            set.dedup();
            drape.movers.push((vertex as u32, share));
            drape.neighbours.extend(set);
            drape.starts.push(drape.neighbours.len());
        }
        (!drape.movers.is_empty()).then_some(drape)
    }

    /// How much of the way a vertex goes, 0..=1.
    pub fn share(&self, vertex: u32) -> f32 {
        let found = self.movers.iter().find(|(mover, _)| *mover == vertex);
        found.map_or(0.0, |&(_, share)| share)
    }

    /// Smooths positions (metres) and renews the normals (unit) where they moved; `[V][3]` flattened.
    pub fn apply(&self, positions_m: &mut [f32], normals: &mut [f32]) {
        let places = positions_m.as_chunks_mut::<3>().0;
        let normals = normals.as_chunks_mut::<3>().0;
        for pocket in self.pockets(places, normals) {
            pocket.apply(places);
        }
        let mut moved: Vec<Vec3> = Vec::with_capacity(self.movers.len());
        for step in STEPS.into_iter().cycle().take(2 * ROUNDS) {
            moved.clear();
            moved.extend(self.movers.iter().zip(self.starts.windows(2)).map(
                |(&(vertex, share), range)| {
                    let around = &self.neighbours[range[0]..range[1]];
                    let sum: Vec3 = around
                        .iter()
                        .map(|&other| Vec3::from(places[other as usize]))
                        .sum();
                    let place = Vec3::from(places[vertex as usize]);
                    place + (sum / around.len() as f32 - place) * step * share
                },
            ));
            // After all have been read: left and right would differ otherwise.
            for (&(vertex, _), place) in self.movers.iter().zip(&moved) {
                places[vertex as usize] = place.to_array();
            }
        }
        self.renew_normals(places, normals);
    }

    /// Fine patches of the mesh that move wholly, as the first surface that is asked about has them; `[V]` positions
    /// in metres and unit normals.
    fn pockets(&self, places: &[[f32; 3]], normals: &[[f32; 3]]) -> &[Pocket] {
        self.pockets.get_or_init(|| {
            let mut neighbours: Vec<&[u32]> = vec![&[]; places.len()];
            for (&(vertex, share), range) in self.movers.iter().zip(self.starts.windows(2)) {
                if share >= 1.0 {
                    neighbours[vertex as usize] = &self.neighbours[range[0]..range[1]];
                }
            }
            Pocket::find(&neighbours, places, normals)
        })
    }

    /// The triangles' normals, weighted by their areas, at the vertices that moved.
    fn renew_normals(&self, places: &[[f32; 3]], normals: &mut [[f32; 3]]) {
        let mut sums = vec![Vec3::ZERO; places.len()];
        for face in &self.faces {
            let [a, b, c] = face.map(|corner| Vec3::from(places[corner as usize]));
            let doubled = (b - a).cross(c - a);
            for &corner in face {
                sums[corner as usize] += doubled;
            }
        }
        for &(vertex, share) in &self.movers {
            let before = Vec3::from(normals[vertex as usize]);
            let after = sums[vertex as usize].try_normalize().unwrap_or(before);
            let mixed = before.lerp(after, share).try_normalize().unwrap_or(after);
            normals[vertex as usize] = mixed.to_array();
        }
    }
}

/// A vertex is under cloth from this share on; the hem is where it is a half. Nearer to the whole, hems that blend over
/// centimetres would hold what is not near them.
const CLOTH_SHARE: f32 = 0.75;

/// Rings of triangles from the hem inwards over which the cloth comes to be free of the skin: the hem
/// itself is held, or it would wander and fray.
const HEM_RINGS: usize = 3;

/// How freely each vertex moves: 0 outside and at the hem of what is `inside`, 1 some rings further in.
fn inner_shares(inside: &[bool], faces: &[u32]) -> Vec<f32> {
    let mut rings: Vec<usize> = inside
        .iter()
        .map(|&is_inside| if is_inside { HEM_RINGS } else { 0 })
        .collect();
    for ring in 1..HEM_RINGS {
        let before = rings.clone();
        for face in faces.as_chunks::<3>().0 {
            let corners = face.map(|corner| corner as usize);
            if corners.iter().all(|&corner| before[corner] >= ring) {
                continue;
            }
            for corner in corners {
                rings[corner] = rings[corner].min(ring);
            }
        }
    }
    let share = |ring: usize| (ring.max(1) - 1) as f32 / (HEM_RINGS - 1) as f32;
    rings.into_iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 41;

    /// A square sheet of vertices 8 mm apart, with a rise of 12 mm as wide as a fingertip in its middle.
    fn sheet() -> (Vec<f32>, Vec<f32>, Vec<u32>) {
        let middle = (SIDE / 2) as f32;
        let mut positions_m = Vec::new();
        for row in 0..SIDE {
            for column in 0..SIDE {
                let away = (row as f32 - middle).hypot(column as f32 - middle);
                let rise_m = 0.012 * (-(away / 1.4).powi(2)).exp();
                positions_m.extend([0.008 * column as f32, 0.008 * row as f32, rise_m]);
            }
        }
        let mut faces = Vec::new();
        for row in 0..SIDE - 1 {
            for column in 0..SIDE - 1 {
                let at = (row * SIDE + column) as u32;
                let above = at + SIDE as u32;
                faces.extend([at, at + 1, above, at + 1, above + 1, above]);
            }
        }
        let normals = [0.0, 0.0, 1.0].repeat(SIDE * SIDE);
        (positions_m, normals, faces)
    }

    #[test]
    fn a_small_rise_under_cloth_is_gone_from_surface_and_normals() {
        let (mut positions_m, mut normals, faces) = sheet();
        let drape = Drape::new(&vec![1.0; SIDE * SIDE], &faces).unwrap();
        drape.apply(&mut positions_m, &mut normals);
        let inner = |idx: usize| {
            let (row, column) = (idx / SIDE, idx % SIDE);
            (8..SIDE - 8).contains(&row) && (8..SIDE - 8).contains(&column)
        };
        for (idx, place) in positions_m.as_chunks::<3>().0.iter().enumerate() {
            assert!(place[2] < 0.0045, "{idx}: {place:?}");
        }
        for (idx, normal) in normals.as_chunks::<3>().0.iter().enumerate() {
            assert!(!inner(idx) || normal[2] > 0.975, "{idx}: {normal:?}");
        }
    }

    #[test]
    fn a_trouser_leg_keeps_its_girth() {
        const AROUND: usize = 24;
        const ROWS: usize = 30;
        const RADIUS_M: f32 = 0.08;
        let place = |idx: usize| {
            let angle = (idx % AROUND) as f32 / AROUND as f32 * std::f32::consts::TAU;
            [
                RADIUS_M * angle.cos(),
                0.02 * (idx / AROUND) as f32,
                RADIUS_M * angle.sin(),
            ]
        };
        let mut positions_m: Vec<f32> = (0..AROUND * ROWS).flat_map(place).collect();
        let mut faces = Vec::new();
        for row in 0..ROWS - 1 {
            for column in 0..AROUND {
                let at = |row: usize, column: usize| (row * AROUND + column % AROUND) as u32;
                let [a, b] = [at(row, column), at(row, column + 1)];
                let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
                faces.extend([a, c, b, b, c, d]);
            }
        }
        let shares: Vec<f32> = (0..AROUND * ROWS)
            .map(|idx| f32::from(u8::from((5..ROWS - 5).contains(&(idx / AROUND)))))
            .collect();
        let mut normals = vec![0.0; positions_m.len()];
        let drape = Drape::new(&shares, &faces).unwrap();
        drape.apply(&mut positions_m, &mut normals);
        for place in positions_m.as_chunks::<3>().0 {
            let radius_m = place[0].hypot(place[2]);
            assert!((radius_m / RADIUS_M - 1.0).abs() < 0.03, "{radius_m}");
        }
    }

    #[test]
    fn skin_stays_where_it_is() {
        let (before, normals_before, faces) = sheet();
        let (mut positions_m, mut normals) = (before.clone(), normals_before.clone());
        let half: Vec<f32> = (0..SIDE * SIDE)
            .map(|idx| if idx % SIDE < SIDE / 2 { 0.0 } else { 1.0 })
            .collect();
        let drape = Drape::new(&half, &faces).unwrap();
        drape.apply(&mut positions_m, &mut normals);
        for (idx, &share) in half.iter().enumerate() {
            if share == 0.0 {
                let range = 3 * idx..3 * idx + 3;
                assert_eq!(positions_m[range.clone()], before[range.clone()]);
                assert_eq!(normals[range.clone()], normals_before[range]);
            }
        }
        assert_eq!(Drape::new(&vec![0.0; SIDE * SIDE], &faces), None);
    }

    #[test]
    fn cloth_is_held_at_its_hem_and_free_further_in() {
        // A strip of 12 rows of two vertices; cloth from row 3 on.
        let faces: Vec<u32> = (0..11)
            .flat_map(|row| {
                let at = 2 * row;
                [at, at + 1, at + 2, at + 1, at + 3, at + 2]
            })
            .collect();
        let inside: Vec<bool> = (0..24).map(|idx| idx >= 6).collect();
        let shares = inner_shares(&inside, &faces);
        for (row, pair) in shares.as_chunks::<2>().0.iter().enumerate() {
            let expected = match row {
                0..=3 => 0.0,
                4 => 0.5,
                _ => 1.0,
            };
            assert!(
                pair.iter().all(|share| (share - expected).abs() < 1e-6),
                "{row}: {pair:?}"
            );
        }
    }
}
