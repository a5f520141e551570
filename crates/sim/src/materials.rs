//! Material multipliers per region: how much stiffer or more damped a clip's tissue is than usual.

use dynaskin_body::{Materials, REGION_COUNT};
use sha2::{Digest as _, Sha256};

use crate::settings::SimSettings;

/// Range of multipliers that can be simulated with the usual time step.
pub const MULTIPLIERS: std::ops::RangeInclusive<f32> = 0.25..=4.0;
/// Multipliers are drawn evenly on a logarithmic scale between one over these and these.
const DRAWN_STIFFNESS: f32 = 4.0;
const DRAWN_DAMPING: f32 = 4.0;

/// Whether every multiplier lies in [`MULTIPLIERS`] (clips come from files).
pub(crate) fn can_be_simulated(materials: &Materials) -> bool {
    let all = materials.stiffness.iter().chain(&materials.damping);
    all.into_iter().all(|value| MULTIPLIERS.contains(value))
}

/// Multipliers of stiffness and damping, drawn for each region between a quarter and four. They depend only on
/// name and seed.
pub fn drawn_materials(name: &str, seed: u64) -> Materials {
    let digest = Sha256::new()
        .chain_update(b"materials")
        .chain_update(seed.to_le_bytes())
        .chain_update(name.as_bytes())
        .finalize();
    // Two bytes a number: 12 of the 32.
    let drawn = |index: usize, most: f32| {
        let bytes = [digest[2 * index], digest[2 * index + 1]];
        let even = f32::from(u16::from_le_bytes(bytes)) / f32::from(u16::MAX);
        most.powf(2.0 * even - 1.0)
    };
    Materials {
        stiffness: std::array::from_fn(|region| drawn(region, DRAWN_STIFFNESS)),
        damping: std::array::from_fn(|region| drawn(REGION_COUNT + region, DRAWN_DAMPING)),
    }
}

impl SimSettings {
    /// These settings with every region's material multiplied.
    #[must_use]
    pub fn with_materials(&self, materials: &Materials) -> Self {
        let mut settings = self.clone();
        for (region, tissue) in settings.tissues.iter_mut().enumerate() {
            tissue.shear_modulus_pa *= materials.stiffness[region];
            tissue.skin_n_per_m *= materials.stiffness[region];
            tissue.damping_ratio *= materials.damping[region];
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_multipliers_spread_around_one_and_repeat() {
        let mut logs = Vec::new();
        for clip in 0..200 {
            let drawn = drawn_materials(&format!("clip{clip}"), 1);
            assert_eq!(drawn, drawn_materials(&format!("clip{clip}"), 1));
            assert!(can_be_simulated(&drawn) && !drawn.is_nominal());
            logs.extend(drawn.stiffness.map(|x| x.log2()));
        }
        let mean = logs.iter().sum::<f32>() / logs.len() as f32;
        let most = logs.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        assert!(
            mean.abs() < 0.1 && (1.9..=2.0).contains(&most),
            "{mean} {most}"
        );
    }
}
