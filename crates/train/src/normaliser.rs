//! The scaling between features as the runtime gives them and what the network works on.

use dynaskin_body::{Pose, SHAPE_COUNT, ShapedBody};
use dynaskin_runtime::features::{FeatureKind, MotionFeatures};
use serde::{Deserialize, Serialize};

/// Below these deviations a feature counts as constant and is not blown up: in the features' own
/// units (m/s², rad/s, rad/s², 1), all far below what moves tissue.
const SMALLEST_MOTION_DEVIATION: f32 = 0.02;
const SMALLEST_CONDITION_DEVIATION: f32 = 0.1;

/// Offsets and scales of the features, from the training set.
///
/// Motion features are taken relative to their value at rest, not to their mean, so that a body
/// standing still in the rest pose is exactly zero input; materials relative to the usual ones; β
/// relative to its mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normaliser {
    /// Value that becomes 0, one a feature.
    pub origin: Vec<f32>,
    /// What the difference is multiplied with, one a feature.
    pub scale: Vec<f32>,
    /// How many features, the first ones, are about the motion.
    pub motion: usize,
}

impl Normaliser {
    /// From training features, `[frame][feature]` flat in several pieces, and a body whose rest
    /// pose gives the origin (which does not depend on its shape).
    pub fn fit<'a>(
        kind: FeatureKind,
        body: &ShapedBody,
        features: impl Iterator<Item = &'a [f32]> + Clone,
    ) -> Self {
        let count = kind.count();
        let motion = kind.motion_count();
        let mut origin = rest_features(kind, body);
        let frames: usize = features.clone().map(|f| f.len() / count).sum();
        let mut sum = vec![0.0f64; count];
        for frame in features.clone().flat_map(|f| f.chunks_exact(count)) {
            for (sum, x) in sum.iter_mut().zip(frame) {
                *sum += f64::from(*x);
            }
        }
        for feature in count - SHAPE_COUNT..count {
            origin[feature] = (sum[feature] / frames.max(1) as f64) as f32;
        }
        let mut squares = vec![0.0f64; count];
        for frame in features.flat_map(|f| f.chunks_exact(count)) {
            for feature in 0..count {
                squares[feature] += f64::from(frame[feature] - origin[feature]).powi(2);
            }
        }
        let scale = squares.iter().enumerate().map(|(feature, square)| {
            let deviation = (square / frames.max(1) as f64).sqrt() as f32;
            let smallest = if feature < motion {
                SMALLEST_MOTION_DEVIATION
            } else {
                SMALLEST_CONDITION_DEVIATION
            };
            1.0 / deviation.max(smallest)
        });
        Self {
            scale: scale.collect(),
            origin,
            motion,
        }
    }

    /// Normalised features, `[frame][feature]` flat, split into motion and condition.
    pub fn apply(&self, features: &[f32]) -> (Vec<f32>, Vec<f32>) {
        let count = self.origin.len();
        let motion_count = self.motion;
        let frames = features.len() / count;
        let mut motion = Vec::with_capacity(frames * motion_count);
        let mut condition = Vec::with_capacity(frames * (count - motion_count));
        for frame in features.chunks_exact(count) {
            let scaled = (0..count).map(|i| (frame[i] - self.origin[i]) * self.scale[i]);
            motion.extend(scaled.clone().take(motion_count));
            condition.extend(scaled.skip(motion_count));
        }
        (motion, condition)
    }
}

/// Features of a body that has stood in the rest pose for a while.
pub fn rest_features(kind: FeatureKind, body: &ShapedBody) -> Vec<f32> {
    let mut features = MotionFeatures::new(kind, &body.joints_m, &[0.0; SHAPE_COUNT]);
    for _ in 0..3 {
        features.push(&Pose::REST);
    }
    features.push(&Pose::REST).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn rest_is_zero_and_training_data_have_unit_deviation() {
        let body = fixture::symmetric_body(4).shaped(&[0.0; SHAPE_COUNT]);
        let kind = FeatureKind::Inertial;
        let rest = rest_features(kind, &body);
        let mut features = Vec::new();
        for frame in 0..100 {
            let wave = (frame as f32 * 0.7).sin();
            features.extend(rest.iter().map(|x| x + 3.0 * wave));
        }
        let normaliser = Normaliser::fit(kind, &body, [features.as_slice()].into_iter());
        let (motion, _) = normaliser.apply(&rest);
        assert!(motion.iter().all(|x| *x == 0.0));
        let (motion, _) = normaliser.apply(&features);
        let square: f32 = motion.iter().map(|x| x * x).sum::<f32>() / motion.len() as f32;
        assert!((square - 1.0).abs() < 1e-3, "{square}");
    }

    #[test]
    fn a_constant_feature_is_not_blown_up() {
        let body = fixture::symmetric_body(4).shaped(&[0.0; SHAPE_COUNT]);
        let rest = rest_features(FeatureKind::Inertial, &body);
        let normaliser =
            Normaliser::fit(FeatureKind::Inertial, &body, [rest.as_slice()].into_iter());
        assert!(normaliser.scale.iter().all(|s| s.is_finite() && *s <= 50.0));
    }
}
