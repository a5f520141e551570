//! Weight of each vertex in the fit of the pose: the papers' rigidity weights.

use dynaskin_body::BodyModel;
use glam::Vec3;

use crate::FitError;

/// Where the rigidity weights come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Rigidity {
    /// From the softness s of the body model: `1 / (1 + (s / 0.05)²)`. Skin moves in
    /// proportion to its softness, and the error of a scan is about a twentieth of the movement of fully soft
    /// skin: these are the inverse variances. With `1 - s` half-soft skin drags the joints along
    /// (docs/design/fitting.md). For bodies with soft regions.
    Body,
    /// From the scans: after a first fit with equal weights, skin that keeps its place in the rest
    /// pose is rigid, skin that moves there is not. For SMPL-family bodies, which have no regions.
    Data,
    /// The same for all vertices.
    Uniform,
    /// Given, `[vertex]`, 0 to 1.
    Given(Vec<f64>),
}

/// Softness of skin that moves about as much as a scan errs.
const USUAL_SOFTNESS: f64 = 0.05;
/// Least weight of a vertex: enough to place joints under which all skin is soft.
const LEAST: f64 = 0.002;

impl Rigidity {
    /// The weights, `[vertex]`; equal ones for [`Rigidity::Data`], which learns its own later.
    pub(crate) fn weights(&self, body: &BodyModel) -> Result<Vec<f64>, FitError> {
        let n = body.vertex_count();
        match self {
            Self::Body if body.region_weights.is_empty() => Err(FitError::Body {
                reason: "it has no soft regions to take rigidity weights from; take them from the \
                         scans (--rigidity data)"
                    .to_owned(),
            }),
            Self::Body => Ok((0..n)
                .map(|vertex| {
                    let ratio = f64::from(body.softness(vertex)) / USUAL_SOFTNESS;
                    1.0 / (1.0 + ratio * ratio)
                })
                .collect()),
            Self::Data | Self::Uniform => Ok(vec![1.0; n]),
            Self::Given(weights) => {
                let usable = weights.iter().all(|weight| (0.0..=1.0).contains(weight));
                if weights.len() == n && usable && weights.iter().any(|weight| *weight > 0.0) {
                    Ok(weights.clone())
                } else {
                    Err(FitError::Parameter {
                        name: "the rigidity weights",
                        got: format!("{} numbers", weights.len()),
                        expected: "one number of 0 to 1 for each vertex, not all 0",
                    })
                }
            }
        }
    }
}

/// Rigidity from rest-pose offsets `[frame][vertex]` in metres: `σ² / (σ² + m²)`, where m is the
/// vertex's RMS movement about its mean offset and σ the median of m over all vertices, at least
/// half a millimetre.
pub(crate) fn from_offsets(offsets_rest_m: &[Vec<Vec3>], vertex_count: usize) -> Vec<f64> {
    let frames = offsets_rest_m.len().max(1) as f64;
    let square_m2: Vec<f64> = (0..vertex_count)
        .map(|vertex| {
            let own = || offsets_rest_m.iter().map(|frame| frame[vertex].as_dvec3());
            let mean = own().sum::<glam::DVec3>() / frames;
            own().map(|x| x.distance_squared(mean)).sum::<f64>() / frames
        })
        .collect();
    let mut sorted = square_m2.clone();
    sorted.sort_by(f64::total_cmp);
    let usual_m2 = sorted.get(vertex_count / 2).copied().unwrap_or_default();
    let scale_m2 = usual_m2.max(2.5e-7);
    square_m2
        .iter()
        .map(|square| (scale_m2 / (scale_m2 + square)).powi(2).max(LEAST))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skin_that_moves_weighs_less_than_skin_that_stays_aside() {
        // Vertex 0 stays, 1 stays 3 cm aside, 2 swings by 1 cm, 3 stays.
        let frames: Vec<Vec<Vec3>> = (0..8)
            .map(|frame| {
                let swing = if frame % 2 == 0 { 0.01 } else { -0.01 };
                vec![Vec3::ZERO, Vec3::X * 0.03, Vec3::Y * swing, Vec3::ZERO]
            })
            .collect();
        let weights = from_offsets(&frames, 4);
        assert!(weights[0] == 1.0 && weights[1] > 0.999, "{weights:?}");
        assert!(weights[2] < 0.01, "{weights:?}");
    }
}
