//! What the controls say about each soft vertex.

use dynaskin_body::{BodyModel, REGION_COUNT};

use crate::controls::{Controls, OFFSET_LIMIT_M};

/// What is done to the offset of one vertex before it is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexControls {
    /// Factor.
    pub gain: f32,
    /// Longest offset, in metres.
    pub limit_m: f32,
}

impl VertexControls {
    /// Shows nothing.
    pub const NONE: Self = Self {
        gain: 0.0,
        limit_m: 0.0,
    };
}

/// Gain and limit of each of `soft_vertices` of `body` under `controls`: the regions' means weighted
/// by the vertex's membership. A vertex outside all regions is bone-like and gets 0; where the body
/// knows no regions, all get the strength alone.
pub(crate) fn vertex_controls(
    body: &BodyModel,
    soft_vertices: &[u32],
    controls: &Controls,
    target: &mut [VertexControls],
) {
    if body.region_weights.len() != REGION_COUNT {
        target.fill(VertexControls {
            gain: controls.strength,
            limit_m: OFFSET_LIMIT_M,
        });
        return;
    }
    for (target, &vertex) in target.iter_mut().zip(soft_vertices) {
        let (mut sum, mut gain, mut limit_m) = (0.0, 0.0, 0.0);
        for (weights, region) in body.region_weights.iter().zip(&controls.regions) {
            let weight = weights[vertex as usize];
            sum += weight;
            gain += weight * region.gain * controls.strength;
            limit_m += weight * region.limit_m;
        }
        *target = if sum > 1e-6 {
            VertexControls {
                gain: gain / sum,
                limit_m: limit_m / sum,
            }
        } else {
            VertexControls::NONE
        };
    }
}
