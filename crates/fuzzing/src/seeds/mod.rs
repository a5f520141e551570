//! Whole files to begin with, made here.

pub mod bodies;
pub mod bundles;
pub mod clips;
pub mod meshes;
pub mod motions;
pub mod networks;
