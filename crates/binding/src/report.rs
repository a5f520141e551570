//! What binding found: bones, shape, how closely the body fits, what stays still and why.

use serde::{Deserialize, Serialize};

/// What is measured of an avatar where it rests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proportions {
    /// From the crown to the height of the shoulder joints, over the stature.
    pub crown_to_shoulder: f64,
    /// Height of the hip joints above the soles, over the stature.
    pub hip_height: f64,
    /// Stature in metres; none where the file has a unit of its own.
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
    /// Share of the skin's vertices within 2 cm of the fitted body; head, hands, feet and what belongs to
    /// nobody left out.
    pub share_close: f32,
    /// The same before the body is drawn smoothly to loose skin.
    pub share_close_bare: f32,
    /// Median distance of these vertices from the body as it was before that, metres.
    pub median_m: f32,
    /// Vertices of all meshes.
    pub vertices: u32,
    /// How many of them move.
    pub moving: u32,
    /// Each mesh.
    pub meshes: Vec<MeshReport>,
    /// The regions that stay still.
    pub regions_off: Vec<RegionOff>,
    /// Bones that move breasts or buttocks by themselves: they and the tissue move the same skin twice.
    pub double_motion: Vec<String>,
    /// What was found other than usual: a sentence each.
    pub notes: Vec<String>,
}
