//! Directions, angles and frames.

use glam::{DMat3, DQuat, DVec3};

/// The rotation that takes the first of `from` to the first of `to`, and the second to the side where
/// the second of `to` is.
pub fn turn_frame(from: [DVec3; 2], to: [DVec3; 2]) -> Option<DQuat> {
    let frame = |[first, second]: [DVec3; 2]| {
        let first = first.try_normalize()?;
        let second = second.reject_from_normalized(first).try_normalize()?;
        Some(DMat3::from_cols(first, second, first.cross(second)))
    };
    let turn = frame(to)? * frame(from)?.transpose();
    Some(DQuat::from_mat3(&turn).normalize())
}

/// Angle between directions in degrees; 0 where one has no length.
pub fn degrees(a: DVec3, b: DVec3) -> f64 {
    if a.length() < 1e-9 || b.length() < 1e-9 {
        return 0.0;
    }
    a.angle_between(b).to_degrees()
}

/// Angle between rotations in degrees.
pub fn turn_degrees(a: DQuat, b: DQuat) -> f64 {
    2.0 * a.dot(b).abs().min(1.0).acos().to_degrees()
}

/// Angle about `axis` from `a` to `b`, without sign, in degrees.
pub fn twist_degrees(axis: DVec3, a: DVec3, b: DVec3) -> f64 {
    let axis = axis.normalize_or(DVec3::Y);
    degrees(
        a.reject_from_normalized(axis),
        b.reject_from_normalized(axis),
    )
}
