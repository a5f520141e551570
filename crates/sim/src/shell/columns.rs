//! The columns of a shell: which vertices move, the fixed ring around them, and their tissue.

use dynaskin_body::REGION_COUNT;

use super::surface::Surface;
use super::topology::{neighbours, soft_vertices, softness};
use crate::settings::SimSettings;

/// Marks a vertex that is no column.
const NONE: u32 = u32::MAX;

/// Columns of one surface: first the moving ones (slots), then the fixed ring.
pub(super) struct Columns {
    /// Body vertex of each column.
    pub vertex: Vec<u32>,
    /// How many of them move.
    pub slots: usize,
    /// Each prism's three columns, in the winding of its face.
    pub prisms: Vec<[u32; 3]>,
    /// Neighbouring columns of each column.
    pub neighbours: Vec<Vec<u32>>,
    /// Sum of region weights, 0..=1.
    pub softness: Vec<f32>,
    /// Region weights made to sum to 1, `[column][region]`.
    pub mix: Vec<[f32; REGION_COUNT]>,
}

impl Columns {
    pub fn new(surface: &Surface, settings: &SimSettings) -> Option<Self> {
        let mut vertex = soft_vertices(&surface.region_weights, settings.softness_threshold);
        let slots = vertex.len();
        if slots == 0 {
            return None;
        }
        let mut column_of = vec![NONE; surface.positions_m.len()];
        for (slot, v) in vertex.iter().enumerate() {
            column_of[*v as usize] = slot as u32;
        }
        let moves = |v: u32, column_of: &[u32]| column_of[v as usize] < slots as u32;
        let mut prisms = Vec::new();
        for face in &surface.faces {
            if !face.iter().any(|&v| moves(v, &column_of)) {
                continue;
            }
            for &v in face {
                if column_of[v as usize] == NONE {
                    column_of[v as usize] = vertex.len() as u32;
                    vertex.push(v);
                }
            }
            prisms.push(face.map(|v| column_of[v as usize]));
        }
        let softness: Vec<f32> = vertex
            .iter()
            .map(|v| softness(&surface.region_weights, *v as usize))
            .collect();
        let neighbours = neighbours(vertex.len(), &prisms);
        let mut mix: Vec<[f32; REGION_COUNT]> = vertex
            .iter()
            .map(|v| std::array::from_fn(|region| surface.region_weights[region][*v as usize]))
            .collect();
        for column in 0..mix.len() {
            let own: f32 = mix[column].iter().sum();
            if own < 1e-3 {
                // A ring column outside every region takes the mean of its moving neighbours.
                let mut mean = [0.0; REGION_COUNT];
                for &other in neighbours[column].iter().filter(|&&n| (n as usize) < slots) {
                    for (sum, weight) in mean.iter_mut().zip(mix[other as usize]) {
                        *sum += weight;
                    }
                }
                mix[column] = mean;
            }
            let sum: f32 = mix[column].iter().sum();
            for weight in &mut mix[column] {
                *weight /= sum.max(1e-6);
            }
        }
        Some(Self {
            vertex,
            slots,
            prisms,
            neighbours,
            softness,
            mix,
        })
    }

    /// A preset's property at a column: the mean over its regions.
    pub fn mixed(&self, column: usize, property: impl Fn(usize) -> f32) -> f32 {
        self.mix[column]
            .iter()
            .enumerate()
            .map(|(region, weight)| weight * property(region))
            .sum()
    }
}
