//! Which vertices lie near each other along a surface, and means over such neighbourhoods.

use std::collections::VecDeque;
use std::ops::{Add, Mul};

use glam::Vec3;

/// How many standard deviations a [`Blur`] reaches.
const REACH: f32 = 2.5;

/// The edges of a surface: of each vertex its neighbours and how far away they are, in metres.
pub(crate) struct Edges(Vec<Vec<(u32, f32)>>);

impl Edges {
    pub fn new(positions_m: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let mut edges = vec![Vec::new(); positions_m.len()];
        for face in faces {
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                let length_m = positions_m[a as usize].distance(positions_m[b as usize]);
                edges[a as usize].push((b, length_m));
                edges[b as usize].push((a, length_m));
            }
        }
        Self(edges)
    }
}

/// Searches along edges, one after the other.
pub(crate) struct Nearby<'a> {
    edges: &'a Edges,
    /// Shortest way found to each vertex, for one search.
    best_m: Vec<f32>,
    reached: Vec<u32>,
    found: Vec<(u32, f32)>,
}

impl<'a> Nearby<'a> {
    pub fn new(edges: &'a Edges) -> Self {
        Self {
            edges,
            best_m: vec![f32::INFINITY; edges.0.len()],
            reached: Vec::new(),
            found: Vec::new(),
        }
    }

    /// Vertices within `reach_m` of `from`, itself among them, and their distances in metres.
    pub fn within(&mut self, from: u32, reach_m: f32) -> &[(u32, f32)] {
        self.reached.push(from);
        self.best_m[from as usize] = 0.0;
        let mut open = VecDeque::from([from]);
        while let Some(node) = open.pop_front() {
            let so_far = self.best_m[node as usize];
            for &(next, length_m) in &self.edges.0[node as usize] {
                let sum = so_far + length_m;
                let known = &mut self.best_m[next as usize];
                if sum < reach_m && sum < *known {
                    if known.is_infinite() {
                        self.reached.push(next);
                    }
                    *known = sum;
                    open.push_back(next);
                }
            }
        }
        self.found.clear();
        for node in self.reached.drain(..) {
            let known = &mut self.best_m[node as usize];
            self.found.push((node, *known));
            *known = f32::INFINITY;
        }
        &self.found
    }
}

/// Means over neighbourhoods of a size in metres: where a mesh is coarser nothing changes, where it is
/// finer its vertices go together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blur {
    /// Of each vertex, others and their weights, which sum to 1.
    weights: Vec<Vec<(u32, f32)>>,
}

impl Blur {
    /// A Gaussian of standard deviation `sigma_m` along the surface; vertices count by their area.
    pub fn new(positions_m: &[Vec3], faces: &[[u32; 3]], sigma_m: f32) -> Self {
        let mut area_m2 = vec![0.0; positions_m.len()];
        for face in faces {
            let [a, b, c] = face.map(|v| positions_m[v as usize]);
            for &v in face {
                area_m2[v as usize] += (b - a).cross(c - a).length() / 6.0;
            }
        }
        let edges = Edges::new(positions_m, faces);
        let mut nearby = Nearby::new(&edges);
        let weights = (0..positions_m.len())
            .map(|vertex| {
                let mut of_vertex: Vec<(u32, f32)> = nearby
                    .within(vertex as u32, REACH * sigma_m)
                    .iter()
                    .map(|&(other, distance_m)| {
                        let ratio = distance_m / sigma_m;
                        (
                            other,
                            area_m2[other as usize] * (-0.5 * ratio * ratio).exp(),
                        )
                    })
                    .collect();
                let sum: f32 = of_vertex.iter().map(|(_, weight)| weight).sum();
                if sum > 0.0 {
                    for (_, weight) in &mut of_vertex {
                        *weight /= sum;
                    }
                } else {
                    of_vertex = vec![(vertex as u32, 1.0)];
                }
                of_vertex
            })
            .collect();
        Self { weights }
    }

    /// The mean at one vertex.
    pub fn at<T>(&self, vertex: usize, value: impl Fn(usize) -> T) -> Option<T>
    where
        T: Add<Output = T> + Mul<f32, Output = T>,
    {
        self.weights[vertex]
            .iter()
            .map(|&(other, weight)| value(other as usize) * weight)
            .reduce(Add::add)
    }

    /// The means at all vertices.
    pub fn of<T>(&self, values: &[T]) -> Vec<T>
    where
        T: Copy + Add<Output = T> + Mul<f32, Output = T>,
    {
        (0..values.len())
            .map(|vertex| {
                self.at(vertex, |other| values[other])
                    .unwrap_or(values[vertex])
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of squares, 1 cm wide, whose columns are `spacing_m` apart.
    fn strip(spacing_m: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let positions_m = (0..40)
            .map(|k| Vec3::new((k / 2) as f32 * spacing_m, (k % 2) as f32 * 0.01, 0.0))
            .collect();
        let faces = (0..19)
            .flat_map(|k| {
                [
                    [2 * k, 2 * k + 2, 2 * k + 1],
                    [2 * k + 1, 2 * k + 2, 2 * k + 3],
                ]
            })
            .collect();
        (positions_m, faces)
    }

    #[test]
    fn neighbours_are_found_by_their_way_along_the_surface() {
        let (positions_m, faces) = strip(0.01);
        let edges = Edges::new(&positions_m, &faces);
        let mut nearby = Nearby::new(&edges);
        for _ in 0..2 {
            let mut found = nearby.within(20, 0.0205).to_vec();
            found.sort_by_key(|(vertex, _)| *vertex);
            let vertices: Vec<u32> = found.iter().map(|(vertex, _)| *vertex).collect();
            assert_eq!(vertices, [16, 18, 19, 20, 21, 22, 23, 24]);
            assert!((found[0].1 - 0.02).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn a_blur_leaves_coarse_meshes_alone_and_evens_out_fine_ones() {
        for (spacing_m, least, most) in [(0.05, 0.95, 1.0), (0.002, 0.0, 0.25)] {
            let (positions_m, faces) = strip(spacing_m);
            let blur = Blur::new(&positions_m, &faces, 0.004);
            let mut values = vec![0.0; positions_m.len()];
            values[20] = 1.0;
            let blurred = blur.of(&values);
            assert!((least..=most).contains(&blurred[20]), "{}", blurred[20]);
            assert!(
                blur.of(&[2.0; 40])
                    .iter()
                    .all(|v| (v - 2.0_f32).abs() < 1e-5)
            );
        }
    }
}
