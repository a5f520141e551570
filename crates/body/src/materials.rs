//! Stiffness and damping of each soft region's tissue, relative to the usual.

use serde::{Deserialize, Serialize};

use crate::REGION_COUNT;

/// Factors on the materials of a body's tissue, in [`crate::Region::ALL`]'s order; 1 is the usual
/// tissue. The simulator multiplies its materials by them, and networks can take them as input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Materials {
    /// Factor on the shear modulus and the skin's stiffness; the frequency grows with its square root.
    pub stiffness: [f32; REGION_COUNT],
    /// Factor on the damping ratio.
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
