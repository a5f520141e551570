//! Levenberg-Marquardt on the normal equations.
//!
//! The `levenberg-marquardt` crate factors the dense Jacobian, 20,670 rows by 85 columns for SMPL's
//! mesh, anew in every step, and knows no robust loss. Summing the normal equations over bones is many
//! times cheaper; nalgebra solves them.

use nalgebra::DMatrix;

use crate::problem::{Estimate, Problem};

/// Damping relative to the diagonal at the start of a solve.
const FIRST_DAMPING: f64 = 1e-4;
/// Above this damping no step lowers the cost any more.
const LAST_DAMPING: f64 = 1e8;
/// Part of the mean diagonal that is added everywhere, so that joints that move no vertex with
/// weight stay where they are.
const FLOOR: f64 = 1e-9;
/// RMS residual in metres below which only the rounding of single precision is left.
const EXACT_M: f64 = 3e-7;

/// Lowers the problem's cost from `start` by at most `max_steps` steps, until one lowers it by less than the
/// part `enough`, or would by the normal equations.
pub(crate) fn solve(
    problem: &Problem<'_>,
    start: Estimate,
    max_steps: usize,
    enough: f64,
) -> Estimate {
    let mut estimate = start;
    let mut normal = problem.normal(&estimate);
    let exact = EXACT_M * EXACT_M * problem.weight_sum();
    let mut damping = FIRST_DAMPING;
    for step in 1..=max_steps {
        let mut gained = None;
        while gained.is_none() && damping < LAST_DAMPING {
            let change = damped(&normal.hessian, damping)
                .cholesky()
                .map(|factors| -factors.solve(&normal.gradient))
                .filter(|step| step.iter().all(|x| x.is_finite()));
            if let Some(change) = change {
                let tried = estimate.moved(problem.body, &change);
                // Near the minimum the cost's single-precision rounding hides what a step gains; the
                // gradient still tells the direction.
                if normal.gain(&change) <= enough * normal.cost {
                    return tried;
                }
                // Most steps are taken, so cost and equations are summed at once. After the last step nobody
                // needs the equations.
                if step == max_steps {
                    if problem.cost(&tried) < normal.cost {
                        return tried;
                    }
                } else {
                    let next = problem.normal(&tried);
                    if next.cost < normal.cost {
                        gained = Some(normal.cost - next.cost);
                        (estimate, normal) = (tried, next);
                        damping = (damping * 0.1).max(1e-9);
                        continue;
                    }
                }
            }
            damping *= 10.0;
        }
        if gained.is_none_or(|gained| gained <= enough * normal.cost) || normal.cost <= exact {
            break;
        }
    }
    estimate
}

pub(crate) fn damped(hessian: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let mut damped = hessian.clone();
    let floor = FLOOR * hessian.trace() / hessian.nrows() as f64;
    for i in 0..damped.nrows() {
        damped[(i, i)] += damping * hessian[(i, i)] + floor;
    }
    damped
}
