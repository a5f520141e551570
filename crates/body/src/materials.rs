//! What the tissue of each soft region is made of, relative to the usual.

use serde::{Deserialize, Serialize};

use crate::REGION_COUNT;

/// Factors on what a body's tissue is made of, in [`crate::Region::ALL`]'s order; 1 is the usual
/// tissue. The simulator multiplies its materials by them, and networks can take them as input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Materials {
    /// Of the shear modulus and with it of the skin's stiffness; the frequency goes with its root.
    pub stiffness: [f32; REGION_COUNT],
    /// Of the damping ratio.
    pub damping: [f32; REGION_COUNT],
}

impl Default for Materials {
    fn default() -> Self {
        Self::NOMINAL
    }
}

impl Materials {
    /// The usual material everywhere.
    pub const NOMINAL: Self = Self {
        stiffness: [1.0; REGION_COUNT],
        damping: [1.0; REGION_COUNT],
    };

    /// Whether every factor is 1.
    pub fn is_nominal(&self) -> bool {
        *self == Self::NOMINAL
    }
}
