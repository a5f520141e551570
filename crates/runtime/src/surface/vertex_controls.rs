//! What the controls say about each soft vertex.

use dynaskin_body::{BodyModel, REGION_COUNT};

use crate::controls::{Controls, OFFSET_LIMIT_M};

/// What is done to the offset of each soft vertex before it is shown.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VertexControls {
    /// Factors.
    pub gains: Vec<f32>,
    /// Longest offsets, in metres.
    pub limits_m: Vec<f32>,
}

impl VertexControls {
    /// Shows nothing of `count` soft vertices.
    pub fn none(count: usize) -> Self {
        Self {
            gains: vec![0.0; count],
            limits_m: vec![0.0; count],
        }
    }
}

/// Gain and limit of each of `soft_vertices` of `body` under `controls`: the regions' means weighted
/// by the vertex's membership. A vertex outside all regions is bone-like and gets 0; where the body
/// knows no regions, all get the strength alone.
pub(crate) fn vertex_controls(
    body: &BodyModel,
    soft_vertices: &[u32],
    controls: &Controls,
    target: &mut VertexControls,
) {
    if body.region_weights.len() != REGION_COUNT {
        target.gains.fill(controls.strength);
        target.limits_m.fill(OFFSET_LIMIT_M);
        return;
    }
    let targets = target.gains.iter_mut().zip(&mut target.limits_m);
    for (target, &vertex) in targets.zip(soft_vertices) {
        let (mut sum, mut gain, mut limit_m) = (0.0, 0.0, 0.0);
        for (weights, region) in body.region_weights.iter().zip(&controls.regions) {
            let weight = weights[vertex as usize];
            sum += weight;
            gain += weight * region.gain * controls.strength;
            limit_m += weight * region.limit_m;
        }
        (*target.0, *target.1) = if sum > 1e-6 {
            (gain / sum, limit_m / sum)
        } else {
            (0.0, 0.0)
        };
    }
}
