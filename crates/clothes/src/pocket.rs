//! Where a mesh is much finer than around, it holds a form that is too small for cloth to follow and has too many
//! rings of vertices for smoothing to take away. A pocket lays such vertices on the surface around them.
//!
//! That surface is a polynomial of second degree in the tangent plane, fitted to the two rings of vertices around the
//! pocket (least squares). Where in the plane an inner vertex belongs is the mean of where its neighbours do (Tutte
//! 1963), because a form with steep sides would fold. A fit is linear in the rings' positions, so its weights are found
//! once and then follow every shape and motion.

use glam::{DVec2, DVec3, Vec3};

/// Edges shorter than this share of the usual are fine ones.
const FINE: f32 = 0.6;
/// Coefficients of the polynomial: 1, u, v, u², uv, v².
const TERMS: usize = 6;
/// Rounds in which inner vertices go to their neighbours' mean; a pocket is some ten rings across.
const SPREADING_ROUNDS: usize = 300;
/// Vertices around a pocket that a fit needs to be sure of its terms.
const LEAST_AROUND: usize = 2 * TERMS;

/// A connected part of a surface whose vertices lie on what is around them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pocket {
    inner: Vec<u32>,
    around: Vec<u32>,
    /// `[inner][around]` flattened; those of one vertex sum to 1.
    weights: Vec<f32>,
}

impl Pocket {
    /// The pockets of the vertices whose `neighbours` (`[V]`, empty for those that must stay) are given, on a surface
    /// with these positions (metres) and normals.
    pub fn find(neighbours: &[&[u32]], places: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<Self> {
        let is_fine = fine_vertices(neighbours, places);
        let mut is_taken = vec![false; places.len()];
        let mut pockets = Vec::new();
        for vertex in 0..places.len() {
            if is_taken[vertex] || !is_fine[vertex] {
                continue;
            }
            let inner = connected(vertex as u32, neighbours, &is_fine, &mut is_taken);
            let around = rings(&inner, neighbours);
            pockets.extend(Self::fit(inner, around, neighbours, places, normals));
        }
        pockets
    }

    /// None where the vertices around say too little.
    fn fit(
        inner: Vec<u32>,
        around: Vec<u32>,
        neighbours: &[&[u32]],
        places: &[[f32; 3]],
        normals: &[[f32; 3]],
    ) -> Option<Self> {
        if around.len() < LEAST_AROUND {
            return None;
        }
        let place = |&vertex: &u32| Vec3::from(places[vertex as usize]).as_dvec3();
        let count = around.len() as f64;
        let middle = around.iter().map(place).sum::<DVec3>() / count;
        let normal: Vec3 = around
            .iter()
            .map(|&vertex| Vec3::from(normals[vertex as usize]))
            .sum();
        let normal = normal.as_dvec3().try_normalize()?;
        let (along_u, along_v) = normal.any_orthonormal_pair();
        let radius = around
            .iter()
            .map(|vertex| place(vertex).distance(middle))
            .sum::<f64>()
            / count;
        let mut plane = vec![DVec2::ZERO; places.len()];
        for vertex in &around {
            let from = (place(vertex) - middle) / radius;
            plane[*vertex as usize] = DVec2::new(from.dot(along_u), from.dot(along_v));
        }
        spread(&inner, neighbours, &mut plane);
        let terms = |vertex: &u32| {
            let DVec2 { x: u, y: v } = plane[*vertex as usize];
            [1.0, u, v, u * u, u * v, v * v]
        };
        let rows: Vec<[f64; TERMS]> = around.iter().map(terms).collect();
        let mut weights = Vec::with_capacity(inner.len() * around.len());
        for vertex in &inner {
            let solved = solve(normal_matrix(&rows), terms(vertex))?;
            weights.extend(rows.iter().map(|row| dot(row, &solved) as f32));
        }
        Some(Self {
            inner,
            around,
            weights,
        })
    }

    /// Lays the inner vertices on what is around them.
    pub fn apply(&self, places: &mut [[f32; 3]]) {
        for (&vertex, weights) in self
            .inner
            .iter()
            .zip(self.weights.chunks(self.around.len()))
        {
            let place: Vec3 = self
                .around
                .iter()
                .zip(weights)
                .map(|(&other, &weight)| Vec3::from(places[other as usize]) * weight)
                .sum();
            places[vertex as usize] = place.to_array();
        }
    }
}

/// Puts inner vertices between their neighbours in the plane; those around are there already.
fn spread(inner: &[u32], neighbours: &[&[u32]], plane: &mut [DVec2]) {
    for _ in 0..SPREADING_ROUNDS {
        for &vertex in inner {
            let beside = neighbours[vertex as usize];
            let sum: DVec2 = beside.iter().map(|&other| plane[other as usize]).sum();
            plane[vertex as usize] = sum / beside.len() as f64;
        }
    }
}

/// Vertices with short edges, and those beside them.
fn fine_vertices(neighbours: &[&[u32]], places: &[[f32; 3]]) -> Vec<bool> {
    let edge_m = |vertex: usize| {
        let place = Vec3::from(places[vertex]);
        let sum: f32 = neighbours[vertex]
            .iter()
            .map(|&other| place.distance(Vec3::from(places[other as usize])))
            .sum();
        sum / neighbours[vertex].len() as f32
    };
    let free = |vertex: &usize| !neighbours[*vertex].is_empty();
    let mut lengths_m: Vec<f32> = (0..places.len()).filter(free).map(edge_m).collect();
    lengths_m.sort_unstable_by(f32::total_cmp);
    let usual_m = lengths_m.get(lengths_m.len() / 2).copied().unwrap_or(0.0);
    let is_short: Vec<bool> = (0..places.len())
        .map(|vertex| free(&vertex) && edge_m(vertex) < FINE * usual_m)
        .collect();
    let beside_short = |vertex: &u32| is_short[*vertex as usize];
    (0..places.len())
        .map(|vertex| is_short[vertex] || neighbours[vertex].iter().any(beside_short))
        .collect()
}

/// All fine vertices that hang together with one.
fn connected(
    first: u32,
    neighbours: &[&[u32]],
    is_fine: &[bool],
    is_taken: &mut [bool],
) -> Vec<u32> {
    is_taken[first as usize] = true;
    let mut found = vec![first];
    let mut next = 0;
    while let Some(&vertex) = found.get(next) {
        next += 1;
        for &other in neighbours[vertex as usize] {
            if is_fine[other as usize] && !is_taken[other as usize] {
                is_taken[other as usize] = true;
                found.push(other);
            }
        }
    }
    found
}

/// The two rings of vertices around some.
fn rings(inner: &[u32], neighbours: &[&[u32]]) -> Vec<u32> {
    let mut seen = vec![false; neighbours.len()];
    for &vertex in inner {
        seen[vertex as usize] = true;
    }
    let mut around = Vec::new();
    let mut edge = inner.to_vec();
    for _ in 0..2 {
        let mut ring = Vec::new();
        for &vertex in &edge {
            for &other in neighbours[vertex as usize] {
                if !seen[other as usize] {
                    seen[other as usize] = true;
                    ring.push(other);
                }
            }
        }
        around.extend(&ring);
        edge = ring;
    }
    around
}

fn dot(a: &[f64; TERMS], b: &[f64; TERMS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The rows' sum of outer products.
fn normal_matrix(rows: &[[f64; TERMS]]) -> [[f64; TERMS]; TERMS] {
    let mut matrix = [[0.0; TERMS]; TERMS];
    for row in rows {
        for (line, a) in matrix.iter_mut().zip(row) {
            for (entry, b) in line.iter_mut().zip(row) {
                *entry += a * b;
            }
        }
    }
    matrix
}

/// Gaussian elimination with pivots; None for a matrix that is singular, or nearly.
fn solve(mut matrix: [[f64; TERMS]; TERMS], mut right: [f64; TERMS]) -> Option<[f64; TERMS]> {
    for column in 0..TERMS {
        let size = |row: &usize| matrix[*row][column].abs();
        let pivot = (column..TERMS).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        if size(&pivot) < 1e-9 {
            return None;
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let line = matrix[column];
        for row in (0..TERMS).filter(|&row| row != column) {
            let factor = matrix[row][column] / line[column];
            for (entry, above) in matrix[row].iter_mut().zip(line) {
                *entry -= factor * above;
            }
            right[row] -= factor * right[column];
        }
    }
    for (column, value) in right.iter_mut().enumerate() {
        *value /= matrix[column][column];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Vertices = Vec<[f32; 3]>;

    /// A dome of rings of twelve vertices, coarse outside and fine inside, with a rise of 5 mm on its top; `lift` bends
    /// it further.
    fn dome(lift: f32) -> (Vertices, Vertices, Vec<Vec<u32>>) {
        const AROUND: usize = 12;
        let radii_m = [0.002, 0.004, 0.006, 0.008, 0.028, 0.048, 0.068];
        let mut places = Vec::new();
        for radius_m in radii_m {
            for step in 0..AROUND {
                let angle = step as f32 / AROUND as f32 * std::f32::consts::TAU;
                let (x, y) = (radius_m * angle.cos(), radius_m * angle.sin());
                let rise_m = if radius_m < 0.005 { 0.005 } else { 0.0 };
                places.push([x, y, rise_m - 4.0 * (x * x + y * y) + lift * x]);
            }
        }
        let neighbours = (0..places.len())
            .map(|vertex| {
                let (ring, step) = (vertex / AROUND, vertex % AROUND);
                let at = |ring: usize, step: usize| (ring * AROUND + step % AROUND) as u32;
                let mut set = vec![at(ring, step + 1), at(ring, step + AROUND - 1)];
                set.extend(ring.checked_sub(1).map(|inside| at(inside, step)));
                set.extend((ring + 1 < radii_m.len()).then(|| at(ring + 1, step)));
                set
            })
            .collect();
        let normals = vec![[0.0, 0.0, 1.0]; places.len()];
        (places, normals, neighbours)
    }

    fn pockets_of(places: &[[f32; 3]], normals: &[[f32; 3]], sets: &[Vec<u32>]) -> Vec<Pocket> {
        let neighbours: Vec<&[u32]> = sets.iter().map(Vec::as_slice).collect();
        Pocket::find(&neighbours, places, normals)
    }

    #[test]
    fn a_small_form_lies_on_what_is_around_it_in_every_shape() {
        let (mut places, normals, sets) = dome(0.0);
        let pockets = pockets_of(&places, &normals, &sets);
        assert_eq!(pockets.len(), 1);
        for pocket in &pockets {
            pocket.apply(&mut places);
        }
        // The same pocket on the body as it is bent a moment later.
        let (mut bent, ..) = dome(0.3);
        for pocket in &pockets {
            pocket.apply(&mut bent);
        }
        for (places, lift) in [(places, 0.0), (bent, 0.3)] {
            for [x, y, z] in places {
                let expected_m = lift * x - 4.0 * (x * x + y * y);
                assert!(
                    (z - expected_m).abs() < 2e-4,
                    "{x} {y}: {z}, not {expected_m}"
                );
            }
        }
    }

    #[test]
    fn a_mesh_that_is_as_fine_everywhere_has_no_pockets() {
        let (mut places, normals, sets) = dome(0.0);
        for (idx, place) in places.iter_mut().enumerate() {
            let (ring, step) = (idx / 12, idx % 12);
            *place = [0.02 * ring as f32, 0.02 * step as f32, 0.0];
        }
        assert_eq!(pockets_of(&places, &normals, &sets), []);
    }

    #[test]
    fn vertices_that_must_stay_stay() {
        let (places, normals, sets) = dome(0.0);
        let none = vec![Vec::new(); sets.len()];
        assert_eq!(pockets_of(&places, &normals, &none), []);
    }
}
