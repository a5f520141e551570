//! Thins the closed base surface to SMPL's vertex count, symmetrically.
//!
//! Only vertices are removed, so morphs, weights and the mirror table carry over. The left half
//! is simplified with its midline and the vertices beside it locked, then mirrored; trunk and
//! limbs, where the tissue is, keep their full density.

use std::collections::HashMap;

use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter, simplify_with_locks};

use crate::error::BuildError;
use crate::source::Side;
use dynaskin_body::SMPL_VERTEX_COUNT;

/// The thinned surface: kept source vertices and triangles over them.
pub(super) struct Thinned {
    /// Source vertex of each kept vertex, ascending.
    pub kept: Vec<usize>,
    /// Triangles over the kept vertices.
    pub faces: Vec<[u32; 3]>,
    /// Mirror image of each kept vertex.
    pub mirror: Vec<usize>,
}

/// Thins `quads` to [`SMPL_VERTEX_COUNT`] vertices; `locked` vertices are kept.
pub(super) fn thin(
    positions_m: &[Vec3],
    quads: &[[usize; 4]],
    mirror: &[(usize, Side)],
    locked: &[bool],
) -> Result<Thinned, BuildError> {
    let half: Vec<u32> = quads
        .iter()
        .filter(|quad| quad.iter().any(|&v| mirror[v].1 == Side::Left))
        .flat_map(|&[a, b, c, d]| split_quad(positions_m, a, b, c, d))
        .map(|v| v as u32)
        .collect();
    // A closed surface of genus 0 has 2 V - 4 triangles; half of them lie on one side.
    let target_index_count = (SMPL_VERTEX_COUNT - 2) * 3;
    let adapter =
        VertexDataAdapter::new(bytemuck::cast_slice(positions_m), 12, 0).map_err(|error| {
            BuildError::Simplify {
                reason: error.to_string(),
            }
        })?;
    let simplified = simplify_with_locks(
        &half,
        &adapter,
        &with_midline(locked, quads, mirror),
        target_index_count,
        1.0,
        SimplifyOptions::LockBorder,
        None,
    );
    let mut triangles: Vec<[usize; 3]> = simplified
        .chunks_exact(3)
        .map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
        .collect();
    let mirrored: Vec<[usize; 3]> = triangles
        .iter()
        .map(|&[a, b, c]| [mirror[a].0, mirror[c].0, mirror[b].0])
        .collect();
    triangles.extend(mirrored);

    let mut kept: Vec<usize> = triangles.iter().flatten().copied().collect();
    kept.sort_unstable();
    kept.dedup();
    if kept.len() != SMPL_VERTEX_COUNT {
        return Err(BuildError::Simplify {
            reason: format!("{} vertices left, expected {SMPL_VERTEX_COUNT}", kept.len()),
        });
    }
    let index_of: HashMap<usize, usize> = kept.iter().enumerate().map(|(i, &v)| (v, i)).collect();
    let faces = triangles
        .iter()
        .map(|t| t.map(|v| index_of[&v] as u32))
        .collect();
    let mirror = kept.iter().map(|&v| index_of[&mirror[v].0]).collect();
    Ok(Thinned {
        kept,
        faces,
        mirror,
    })
}

/// `locked` and every vertex of a quad that touches the midline. Were the row beside the midline
/// free, a triangle could end up with all three corners on the midline and coincide with its own
/// mirror image.
fn with_midline(locked: &[bool], quads: &[[usize; 4]], mirror: &[(usize, Side)]) -> Vec<bool> {
    let mut locked = locked.to_vec();
    for quad in quads {
        if quad.iter().any(|&v| mirror[v].0 == v) {
            for &v in quad {
                locked[v] = true;
            }
        }
    }
    locked
}

/// Splits a quad along its shorter diagonal.
fn split_quad(positions_m: &[Vec3], a: usize, b: usize, c: usize, d: usize) -> [usize; 6] {
    let across = |i: usize, j: usize| positions_m[i].distance_squared(positions_m[j]);
    if across(a, c) <= across(b, d) {
        [a, b, c, a, c, d]
    } else {
        [a, b, d, b, c, d]
    }
}
