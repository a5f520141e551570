//! Levenberg-Marquardt on the normal equations.
//!
//! The `levenberg-marquardt` crate factors the dense Jacobian, 20,670 rows by 85 columns for SMPL's
//! mesh, anew in every step, and knows no robust loss. A vertex depends on a third of the columns,
//! so summing the normal equations row by row is several times cheaper; nalgebra solves them.

use nalgebra::DMatrix;

use crate::problem::{Estimate, Problem};

/// Damping relative to the diagonal at the start of a solve.
const FIRST_DAMPING: f64 = 1e-4;
/// Above this damping no step lowers the cost any more.
const LAST_DAMPING: f64 = 1e8;
/// Part of the mean diagonal that is added everywhere, so that joints that move no vertex with
/// weight stay where they are.
const FLOOR: f64 = 1e-9;
/// A step that lowers the cost by less than this part ends the solve.
const ENOUGH: f64 = 1e-7;
/// RMS residual in metres below which only the rounding of single precision is left.
const EXACT_M: f64 = 3e-7;

/// Lowers the problem's cost from `start` by at most `max_steps` steps.
pub(crate) fn solve(problem: &Problem<'_>, start: Estimate, max_steps: usize) -> Estimate {
    let mut cost = problem.cost(&start);
    let mut estimate = start;
    let exact = EXACT_M * EXACT_M * problem.weights.iter().sum::<f64>();
    let mut damping = FIRST_DAMPING;
    for _ in 0..max_steps {
        let normal = problem.normal(&estimate);
        let mut stepped = false;
        let mut change = 0.0;
        while !stepped && damping < LAST_DAMPING {
            let tried = damped(&normal.hessian, damping)
                .cholesky()
                .map(|factors| -factors.solve(&normal.gradient))
                .filter(|step| step.iter().all(|x| x.is_finite()))
                .map(|step| estimate.moved(problem.body, &step));
            let lower = tried.and_then(|tried| {
                let tried_cost = problem.cost(&tried);
                (tried_cost < cost).then_some((tried, tried_cost))
            });
            if let Some((better, better_cost)) = lower {
                change = cost - better_cost;
                (estimate, cost) = (better, better_cost);
                damping = (damping * 0.1).max(1e-9);
                stepped = true;
            } else {
                damping *= 10.0;
            }
        }
        if !stepped || change <= ENOUGH * cost || cost <= exact {
            break;
        }
    }
    estimate
}

fn damped(hessian: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let mut damped = hessian.clone();
    let floor = FLOOR * hessian.trace() / hessian.nrows() as f64;
    for i in 0..damped.nrows() {
        damped[(i, i)] += damping * hessian[(i, i)] + floor;
    }
    damped
}
