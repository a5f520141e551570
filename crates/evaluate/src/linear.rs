//! The best that a linear decoder can represent.

use nalgebra::{DMatrix, DMatrixView};

/// A linear decoder as a matrix, for the error that remains with the best latents.
pub struct LinearDecoder {
    /// An orthonormal basis of what the decoder can give, `[coordinate][direction]`.
    range: DMatrix<f32>,
    /// The same, transposed.
    transposed: DMatrix<f32>,
}

impl LinearDecoder {
    /// From what the decoder gives for each unit latent, `[latent][coordinate]` flat.
    pub fn new(unit_fields: Vec<f32>, latents: usize) -> Self {
        let coordinates = unit_fields.len() / latents.max(1);
        let columns = DMatrix::from_vec(coordinates, latents, unit_fields);
        let range = columns.qr().q();
        Self {
            transposed: range.transpose(),
            range,
        }
    }

    /// For each frame of offsets the nearest field that the decoder can give.
    pub(crate) fn nearest(&self, offsets: &[f32]) -> Vec<f32> {
        let frames = offsets.len() / self.range.nrows().max(1);
        let columns = DMatrixView::from_slice(offsets, self.range.nrows(), frames);
        let latents = &self.transposed * columns;
        (&self.range * latents).as_slice().to_vec()
    }
}
