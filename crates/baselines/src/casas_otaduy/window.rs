//! The regressor's view of three poses: the newest, its change, and the change of that.
//!
//! Poses of neighbouring ticks are nearly the same, and normalised one by one they differ by less
//! than training can see. Their differences are the same input in other coordinates; each is
//! normalised (section 3.5) on its own.

use dynaskin_runtime::features::FeatureKind;

use dynaskin_train::Normaliser;

/// What the predictor takes as input.
pub(super) const KIND: FeatureKind = FeatureKind::PoseWindow;
/// Numbers of one of the three poses.
pub(super) const POSE: usize = KIND.motion_count() / 3;
/// Below these deviations (metres, radians; standard deviations of β) a number counts as constant.
const SMALLEST_MOTION_DEVIATION: f64 = 1e-4;
const SMALLEST_SHAPE_DEVIATION: f64 = 0.1;

/// Turns features (`[frame][feature]`, flat) into pose, velocity and acceleration a tick, and β.
pub(super) fn differenced(features: &[f32]) -> Vec<f32> {
    let mut changes = features.to_vec();
    for frame in changes.chunks_exact_mut(KIND.count()) {
        for at in 0..POSE {
            let [newest, before, earlier] = [0, 1, 2].map(|pose| frame[pose * POSE + at]);
            let velocity = newest - before;
            frame[POSE + at] = velocity;
            frame[2 * POSE + at] = velocity - (before - earlier);
        }
    }
    changes
}

/// Mean and deviation of differenced features, given clip by clip.
pub(super) fn normaliser<'a>(features: impl Iterator<Item = &'a [f32]>) -> Normaliser {
    let count = KIND.count();
    let (mut sums, mut squares) = (vec![0.0f64; count], vec![0.0f64; count]);
    let mut frames = 0usize;
    for frame in features.flat_map(|clip| clip.chunks_exact(count)) {
        for (feature, x) in frame.iter().enumerate() {
            sums[feature] += f64::from(*x);
            squares[feature] += f64::from(*x).powi(2);
        }
        frames += 1;
    }
    let frames = frames.max(1) as f64;
    let scale = (0..count).map(|feature| {
        let variance = squares[feature] / frames - (sums[feature] / frames).powi(2);
        let smallest = if feature < KIND.motion_count() {
            SMALLEST_MOTION_DEVIATION
        } else {
            SMALLEST_SHAPE_DEVIATION
        };
        (1.0 / variance.max(0.0).sqrt().max(smallest)) as f32
    });
    Normaliser {
        scale: scale.collect(),
        origin: sums.iter().map(|sum| (sum / frames) as f32).collect(),
        motion: KIND.motion_count(),
    }
}

/// `(x - origin) · scale` of every frame, in place.
pub(super) fn normalise(features: &mut [f32], normaliser: &Normaliser) {
    for frame in features.chunks_exact_mut(KIND.count()) {
        for (feature, x) in frame.iter_mut().enumerate() {
            *x = (*x - normaliser.origin[feature]) * normaliser.scale[feature];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_turn_has_velocity_and_no_acceleration() {
        let mut features = vec![0.0; KIND.count()];
        for (pose, angle) in [0.5, 0.4, 0.3].into_iter().enumerate() {
            features[pose * POSE + 7] = angle;
        }
        let changes = differenced(&features);
        assert_eq!(changes[7], 0.5);
        assert!((changes[POSE + 7] - 0.1).abs() < 1e-6);
        assert!(changes[2 * POSE + 7].abs() < 1e-6);
    }

    #[test]
    fn normalised_features_have_mean_zero_and_deviation_one() {
        let frames: Vec<f32> = (0..200)
            .flat_map(|frame| {
                let wave = (frame as f32 * 0.7).sin();
                (0..KIND.count()).map(move |k| if k == 3 { 0.2 } else { k as f32 + 2.0 * wave })
            })
            .collect();
        let normaliser = normaliser([frames.as_slice()].into_iter());
        let mut scaled = frames.clone();
        normalise(&mut scaled, &normaliser);
        let column = |k: usize| scaled.iter().skip(k).step_by(KIND.count());
        let mean: f32 = column(5).sum::<f32>() / 200.0;
        let square: f32 = column(5).map(|x| x * x).sum::<f32>() / 200.0;
        assert!(
            mean.abs() < 1e-3 && (square - 1.0).abs() < 1e-3,
            "{mean} {square}"
        );
        // A constant is not blown up.
        assert!(column(3).all(|x| x.abs() < 1e-2));
    }
}
