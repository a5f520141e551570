//! How far the features of a joint's motion go.

use dynaskin_skeleton::SoftLimit;

/// Limit of a joint's acceleration (m/s²), before gravity is subtracted. A jump's landing stays
/// below the knee; capture glitches and whips lie above.
pub const LINEAR_ACCELERATION_LIMIT: SoftLimit = SoftLimit {
    knee: 40.0,
    limit: 80.0,
};

/// Limit of a joint's angular velocity (rad/s). A sprinter's thigh reaches 15 rad/s.
pub const ANGULAR_VELOCITY_LIMIT: SoftLimit = SoftLimit {
    knee: 20.0,
    limit: 40.0,
};

/// Limit of a joint's angular acceleration (rad/s²): at 0.2 m from the joint, the knee is worth
/// the 40 m/s² of [`LINEAR_ACCELERATION_LIMIT`].
pub const ANGULAR_ACCELERATION_LIMIT: SoftLimit = SoftLimit {
    knee: 200.0,
    limit: 400.0,
};

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_soft_limit_keeps_small_vectors_and_bounds_large_ones() {
        let limit = LINEAR_ACCELERATION_LIMIT;
        let small = DVec3::new(0.0, 39.0, 0.0);
        assert_eq!(limit.apply(small), small);
        let whip = limit.apply(DVec3::new(342.0, 0.0, 0.0));
        assert!(whip.x > 79.0 && whip.x <= 80.0, "{whip}");
        let just_above = limit.apply(DVec3::new(0.0, 0.0, 40.001));
        assert!((just_above.z - 40.001).abs() < 1e-6);
    }
}
