//! What binding found: bones, shape, how closely the body fits, what stays still and why.

use serde::{Deserialize, Serialize};

/// Proportions of an avatar at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proportions {
    /// Distance from the crown to the height of the shoulder joints, relative to the stature.
    pub crown_to_shoulder: f64,
    /// Height of the hip joints above the soles, relative to the stature.
    pub hip_height: f64,
    /// Stature in metres; none if the file's unit is unknown.
    pub stature_m: Option<f64>,
}

/// Within this distance of the fitted body skin counts as close, metres.
pub const CLOSE_M: f32 = 0.02;

/// A region of tissue that stays still on an avatar.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionOff {
    /// The region's name.
    pub region: String,
    /// Why.
    pub reason: String,
}

/// A mesh of the avatar in the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshReport {
    /// The mesh's name.
    pub name: String,
    /// The material's name.
    pub material: String,
    /// Its vertices.
    pub vertices: u32,
    /// How many of them move.
    pub moving: u32,
}

/// What binding found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The body's joints and the avatar's bone that turns each.
    pub bones: Vec<(String, String)>,
    /// The body's joints that no bone turns; they follow their parents.
    pub missing: Vec<String>,
    /// What the proportions are.
    pub proportions: Proportions,
    /// Share of the skin's vertices within 2 cm of the fitted body; without head, hands, feet and vertices that
    /// belong to no part of a person.
    pub share_close: f32,
    /// The same without the drape.
    pub share_close_bare: f32,
    /// Median distance of these vertices from the body without the drape, metres.
    pub median_m: f32,
    /// Vertices of all meshes.
    pub vertices: u32,
    /// How many of them move.
    pub moving: u32,
    /// Each mesh.
    pub meshes: Vec<MeshReport>,
    /// The regions that stay still.
    pub regions_off: Vec<RegionOff>,
    /// Bones that already move breasts or buttocks, such as spring bones: with the tissue the same skin would
    /// move twice.
    pub double_motion: Vec<String>,
    /// Whatever is unusual: one sentence each.
    pub notes: Vec<String>,
}
