//! What a host may turn: strength, root inertia, and per region gain, stiffness, damping, limit.

use dynaskin_body::{REGION_COUNT, Region};
use serde::{Deserialize, Serialize};

use crate::RuntimeError;
use crate::bundle::Learned;
use crate::features::Materials;

/// Upper limit for the length of any offset, in metres, for any networks and controls. It is the largest
/// limit that a region can be given, and that of bodies without regions.
pub const OFFSET_LIMIT_M: f32 = 0.20;

/// Default limits of the regions, in metres, in the order of [`Region::ALL`].
///
/// Offsets up to half of a limit do not change. Half of it is about what the region reaches at most in the
/// simulated training data with the usual tissue, both sexes, all shapes and motions: 92 mm (chest; 78 in 99
/// of 100 clips), 53 (belly), 54 (buttocks), 33 (thighs), 9 (calves) and 35 (upper arms). The whole limit
/// lies above what tissue of a quarter of the stiffness reaches, 159, 109, 102, 63, 23 and 49 mm. Poses that
/// no body takes would otherwise pull a calf or an arm as far as a chest.
pub const REGION_LIMITS_M: [f32; REGION_COUNT] = [0.17, 0.12, 0.12, 0.08, 0.03, 0.08];

/// Largest strength, region gain and root inertia.
pub const MAX_GAIN: f32 = 4.0;

/// Largest stiffness and damping of a region; the smallest is its inverse.
pub const MAX_RESPONSE: f32 = 10.0;

/// How the soft tissue of one region behaves, relative to what the networks predict.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RegionControls {
    /// Factor on the offsets, 0 to [`MAX_GAIN`].
    pub gain: f32,
    /// Factor on the tissue's stiffness, 1/[`MAX_RESPONSE`] to [`MAX_RESPONSE`]: 4 doubles the
    /// frequency at which the region swings, and quarters its displacement under gravity.
    pub stiffness: f32,
    /// Factor on the tissue's damping, in the same range: 2 halves the time for which it keeps swinging.
    pub damping: f32,
    /// Upper limit for the length of an offset, in metres: 0 to [`OFFSET_LIMIT_M`], by default that of
    /// [`REGION_LIMITS_M`]. Offsets up to half of it do not change; longer ones approach it smoothly.
    pub limit_m: f32,
}

/// All controls of one avatar. They may change while it moves. The default leaves everything as the
/// networks predict it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Controls {
    /// Factor on all offsets, 0 to [`MAX_GAIN`].
    pub strength: f32,
    /// Factor on the effect of the pelvis's acceleration through the world, 0 to
    /// [`MAX_GAIN`]: 0 removes the effect of jumps, lifts and vehicles and keeps that of limbs and trunk
    /// moving relative to the pelvis. Rotation about the pelvis always counts in full.
    pub root_inertia: f32,
    /// Per region, in the order of [`Region::ALL`].
    pub regions: [RegionControls; REGION_COUNT],
}

impl Default for Controls {
    fn default() -> Self {
        Self {
            strength: 1.0,
            root_inertia: 1.0,
            regions: REGION_LIMITS_M.map(|limit_m| RegionControls {
                gain: 1.0,
                stiffness: 1.0,
                damping: 1.0,
                limit_m,
            }),
        }
    }
}

impl Controls {
    /// Tissue under firm everyday clothes: held more tightly, at rest sooner, displaced by at most 2 cm,
    /// and shaken less by jumps and vehicles.
    pub fn calm_clothes() -> Self {
        let held = |gain: f32, stiffness: f32, limit_m: f32| RegionControls {
            gain,
            stiffness,
            damping: 2.0,
            limit_m,
        };
        let mut regions = [held(0.7, 1.5, 0.02); REGION_COUNT];
        // A bra and a waistband hold more than a sleeve or a trouser leg does.
        regions[Region::Chest as usize] = held(0.5, 2.5, 0.02);
        regions[Region::Belly as usize] = held(0.6, 2.0, 0.02);
        regions[Region::Buttocks as usize] = held(0.6, 2.0, 0.02);
        Self {
            strength: 1.0,
            root_inertia: 0.7,
            regions,
        }
    }

    /// Tissue under sportswear: a supported chest, which swings half as far and faster, and firmer
    /// hips and thighs. The rest moves as predicted.
    pub fn sportswear() -> Self {
        let mut controls = Self::default();
        let held = |gain: f32, stiffness: f32, damping: f32, limit_m: f32| RegionControls {
            gain,
            stiffness,
            damping,
            limit_m,
        };
        controls.regions[Region::Chest as usize] = held(0.5, 2.5, 1.6, 0.04);
        controls.regions[Region::Buttocks as usize] = held(0.8, 1.5, 1.3, 0.06);
        controls.regions[Region::Thighs as usize] = held(0.8, 1.5, 1.3, 0.06);
        controls
    }

    /// Whether every control can be used.
    ///
    /// # Errors
    /// [`RuntimeError::InvalidControl`], naming the first that cannot.
    pub fn check(&self) -> Result<(), RuntimeError> {
        in_range("the strength", self.strength, 0.0, MAX_GAIN)?;
        in_range("the root inertia", self.root_inertia, 0.0, MAX_GAIN)?;
        for (region, controls) in Region::ALL.into_iter().zip(&self.regions) {
            let of = |what: &str| format!("{what} of region {}", region.name());
            let least = 1.0 / MAX_RESPONSE;
            in_range(&of("the gain"), controls.gain, 0.0, MAX_GAIN)?;
            in_range(
                &of("the stiffness"),
                controls.stiffness,
                least,
                MAX_RESPONSE,
            )?;
            in_range(&of("the damping"), controls.damping, least, MAX_RESPONSE)?;
            in_range(
                &of("the limit in metres"),
                controls.limit_m,
                0.0,
                OFFSET_LIMIT_M,
            )?;
        }
        Ok(())
    }

    /// Shares stiffness and damping out between networks that have `learned` some of them and the
    /// filters after the networks.
    pub(crate) fn shares(&self, learned: &Learned) -> Shares {
        let mut shares = Shares {
            materials: Materials::default(),
            left: self.regions,
        };
        let clamped = |factor: f32, [least, most]: [f32; 2]| factor.max(least).min(most);
        for (index, left) in shares.left.iter_mut().enumerate() {
            let stiffness = clamped(left.stiffness, learned.stiffness);
            // The control says how fast a swing dies away, the material how that compares with how
            // fast it swings: at the same ratio stiffer tissue comes to rest sooner.
            let ratio = left.damping / stiffness.sqrt();
            let learned_ratio = clamped(ratio, learned.damping);
            shares.materials.stiffness[index] = stiffness;
            shares.materials.damping[index] = learned_ratio;
            // Exactly 1 where the networks know it all.
            left.stiffness /= stiffness;
            left.damping = ratio / learned_ratio;
        }
        shares
    }
}

/// Stiffness and damping shared out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    /// What the networks are told.
    pub materials: Materials,
    /// What is left to the filters of [`crate::tissue`].
    pub left: [RegionControls; REGION_COUNT],
}

impl Shares {
    /// Whether nothing is left.
    pub fn are_predicted(&self) -> bool {
        self.left
            .iter()
            .all(|region| region.stiffness == 1.0 && region.damping == 1.0)
    }
}

/// Refuses a control outside `least..=limit`; NaN is outside.
pub(crate) fn in_range(
    control: &str,
    got: f32,
    least: f32,
    limit: f32,
) -> Result<(), RuntimeError> {
    if (least..=limit).contains(&got) {
        Ok(())
    } else {
        Err(RuntimeError::InvalidControl {
            control: control.to_owned(),
            got,
            least,
            limit,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::FeatureKind;

    fn turned(stiffness: f32, damping: f32) -> Controls {
        let mut controls = Controls::default();
        (controls.regions[1].stiffness, controls.regions[1].damping) = (stiffness, damping);
        controls
    }

    #[test]
    fn what_the_networks_learned_is_left_to_them() {
        let learned = Learned::in_version_1(FeatureKind::InertialMaterials);
        let shares = turned(2.0, 1.2).shares(&learned);
        assert!(shares.are_predicted());
        assert_eq!(shares.materials.stiffness[1], 2.0);
        // The same decay at 1.41 times the frequency is a smaller damping ratio.
        assert_eq!(shares.materials.damping[1], 1.2 / 2.0_f32.sqrt());
        assert_eq!(shares.materials.stiffness[0], 1.0);
        let shares = turned(2.0, 1.2).shares(&Learned::USUAL);
        assert!(!shares.are_predicted());
        assert_eq!(shares.materials, Materials::default());
        assert_eq!(
            (shares.left[1].stiffness, shares.left[1].damping),
            (2.0, 1.2)
        );
    }

    #[test]
    fn what_is_beyond_is_left_to_the_filters_and_nothing_is_lost() {
        for (stiffness, damping) in [(8.0, 1.0), (0.1, 10.0), (1.0, 0.1)] {
            let learned = Learned::in_version_1(FeatureKind::InertialMaterials);
            let shares = turned(stiffness, damping).shares(&learned);
            let (material, left) = (shares.materials, shares.left[1]);
            let within = |[least, most]: [f32; 2], got: f32| least <= got && got <= most;
            assert!(within(learned.stiffness, material.stiffness[1]));
            assert!(within(learned.damping, material.damping[1]));
            assert!(!shares.are_predicted());
            let whole = material.stiffness[1] * left.stiffness;
            assert!((whole / stiffness - 1.0).abs() < 1e-6, "{whole}");
            // Decay goes with the damping ratio times the frequency.
            let decay = material.damping[1] * material.stiffness[1].sqrt() * left.damping;
            assert!((decay / damping - 1.0).abs() < 1e-6, "{decay}");
        }
    }
}
