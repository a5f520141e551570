//! How far each vertex is from where one painted colour gives way to the other.
//!
//! Colours of whole vertices say that only roughly: drawn as they are, the line between two colours
//! follows the triangles. Here the shares are spread over the surface by diffusion, which knows the
//! triangles' shapes: a dense part of the mesh pulls no harder than a coarse one. They are then
//! turned into distances from the line where they are even. The distances are spread once more. A
//! distance is linear across its line, so the shader finds the line inside triangles of any size.

use glam::Vec3;

/// Distances beyond this are cut off, in metres: more than a triangle's edge.
pub const REACH_M: f32 = 0.05;

/// How far each of the two diffusions carries, in metres. Teeth of one triangle disappear, and
/// straps three triangles wide stay.
const SPREAD_M: f32 = 0.015;

/// A share this close to 0 or 1 is as far away as one can tell.
const LEAST_SHARE: f32 = 5e-4;

/// Diffusion stops where no value changes by more than this part of the values' range.
const TOLERANCE: f32 = 2e-4;
const MOST_ROUNDS: usize = 200;

/// Metres into the second colour, negative in the first, for shares of the second colour (`[V]`,
/// 0..=1) on a surface of `positions_m` (`[V][3]` flattened).
pub fn distances_m(shares: &[f32], faces: &[u32], positions_m: &[f32]) -> Vec<f32> {
    let sheet = Sheet::new(faces, positions_m.as_chunks::<3>().0);
    let spread = sheet.spread(shares, 1.0);
    // On a plane, diffusion from a straight line leaves `exp(-distance / SPREAD_M) / 2` beyond it.
    let rough: Vec<f32> = spread
        .iter()
        .map(|&share| {
            let beyond = share.min(1.0 - share).max(LEAST_SHARE);
            let distance_m = -SPREAD_M * (2.0 * beyond).ln();
            distance_m.copysign(share - 0.5)
        })
        .collect();
    sheet.spread(&rough, REACH_M)
}

/// A surface for diffusion: what each vertex exchanges with its neighbours.
struct Sheet {
    /// Where the neighbours of vertex i begin; `[V + 1]`.
    starts: Vec<usize>,
    /// Neighbour and conductance, those of vertex 0 first.
    neighbours: Vec<(u32, f32)>,
    /// The surface around each vertex in square metres.
    areas_m2: Vec<f32>,
}

impl Sheet {
    fn new(faces: &[u32], positions_m: &[[f32; 3]]) -> Self {
        let faces = faces.as_chunks::<3>().0;
        let mut starts = vec![0; positions_m.len() + 1];
        // Each corner meets the two others.
        for &corner in faces.as_flattened() {
            starts[corner as usize + 1] += 2;
        }
        for idx in 1..starts.len() {
            starts[idx] += starts[idx - 1];
        }
        let mut sheet = Self {
            neighbours: vec![(0, 0.0); starts[positions_m.len()]],
            areas_m2: vec![0.0; positions_m.len()],
            starts,
        };
        let mut ends = sheet.starts.clone();
        for face in faces {
            sheet.add_triangle(*face, positions_m, &mut ends);
        }
        sheet
    }

    /// Lets the corners of a triangle exchange: the cotangent weights of the finite-element
    /// Laplacian. Angles over 90° would repel; they count as none.
    fn add_triangle(&mut self, face: [u32; 3], positions_m: &[[f32; 3]], ends: &mut [usize]) {
        let corners = face.map(|idx| Vec3::from(positions_m[idx as usize]));
        let doubled_m2 = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .length();
        for opposite in 0..3 {
            let [a, b] = [(opposite + 1) % 3, (opposite + 2) % 3];
            let cosine_m2 = (corners[a] - corners[opposite]).dot(corners[b] - corners[opposite]);
            let conductance = 0.5 * cosine_m2.max(0.0) / doubled_m2.max(1e-12);
            for (from, to) in [(a, b), (b, a)] {
                let end = &mut ends[face[from] as usize];
                self.neighbours[*end] = (face[to], conductance);
                *end += 1;
            }
            self.areas_m2[face[opposite] as usize] += doubled_m2 / 6.0;
        }
    }

    /// Solves `u - SPREAD_M² Δu = values` by Gauss and Seidel's method, which converges for these
    /// weights; `range` is that of the values.
    fn spread(&self, values: &[f32], range: f32) -> Vec<f32> {
        let mut spread = values.to_vec();
        for _ in 0..MOST_ROUNDS {
            let mut largest_change = 0.0_f32;
            for vertex in 0..values.len() {
                let own = self.areas_m2[vertex];
                let (mut sum, mut weight) = (own * values[vertex], own);
                for &(neighbour, conductance) in
                    &self.neighbours[self.starts[vertex]..self.starts[vertex + 1]]
                {
                    let exchange = SPREAD_M * SPREAD_M * conductance;
                    sum += exchange * spread[neighbour as usize];
                    weight += exchange;
                }
                if weight > 0.0 {
                    let value = sum / weight;
                    largest_change = largest_change.max((value - spread[vertex]).abs());
                    spread[vertex] = value;
                }
            }
            if largest_change <= TOLERANCE * range {
                break;
            }
        }
        spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: usize = 24;
    const ROWS: usize = 30;

    /// A sheet 0.36 m wide whose rows grow from 5 to 26 mm, every second shifted sideways.
    fn sheet() -> (Vec<f32>, Vec<u32>) {
        let mut positions_m = Vec::new();
        for row in 0..ROWS {
            let y = 0.005 * row as f32 + 0.00036 * (row * row) as f32;
            for column in 0..COLUMNS {
                let shift = if row % 2 == 0 { 0.0 } else { 0.0065 };
                positions_m.extend([0.015 * column as f32 + shift, y, 0.0]);
            }
        }
        let mut faces = Vec::new();
        for row in 0..ROWS - 1 {
            for column in 0..COLUMNS - 1 {
                let at = (row * COLUMNS + column) as u32;
                let above = at + COLUMNS as u32;
                faces.extend([at, at + 1, above, at + 1, above + 1, above]);
            }
        }
        (positions_m, faces)
    }

    /// Where the line crosses the sheet's long edges and diagonals, by interpolation: the places
    /// where the shader would draw the hem.
    fn crossings(positions_m: &[f32], faces: &[u32], distances_m: &[f32]) -> Vec<[f32; 2]> {
        let mut found = Vec::new();
        for face in faces.as_chunks::<3>().0 {
            for side in 0..3 {
                let [a, b] = [face[side] as usize, face[(side + 1) % 3] as usize];
                let (from, to) = (distances_m[a], distances_m[b]);
                if (from < 0.0) != (to < 0.0) {
                    let share = from / (from - to);
                    let at = |axis: usize| {
                        let [start, end] = [positions_m[3 * a + axis], positions_m[3 * b + axis]];
                        start + share * (end - start)
                    };
                    found.push([at(0), at(1)]);
                }
            }
        }
        found
    }

    #[test]
    fn a_slanted_border_of_whole_vertices_becomes_a_straight_line() {
        let (positions_m, faces) = sheet();
        // Metres above a line that rises by 0.35 m a metre.
        let side_m = |[x, y]: [f32; 2]| (y - 0.17 - 0.35 * (x - 0.18)) / 0.35_f32.hypot(1.0);
        let places = positions_m.as_chunks::<3>().0;
        let shares: Vec<f32> = places
            .iter()
            .map(|p| if side_m([p[0], p[1]]) > 0.0 { 1.0 } else { 0.0 })
            .collect();
        let distances = distances_m(&shares, &faces, &positions_m);
        // Away from the sheet's sides, where a border meets them at a right angle.
        let inner = |[x, _]: &[f32; 2]| (0.06..0.30).contains(x);
        let off = crossings(&positions_m, &faces, &distances)
            .into_iter()
            .filter(inner)
            .map(side_m);
        let off: Vec<f32> = off.collect();
        assert!(off.len() > 20, "{}", off.len());
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        let spread = off.iter().map(|d| (d - mean).abs()).fold(0.0, f32::max);
        println!("the line is {mean:.4} m off, and leaves itself by {spread:.4} m");
        assert!(spread < 0.0035, "{spread}");
        assert!(mean.abs() < 0.006, "{mean}");
    }
}
