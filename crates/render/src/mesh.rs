//! A body's constant data, as callers hand it in, and its checks.

use crate::{RenderError, check, gpu_data::JOINT_COUNT};

/// Constant data of one body: everything that does not change from frame to frame.
///
/// # Shapes
///
/// For V vertices and F triangles.
#[derive(Clone, Copy, Debug)]
pub struct BodyMesh<'a> {
    /// Vertex indices, counter-clockwise seen from outside, `[F][3]` flattened.
    pub faces: &'a [u32],
    /// Joint indices below 24, `[V][4]` flattened; unused slots name any joint with weight 0.
    pub skin_joints: &'a [u8],
    /// Weights of those joints, non-negative, summing to 1 per vertex, `[V][4]` flattened.
    pub skin_weights: &'a [f32],
    /// Painted colours, sRGB and opacity (ignored), `[V][4]` flattened; empty for a plain body. A
    /// body in two colours and their mixtures is drawn with a sharp edge between them, laid through
    /// the first surface that it gets.
    pub colors_srgba: &'a [u8],
}

/// How far from 1 a vertex's weights may sum: files store them rounded.
const WEIGHT_SUM_TOLERANCE: f32 = 2e-3;

impl BodyMesh<'_> {
    /// Number of vertices V.
    pub fn vertex_count(&self) -> usize {
        self.skin_joints.len() / 4
    }

    /// Lengths, index ranges and weights.
    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let n_vertices = self.vertex_count();
        if n_vertices == 0 || self.faces.is_empty() {
            return Err(RenderError::OutOfRange {
                what: "the number of vertices or faces",
                index: 0,
                value: 0.0,
                expected: "at least 1".into(),
            });
        }
        check::length("faces", self.faces.len(), self.faces.len() / 3 * 3)?;
        check::length("skin_joints", self.skin_joints.len(), n_vertices * 4)?;
        check::floats("skin_weights", self.skin_weights, n_vertices * 4)?;
        if !self.colors_srgba.is_empty() {
            check::length("colors_srgba", self.colors_srgba.len(), n_vertices * 4)?;
        }
        below(
            "faces",
            self.faces.iter().map(|&idx| idx as usize),
            n_vertices,
        )?;
        let joints = self.skin_joints.iter().map(|&joint| usize::from(joint));
        below("skin_joints", joints, JOINT_COUNT)?;
        self.validate_weights()
    }

    fn validate_weights(&self) -> Result<(), RenderError> {
        for (vertex, weights) in self.skin_weights.as_chunks::<4>().0.iter().enumerate() {
            let sum: f32 = weights.iter().sum();
            let negative = weights.iter().any(|&weight| weight < 0.0);
            if negative || (sum - 1.0).abs() > WEIGHT_SUM_TOLERANCE {
                return Err(RenderError::OutOfRange {
                    what: "the sum of a vertex's skin_weights",
                    index: vertex,
                    value: f64::from(sum),
                    expected: "non-negative weights that sum to 1".into(),
                });
            }
        }
        Ok(())
    }

    /// The joint that weighs most on each vertex.
    pub(crate) fn dominant_joints(&self) -> Vec<u8> {
        let joints = self.skin_joints.as_chunks::<4>().0;
        let weights = self.skin_weights.as_chunks::<4>().0;
        let heaviest =
            |weights: &[f32; 4]| (1..4).fold(0, |a, b| if weights[b] > weights[a] { b } else { a });
        joints
            .iter()
            .zip(weights)
            .map(|(joints, weights)| joints[heaviest(weights)])
            .collect()
    }
}

fn below(
    what: &'static str,
    mut values: impl Iterator<Item = usize>,
    end: usize,
) -> Result<(), RenderError> {
    let mut values = values.by_ref().enumerate();
    match values.find(|&(_, value)| value >= end) {
        None => Ok(()),
        Some((index, value)) => Err(RenderError::OutOfRange {
            what,
            index,
            value: value as f64,
            expected: format!("below {end}"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESH: BodyMesh<'static> = BodyMesh {
        faces: &[0, 1, 2],
        skin_joints: &[0, 0, 0, 0, 1, 2, 0, 0, 23, 0, 0, 0],
        skin_weights: &[1.0, 0.0, 0.0, 0.0, 0.4, 0.6, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        colors_srgba: &[],
    };

    #[test]
    fn a_sound_mesh_passes_and_knows_its_heaviest_joints() {
        MESH.validate().unwrap();
        assert_eq!(MESH.dominant_joints(), [0, 2, 23]);
    }

    #[test]
    fn each_kind_of_nonsense_is_refused() {
        let wrong_length = |mesh: BodyMesh<'_>, name: &str| match mesh.validate() {
            Err(RenderError::WrongLength { what, .. }) => assert_eq!(what, name),
            other => panic!("{name}: {other:?}"),
        };
        wrong_length(
            BodyMesh {
                faces: &[0, 1, 2, 0],
                ..MESH
            },
            "faces",
        );
        wrong_length(
            BodyMesh {
                skin_joints: &[0; 13],
                ..MESH
            },
            "skin_joints",
        );
        wrong_length(
            BodyMesh {
                skin_weights: &[1.0; 4],
                ..MESH
            },
            "skin_weights",
        );
        wrong_length(
            BodyMesh {
                colors_srgba: &[0; 4],
                ..MESH
            },
            "colors_srgba",
        );

        let out_of_range = |mesh: BodyMesh<'_>| {
            let refused = mesh.validate();
            assert!(
                matches!(refused, Err(RenderError::OutOfRange { .. })),
                "{refused:?}"
            );
        };
        out_of_range(BodyMesh {
            faces: &[0, 1, 3],
            ..MESH
        });
        out_of_range(BodyMesh { faces: &[], ..MESH });
        out_of_range(BodyMesh {
            skin_joints: &[24; 12],
            ..MESH
        });
        out_of_range(BodyMesh {
            skin_weights: &[0.3; 12],
            ..MESH
        });

        let nan = BodyMesh {
            skin_weights: &[f32::NAN; 12],
            ..MESH
        };
        assert!(matches!(
            nan.validate(),
            Err(RenderError::NonFinite { index: 0, .. })
        ));
    }
}
