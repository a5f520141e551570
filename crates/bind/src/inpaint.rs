//! Fills in uncertain correspondences from their neighbours.
//!
//! As Abdrashitov, Raichstat, Monsen and Hill do with skinning weights ("Robust skin weights transfer via
//! weight inpainting", 2023), but with the vector from a vertex to its point on the body and with a
//! Laplacian: one factorisation of a sparse matrix, and four right-hand sides.

use faer::linalg::solvers::Solve as _;
use faer::prelude::Mat;
use faer::sparse::{SparseColMat, Triplet};
use glam::Vec3;

use crate::BindError;
use crate::correspond::{Link, Places};
use crate::skin::Skin;

/// Weight of what was found, though not for sure, over the sum of the weights of a vertex's neighbours.
const UNSURE: f64 = 0.02;
/// Edges shorter than this weigh no more, metres.
const SHORTEST_M: f64 = 1e-3;

/// Moves the places of links that are not sure to where their neighbours' lead.
///
/// # Errors
/// [`BindError::NoFit`] where the equations cannot be solved.
pub fn fill(skin: &Skin, places: &Places<'_>, links: &mut [Option<Link>]) -> Result<(), BindError> {
    let unknown: Vec<usize> = (0..links.len())
        .filter(|vertex| links[*vertex].is_some_and(|link| !link.is_sure))
        .collect();
    if unknown.is_empty() {
        return Ok(());
    }
    let mut number: Vec<Option<usize>> = vec![None; links.len()];
    for (row, vertex) in unknown.iter().enumerate() {
        number[*vertex] = Some(row);
    }
    let (matrix, right) = equations(skin, places, links, &unknown, &number);
    let failed = |_| BindError::NoFit("places could not be filled in between meshes");
    let matrix =
        SparseColMat::<usize, f64>::try_new_from_triplets(unknown.len(), unknown.len(), &matrix)
            .map_err(|_| failed(()))?;
    let factor = matrix
        .sp_cholesky(faer::Side::Lower)
        .map_err(|_| failed(()))?;
    let solution = factor.solve(&right);
    for (row, vertex) in unknown.iter().enumerate() {
        let way = Vec3::new(
            solution[(row, 0)] as f32,
            solution[(row, 1)] as f32,
            solution[(row, 2)] as f32,
        );
        let target_m = skin.positions_m[*vertex] + way;
        let at = places.closest(target_m, &skin.parts[*vertex], None);
        links[*vertex] = at.map(|at| Link {
            at,
            distance_m: skin.positions_m[*vertex].distance(places.position_m(&at)),
            strength: (solution[(row, 3)] as f32).clamp(0.0, 1.0),
            is_sure: false,
        });
    }
    Ok(())
}

/// The ways and strengths of neighbours are alike, weighted by one over the edge's length; what was
/// found counts a little.
fn equations(
    skin: &Skin,
    places: &Places<'_>,
    links: &[Option<Link>],
    unknown: &[usize],
    number: &[Option<usize>],
) -> (Vec<Triplet<usize, usize, f64>>, Mat<f64>) {
    let values = |vertex: usize, link: &Link| {
        let way = places.position_m(&link.at) - skin.positions_m[vertex];
        [way.x, way.y, way.z, link.strength].map(f64::from)
    };
    let mut matrix = Vec::with_capacity(8 * unknown.len());
    let mut right = Mat::<f64>::zeros(unknown.len(), 4);
    for (row, vertex) in unknown.iter().enumerate() {
        let mut total = 0.0;
        for neighbour in skin.around(*vertex) {
            let neighbour = *neighbour as usize;
            let Some(link) = &links[neighbour] else {
                continue;
            };
            let edge_m = skin.positions_m[*vertex].distance(skin.positions_m[neighbour]);
            let weight = 1.0 / f64::from(edge_m).max(SHORTEST_M);
            total += weight;
            match number[neighbour] {
                Some(column) => matrix.push(Triplet::new(row, column, -weight)),
                None => {
                    for (column, value) in values(neighbour, link).into_iter().enumerate() {
                        right[(row, column)] += weight * value;
                    }
                }
            }
        }
        let own = if total > 0.0 { UNSURE * total } else { 1.0 };
        matrix.push(Triplet::new(row, row, total + own));
        if let Some(link) = &links[*vertex] {
            for (column, value) in values(*vertex, link).into_iter().enumerate() {
                right[(row, column)] += own * value;
            }
        }
    }
    (matrix, right)
}
