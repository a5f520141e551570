//! The soft regions of a body that users address by name.

use serde::{Deserialize, Serialize};

/// Number of soft regions.
pub const REGION_COUNT: usize = 6;

/// A soft region. Left and right are one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Region {
    /// Chest (breasts, pectorals).
    Chest,
    /// Abdomen and flanks.
    Belly,
    /// Buttocks.
    Buttocks,
    /// Thighs.
    Thighs,
    /// Calves.
    Calves,
    /// Upper arms.
    UpperArms,
}

impl Region {
    /// All regions, in index order.
    pub const ALL: [Self; REGION_COUNT] = [
        Self::Chest,
        Self::Belly,
        Self::Buttocks,
        Self::Thighs,
        Self::Calves,
        Self::UpperArms,
    ];

    /// Name as it stands in files and in the SDK: `chest`, `upper-arms`, ...
    pub const fn name(self) -> &'static str {
        match self {
            Self::Chest => "chest",
            Self::Belly => "belly",
            Self::Buttocks => "buttocks",
            Self::Thighs => "thighs",
            Self::Calves => "calves",
            Self::UpperArms => "upper-arms",
        }
    }
}
