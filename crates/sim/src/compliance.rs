//! Compliance: how far tissue moves when gravity turns, which relates a body's shape to its swing.
//!
//! The thickness of tissue is not enough: a breast on a lean body can be as deep as one on a heavy body
//! and swing half as far, because the tissue that carries it is shorter. The static displacement of the
//! simulated tissue includes all that. Tissue that moves by u under an acceleration a responds like a spring
//! of angular frequency `sqrt(a / u)`. No motion is simulated, so a table over many shapes costs
//! little compared with a data set, and networks can be conditioned on shapes that no clip has.

mod table;

use std::f64::consts::{FRAC_PI_2, PI};

use dynaskin_body::{BodyModel, PARTS, Pose, REGION_COUNT, SHAPE_COUNT};
use glam::{DQuat, DVec3};

use crate::settings::SimSettings;
use crate::shell::{Shell, ShellError};
use crate::solver::{Solver, Unstable};
pub use table::{ComplianceRow, ComplianceTable, TableError};

/// Ways in which gravity is turned: upside down, onto the back, onto a side.
pub const TURNS: usize = 3;

/// Numbers that tell a body's compliance, `[region][part][turn]` flat.
pub const COMPLIANCE_COUNT: usize = REGION_COUNT * PARTS * TURNS;

/// Why the compliance of a shape is not known.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum ComplianceError {
    /// The body has no tissue to simulate.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// The shape's tissue finds no rest when gravity is turned: it is folded too much.
    #[error("the tissue of shape {shape:?} finds no rest: {source}")]
    NoRest {
        /// β.
        shape: [f32; SHAPE_COUNT],
        /// Where it went astray.
        source: Unstable,
    },
}

/// How far each part of each region of a body moves when gravity is turned upside down, onto its back
/// and onto its left side, in metres. It is the mean length of the offsets of the part's vertices,
/// with the usual materials.
/// [`COMPLIANCE_COUNT`] numbers, `[region][part][turn]` flat.
///
/// # Errors
/// [`ComplianceError`].
pub fn compliance_m(
    body: &BodyModel,
    shape: &[f32; SHAPE_COUNT],
    settings: &SimSettings,
) -> Result<Vec<f32>, ComplianceError> {
    let shell = Shell::for_body(body, shape, settings)?;
    let parts = body.region_parts();
    let turns = [
        DQuat::from_axis_angle(DVec3::Z, PI),
        DQuat::from_axis_angle(DVec3::X, -FRAC_PI_2),
        DQuat::from_axis_angle(DVec3::Z, FRAC_PI_2),
    ];
    let mut of_parts = vec![0.0; parts.len() * TURNS];
    for (turn, world_from_body) in turns.into_iter().enumerate() {
        let mut pose = Pose::REST;
        pose.parent_from_joint[0] = world_from_body;
        let mut solver = Solver::new(&shell, settings);
        let settled = solver.step(&pose);
        settled.map_err(|source| ComplianceError::NoRest {
            shape: *shape,
            source,
        })?;
        let lengths_m: Vec<f32> = solver.offsets_rest_m().map(|o| o.length()).collect();
        for (part, weights) in parts.iter().enumerate() {
            let moved = shell.vertices().iter().zip(&lengths_m);
            let moved = moved.map(|(vertex, length_m)| weights[*vertex as usize] * length_m);
            let weight: f32 = weights.iter().sum();
            of_parts[part * TURNS + turn] = moved.sum::<f32>() / weight.max(f32::MIN_POSITIVE);
        }
    }
    Ok(of_parts)
}
