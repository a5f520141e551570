//! Fits the body model to mesh sequences that have its topology.
//!
//! Casas & Otaduy (2018), Eqs. 4-5, and DSNet (2021), Eq. 5: shape coefficients β from the first
//! frame, joint rotations θ and root translation of every frame by least squares with rigidity
//! weights in the *unposed* state. The places of the joints are fitted to frames of many poses before. Then the offsets of the soft tissue, `Δ = unpose(S) - (T +
//! M_S(β) + M_P(θ))`, in metres in the rest pose.
//!
//! [`Scans`] reads sequences, [`SequenceFit`] fits them frame by frame and writes an AMASS-like `.npz`,
//! [`ClipBuilder`] makes a clip that `dynaskin train` takes; [`fit_sequence`] holds all of a sequence.
//! [`check_fit`] measures all of it on
//! simulated sequences whose truth is known.

mod check;
mod correctives;
mod error;
mod joints;
mod output;
mod people;
mod problem;
mod rigidity;
mod scans;
mod sequence;
mod solve;
mod start;
mod twists;

pub use check::{Case, CaseReport, CheckOptions, check_fit};
pub use error::FitError;
pub use joints::{JointFrames, Joints};
pub use output::ClipBuilder;
pub use people::{Capture, REST_DEGREES, captures, holds_meshes, nearest_to_rest, turned_degrees};
pub use problem::Objective;
pub use rigidity::Rigidity;
pub use scans::{MeshKind, ScanOptions, ScanUnit, Scans, Sequence, is_hdf5, sequences};
pub use sequence::{FitOptions, FittedFrame, FittedSequence, SequenceFit, fit_sequence};
