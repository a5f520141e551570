//! A decoder's matrix as callers hand it in, and its checks.

use crate::DecodingError;
use crate::error::{floats, length};

/// A decoder that is a product with a matrix, most of which is zero, and the mesh that it moves.
///
/// # Shapes
///
/// For V vertices of which S are soft, F faces, W weights and L latents.
#[derive(Clone, Copy, Debug)]
pub struct DecoderMatrix<'a> {
    /// V.
    pub vertex_count: usize,
    /// Vertex indices, `[F][3]` flattened, as those of the bodies.
    pub faces: &'a [u32],
    /// The vertices that move, ascending, `[S]`.
    pub soft_vertices: &'a [u32],
    /// `[S + 1]`: soft vertex `i` has the weights from number `starts[i]` up to `starts[i + 1]`.
    pub starts: &'a [u32],
    /// Of each weight, the latent that it is multiplied with, `[W]`.
    pub latents: &'a [u32],
    /// Along x, y and z, metres per unit of the latent, `[W][3]` flattened.
    pub weights_m: &'a [f32],
    /// L.
    pub latent_count: usize,
}

impl DecoderMatrix<'_> {
    /// # Errors
    ///
    /// Wrong lengths or indices, numbers that are not finite.
    pub(crate) fn validate(&self) -> Result<(), DecodingError> {
        let weight_count = self.latents.len();
        length("starts", self.starts.len(), self.soft_vertices.len() + 1)?;
        floats("weights", self.weights_m, 3 * weight_count)?;
        length("faces", self.faces.len(), self.faces.len() / 3 * 3)?;
        below("faces", self.faces, self.vertex_count)?;
        below("soft vertices", self.soft_vertices, self.vertex_count)?;
        below("latents of the weights", self.latents, self.latent_count)?;
        ascending("soft vertices", self.soft_vertices, 1)?;
        ascending("starts", self.starts, 0)?;
        let ends = [self.starts.first(), self.starts.last()].map(|end| end.copied());
        if ends != [Some(0), u32::try_from(weight_count).ok()] {
            return Err(DecodingError::OutOfRange {
                what: "the last of the starts",
                index: self.starts.len().saturating_sub(1),
                value: ends[1].unwrap_or_default(),
                expected: format!("0 to begin with, and the {weight_count} weights at the end"),
            });
        }
        Ok(())
    }
}

pub(crate) fn below(
    what: &'static str,
    indices: &[u32],
    limit: usize,
) -> Result<(), DecodingError> {
    match indices.iter().position(|&index| index as usize >= limit) {
        None => Ok(()),
        Some(index) => Err(DecodingError::OutOfRange {
            what,
            index,
            value: indices[index],
            expected: format!("below {limit}"),
        }),
    }
}

/// Each of `numbers` is at least `step` more than the one before.
fn ascending(what: &'static str, numbers: &[u32], step: u32) -> Result<(), DecodingError> {
    let falls = |pair: &[u32]| pair[1] < pair[0].saturating_add(step);
    match numbers.windows(2).position(falls) {
        None => Ok(()),
        Some(before) => Err(DecodingError::OutOfRange {
            what,
            index: before + 1,
            value: numbers[before + 1],
            expected: format!("at least {}", u64::from(numbers[before]) + u64::from(step)),
        }),
    }
}
