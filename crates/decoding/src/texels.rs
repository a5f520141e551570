//! Tables and numbers of bodies, as they lie in textures: rows of [`WIDTH`] texels, the last one filled up with
//! zeros.

use crate::error::floats;
use crate::matrix::below;
use crate::{DecoderMatrix, DecodingError, WIDTH};

/// The tables that all bodies of a decoder share (`shader/decode.wgsl`).
#[derive(Clone, Debug, PartialEq)]
pub struct Tables {
    /// Per vertex: its first weight and the end of its weights, its first pair of corners and their end.
    pub vertices: Vec<[u32; 4]>,
    /// Along x, y and z, metres per unit of a latent; the fourth number is the latent.
    pub weights: Vec<[f32; 4]>,
    /// The other two corners of each face of a vertex, in order.
    pub corners: Vec<[u32; 2]>,
}

impl Tables {
    /// # Errors
    ///
    /// Wrong lengths or indices, numbers that are not finite.
    pub fn new(matrix: &DecoderMatrix<'_>) -> Result<Self, DecodingError> {
        matrix.validate()?;
        let mut vertices = vec![[0_u32; 4]; matrix.vertex_count];
        let ranges = matrix.starts.windows(2);
        for (&vertex, range) in matrix.soft_vertices.iter().zip(ranges) {
            vertices[vertex as usize][..2].copy_from_slice(range);
        }
        let faces = matrix.faces.as_chunks::<3>().0;
        let mut others = vec![Vec::new(); matrix.vertex_count];
        for &[a, b, c] in faces {
            for [own, first, second] in [[a, b, c], [b, c, a], [c, a, b]] {
                others[own as usize].push([first, second]);
            }
        }
        let mut end = 0;
        for (lists, others) in vertices.iter_mut().zip(&others) {
            lists[2] = end;
            end += others.len() as u32;
            lists[3] = end;
        }
        let weights = matrix.weights_m.as_chunks::<3>().0.iter();
        let weights = weights.zip(matrix.latents);
        Ok(Self {
            vertices: whole_rows(vertices),
            weights: whole_rows(
                weights
                    .map(|([x, y, z], latent)| [*x, *y, *z, *latent as f32])
                    .collect(),
            ),
            corners: whole_rows(others.concat()),
        })
    }
}

/// What one body is decoded from besides its latents.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTexels {
    /// Per vertex, without offsets, metres; the fourth number is not used.
    pub still_positions: Vec<[f32; 4]>,
    /// Per vertex: gain, and longest offset in metres; 0 where the skin is not soft.
    pub controls: Vec<[f32; 2]>,
}

impl BodyTexels {
    /// # Shapes
    ///
    /// For V vertices of which S are soft: `still_positions_m` `[V][3]` flattened, the others `[S]`.
    ///
    /// # Errors
    ///
    /// Wrong lengths or indices, numbers that are not finite.
    pub fn new(
        still_positions_m: &[f32],
        soft_vertices: &[u32],
        gains: &[f32],
        limits_m: &[f32],
    ) -> Result<Self, DecodingError> {
        let (points, []) = still_positions_m.as_chunks::<3>() else {
            return Err(DecodingError::WrongLength {
                what: "still positions",
                expected: still_positions_m.len() / 3 * 3,
                got: still_positions_m.len(),
            });
        };
        floats("still positions", still_positions_m, 3 * points.len())?;
        floats("gains", gains, soft_vertices.len())?;
        floats("limits", limits_m, soft_vertices.len())?;
        below("soft vertices", soft_vertices, points.len())?;
        let still_positions = points.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        let mut controls = vec![[0.0_f32; 2]; points.len()];
        let values = gains.iter().zip(limits_m);
        for (&vertex, (&gain, &limit_m)) in soft_vertices.iter().zip(values) {
            controls[vertex as usize] = [gain, limit_m];
        }
        Ok(Self {
            still_positions: whole_rows(still_positions),
            controls: whole_rows(controls),
        })
    }
}

/// The texels, filled up to whole rows of [`WIDTH`], one row at least.
fn whole_rows<T: bytemuck::Zeroable + Clone>(mut texels: Vec<T>) -> Vec<T> {
    let width = WIDTH as usize;
    let rows = texels.len().div_ceil(width).max(1);
    texels.resize(rows * width, T::zeroed());
    texels
}
