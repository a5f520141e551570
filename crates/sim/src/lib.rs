//! The soft-tissue simulator of dynaskin and the data set it writes.
//!
//! A shell of tetrahedra lies between the skin and the bones ([`Shell`]). A [`Solver`] moves it by
//! the inertia of a motion, and [`simulate_clip`] turns a whole motion into a [`ClipData`]: offsets
//! of the soft vertices in the rest pose, at 60 Hz, that need no pose later than their own.

mod calibration;
mod compliance;
mod contact;
mod dataset;
mod elastic;
mod kinematics;
mod materials;
mod nearby;
mod run;
mod settings;
mod shell;
mod simulate;
mod solver;

pub use calibration::{
    Activity, Amplitude, Calibration, LargestOffset, MEASURED, Measured, Moved, Quantity, Ringing,
    Survey, Vibration, amplitudes, free_vibration,
};
pub use compliance::{
    COMPLIANCE_COUNT, ComplianceError, ComplianceRow, ComplianceTable, TURNS, TableError,
    compliance_m,
};
pub use dataset::{ClipData, ClipHeader, DatasetError};
pub use dynaskin_body::Materials;
pub use materials::{MULTIPLIERS, drawn_materials};
pub use run::{
    CollarHabit, DRAWN_SHAPES, HELD_OUT_SHAPES, HeldPoses, Job, JobReport, Motion, Outcome,
    PoseMovement, RigHabit, Run, RunError, TRAINING_SHAPES, captures, drawn_shape, execute,
    held_poses, procedurals, thin_captures,
};
pub use settings::{SettingsError, SimSettings, Tissue};
pub use shell::{Shell, ShellError, ShellReport, Surface, soft_vertices};
pub use simulate::{ClipLabels, SimError, Simulated, simulate_clip};
pub use solver::{Solver, Unstable};
