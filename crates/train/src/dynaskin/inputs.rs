//! What the predictor takes as input.

use dynaskin_runtime::features::FeatureKind;

use super::build::Build;
use super::spin::{SPIN_COUNT, Spin};
use super::symmetry::{SignedPermutation, tied_scale};
use crate::normaliser::Normaliser;

/// What dynaskin's networks take as input.
pub const KIND: FeatureKind = FeatureKind::InertialMaterials;

/// Turns the runtime's features into the predictor's inputs.
#[derive(Clone, Debug)]
pub struct PredictorInputs {
    /// Scaling of the motion features.
    pub normaliser: Normaliser,
    /// Products of angular velocities.
    pub spin: Spin,
    /// What is told about the body.
    pub build: Build,
}

impl PredictorInputs {
    /// How many numbers are about the motion.
    pub const MOTION_COUNT: usize = KIND.motion_count() + SPIN_COUNT;

    /// Gives both sides of the body the same scales.
    pub(super) fn tie(&mut self) {
        let (features, spins) = (
            SignedPermutation::of_features(),
            SignedPermutation::of_spins(),
        );
        let scale = &mut self.normaliser.scale[..KIND.motion_count()];
        scale.copy_from_slice(&tied_scale(scale, &features));
        self.spin.scale = tied_scale(&self.spin.scale, &spins);
    }

    /// Motion of each frame, `[frame][number]` flat: the scaled features, then the products.
    pub fn motion(&self, features: &[f32]) -> Vec<f32> {
        let (normalised, _) = self.normaliser.apply(features);
        let frames = features.chunks_exact(KIND.count());
        let motion = frames.zip(normalised.chunks_exact(KIND.motion_count()));
        motion
            .flat_map(|(raw, scaled)| [scaled, &self.spin.of(raw)].concat())
            .collect()
    }
}
