//! Simulator settings and material presets per soft region.

use dynaskin_body::{REGION_COUNT, Region};
use serde::{Deserialize, Serialize};

/// Everything besides body, shape and motion that decides a simulation's result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimSettings {
    /// Time steps per 60 Hz tick.
    pub substeps: u32,
    /// Layers of elements between skin and bone.
    pub layers: u32,
    /// Vertices whose region weights sum to more than this move.
    pub softness_threshold: f32,
    /// Least and largest depth of the tissue in metres.
    pub depth_limits_m: [f32; 2],
    /// Material of each region, in [`Region::ALL`]'s order.
    pub tissues: [Tissue; REGION_COUNT],
    /// How many times stiffer tissue gets where region weights fade to 0.
    pub edge_stiffening: f32,
    /// Mass density in kg/m³.
    pub density_kg_per_m3: f32,
    /// Ratio of the volume term's modulus to the shear modulus; see [`crate::Shell`].
    pub bulk_ratio: f32,
    /// Strain stiffening: the shear modulus grows by this factor per unit of `tr(FᵀF) - 3`.
    pub stiffening: f32,
    /// Mass of the skin in kg/m², added at the surface.
    pub skin_kg_per_m2: f32,
    /// Growth of the skin's stiffness per unit of area strain.
    pub skin_stiffening: f32,
    /// Viscosity as a relaxation time in seconds: damps only what is much faster than the tissue's
    /// own frequency.
    pub relaxation_seconds: f32,
    /// Largest product of a node's frequency (rad/s) and the time step; nodes above it get mass.
    pub stability_limit: f32,
    /// Acceleration in m/s² that the drive saturates at, see [`crate::soft_clip`].
    pub drive_limit_m_per_s2: f32,
}

/// Material of one soft region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tissue {
    /// Shear modulus in pascals where the tissue is no deeper than `reference_depth_m`.
    pub shear_modulus_pa: f32,
    /// Depth in metres above which tissue is stiffer: deep fat is held by septa and muscle.
    pub reference_depth_m: f32,
    /// Power of `depth / reference_depth_m` that the modulus grows with.
    pub depth_exponent: f32,
    /// Ratio of critical damping at the local frequency `sqrt(G/rho)/(4h)`.
    pub damping_ratio: f32,
    /// Skin modulus times thickness, in N/m.
    pub skin_n_per_m: f32,
}

impl Tissue {
    /// Shear modulus in pascals at a depth in metres.
    pub fn shear_modulus_at_pa(&self, depth_m: f32) -> f32 {
        let ratio = (depth_m / self.reference_depth_m).max(1.0);
        self.shear_modulus_pa * ratio.powf(self.depth_exponent)
    }
}

impl Default for SimSettings {
    fn default() -> Self {
        Self {
            substeps: 24,
            layers: 2,
            softness_threshold: 0.05,
            depth_limits_m: [0.006, 0.09],
            tissues: Region::ALL.map(tissue),
            edge_stiffening: 4.0,
            density_kg_per_m3: 950.0,
            bulk_ratio: 8.0,
            stiffening: 0.5,
            skin_kg_per_m2: 1.6,
            skin_stiffening: 8.0,
            relaxation_seconds: 8e-4,
            stability_limit: 0.7,
            drive_limit_m_per_s2: 40.0,
        }
    }
}

/// Presets after the measured values that `tissue-physics` of the guide lists: fat and muscle near
/// 0.75-1 kPa (magnetic resonance elastography), the breast far softer, stiffer with depth so that
/// a heavy belly does not swing by decimetres.
fn tissue(region: Region) -> Tissue {
    let firm = Tissue {
        shear_modulus_pa: 900.0,
        reference_depth_m: 0.028,
        depth_exponent: 1.2,
        damping_ratio: 0.3,
        skin_n_per_m: 18.0,
    };
    match region {
        Region::Chest => Tissue {
            shear_modulus_pa: 250.0,
            depth_exponent: 0.6,
            damping_ratio: 0.215,
            skin_n_per_m: 8.0,
            ..firm
        },
        Region::Belly => Tissue {
            damping_ratio: 0.28,
            ..firm
        },
        Region::Buttocks => Tissue {
            damping_ratio: 0.25,
            ..firm
        },
        Region::UpperArms => Tissue {
            damping_ratio: 0.25,
            ..firm
        },
        Region::Thighs | Region::Calves => firm,
    }
}
