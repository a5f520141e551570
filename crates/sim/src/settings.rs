//! Simulator settings and material presets per soft region.

use dynaskin_body::{BodyModel, REGION_COUNT, Region, Sex};
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
    /// Least modulus of the volume term in pascals: tissue of any softness is nearly
    /// incompressible, and a soft breast would be crushed to a fold by its own weight in a landing.
    pub least_bulk_pa: f32,
    /// Strain stiffening: the shear modulus grows by this factor per unit of `tr(FᵀF) - 3`.
    pub stiffening: f32,
    /// Growth of damping with strain: by this factor per squared displacement over depth, which counts up
    /// to 1. Tissue that stiffens with strain loses more in each swing (Fung's quasi-linear
    /// viscoelasticity).
    pub damping_growth: f32,
    /// Mass of the skin in kg/m², added at the surface.
    pub skin_kg_per_m2: f32,
    /// Growth of the skin's stiffness per unit of area strain.
    pub skin_stiffening: f32,
    /// Viscosity as a relaxation time in seconds: damps only what is much faster than the tissue's
    /// own frequency.
    pub relaxation_seconds: f32,
    /// Largest product of a node's frequency (rad/s) and the time step; nodes above it get mass.
    pub stability_limit: f32,
    /// Whether tissue of different limbs presses on each other; left out of files where it does.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub contact: bool,
    /// Acceleration in m/s² that the drive saturates at, see [`dynaskin_skeleton::soft_clip`].
    pub drive_limit_m_per_s2: f32,
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
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

/// A setting that cannot be simulated with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("setting {name} is {got}, expected {low} to {high}")]
pub struct SettingsError {
    name: &'static str,
    got: f32,
    low: f32,
    high: f32,
}

impl SimSettings {
    /// The usual settings for a body: a male chest is muscle and its cover, not a breast.
    pub fn for_body(body: &BodyModel) -> Self {
        let mut settings = Self::default();
        if body.name == Sex::Male.name() {
            settings.tissues[Region::Chest as usize] = Tissue {
                shear_modulus_pa: 1100.0,
                depth_exponent: 1.2,
                ..tissue(Region::Belly)
            };
        }
        settings
    }

    /// Modulus of the volume term in pascals of tissue with this shear modulus.
    pub fn bulk_modulus_pa(&self, shear_pa: f32) -> f32 {
        (self.bulk_ratio * shear_pa).max(self.least_bulk_pa)
    }

    /// Whether every setting lies in a range that can be simulated (settings come from files).
    ///
    /// # Errors
    /// [`SettingsError`] names the first that does not.
    pub fn check(&self) -> Result<(), SettingsError> {
        let [least, most] = self.depth_limits_m;
        let mut checks = vec![
            ("substeps", self.substeps as f32, 1.0, 1000.0),
            ("layers", self.layers as f32, 1.0, 8.0),
            ("softness_threshold", self.softness_threshold, 0.0, 0.99),
            ("depth_limits_m[0]", least, 1e-3, 0.5),
            ("depth_limits_m[1]", most, least, 0.5),
            ("edge_stiffening", self.edge_stiffening, 0.0, 1e3),
            ("density_kg_per_m3", self.density_kg_per_m3, 100.0, 1e4),
            ("bulk_ratio", self.bulk_ratio, 1.0, 1e3),
            ("least_bulk_pa", self.least_bulk_pa, 0.0, 1e6),
            ("stiffening", self.stiffening, 0.0, 100.0),
            ("damping_growth", self.damping_growth, 0.0, 100.0),
            ("skin_kg_per_m2", self.skin_kg_per_m2, 0.0, 100.0),
            ("skin_stiffening", self.skin_stiffening, 0.0, 1e3),
            ("relaxation_seconds", self.relaxation_seconds, 0.0, 0.1),
            ("stability_limit", self.stability_limit, 0.01, 1e4),
            ("drive_limit_m_per_s2", self.drive_limit_m_per_s2, 1.0, 1e4),
        ];
        for tissue in &self.tissues {
            checks.extend([
                ("shear_modulus_pa", tissue.shear_modulus_pa, 1.0, 1e7),
                ("reference_depth_m", tissue.reference_depth_m, 1e-3, 1.0),
                ("depth_exponent", tissue.depth_exponent, 0.0, 4.0),
                ("damping_ratio", tissue.damping_ratio, 0.0, 10.0),
                ("skin_n_per_m", tissue.skin_n_per_m, 0.0, 1e5),
            ]);
        }
        for (name, got, low, high) in checks {
            // Written so that NaN fails.
            if !(low..=high).contains(&got) {
                return Err(SettingsError {
                    name,
                    got,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }
}

impl Default for SimSettings {
    fn default() -> Self {
        Self {
            substeps: 24,
            layers: 2,
            softness_threshold: 0.05,
            depth_limits_m: [0.009, 0.09],
            tissues: Region::ALL.map(tissue),
            edge_stiffening: 1.5,
            density_kg_per_m3: 950.0,
            bulk_ratio: 8.0,
            least_bulk_pa: 5000.0,
            stiffening: 1.0,
            damping_growth: 2.5,
            skin_kg_per_m2: 1.6,
            skin_stiffening: 3.0,
            relaxation_seconds: 3e-4,
            stability_limit: 1.2,
            contact: true,
            drive_limit_m_per_s2: 40.0,
        }
    }
}

/// Presets after the measured values that `tissue-physics` of the guide lists: fat and muscle near
/// 0.75-1 kPa (magnetic resonance elastography), the breast far softer, stiffer with depth so that
/// neither a heavy belly nor a large breast swings by decimetres. The damping ratios are above the
/// breast's measured 0.215 elsewhere, where none is measured: with less, hops leave a third of their
/// energy between 3 and 8 Hz, where a real body has a tenth.
fn tissue(region: Region) -> Tissue {
    let firm = Tissue {
        shear_modulus_pa: 900.0,
        reference_depth_m: 0.028,
        depth_exponent: 1.2,
        damping_ratio: 0.36,
        skin_n_per_m: 18.0,
    };
    match region {
        Region::Chest => Tissue {
            shear_modulus_pa: 180.0,
            reference_depth_m: 0.037,
            depth_exponent: 2.5,
            damping_ratio: 0.2,
            skin_n_per_m: 8.0,
        },
        Region::Belly => Tissue {
            depth_exponent: 0.7,
            ..firm
        },
        Region::Buttocks => Tissue {
            shear_modulus_pa: 1000.0,
            ..firm
        },
        Region::UpperArms => firm,
        // Muscle at work lies under little fat here.
        Region::Thighs | Region::Calves => Tissue {
            shear_modulus_pa: 2000.0,
            ..firm
        },
    }
}
