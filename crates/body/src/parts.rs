//! The thick and the thin part of each soft region.

use crate::{BodyModel, REGION_COUNT};

/// Parts of a region: its thicker half (of a woman's chest: the breasts), then its thinner one.
pub const PARTS: usize = 2;

impl BodyModel {
    /// For each part of each region (`[region][part]` flat, [`REGION_COUNT`] · [`PARTS`]) the weights
    /// of all vertices in it: those of the region, of the vertices that at β = 0 are thicker than its
    /// median, counted by weight, and of the others. Empty where the model knows no regions or no
    /// thickness.
    pub fn region_parts(&self) -> Vec<Vec<f32>> {
        let thickness_m = &self.thickness_template_m;
        if self.region_weights.len() != REGION_COUNT || thickness_m.len() != self.vertex_count() {
            return Vec::new();
        }
        let mut parts = Vec::new();
        for weights in &self.region_weights {
            let mut order: Vec<usize> = (0..weights.len()).collect();
            order.sort_by(|a, b| thickness_m[*b].total_cmp(&thickness_m[*a]));
            let half = 0.5 * weights.iter().sum::<f32>();
            let (mut thick, mut thin, mut seen) = (weights.clone(), weights.clone(), 0.0);
            for vertex in order {
                // Both halves have a vertex where a region has two.
                let other = if seen < half { &mut thin } else { &mut thick };
                other[vertex] = 0.0;
                seen += weights[vertex];
            }
            parts.extend([thick, thin]);
        }
        parts
    }
}
