//! Smooth limits of vectors: captured motion has accelerations that no body could follow.

use glam::{DVec3, Vec3};

/// A smooth limit of a vector's length that keeps its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftLimit {
    /// Vectors up to this length do not change.
    pub knee: f64,
    /// Upper limit of the length.
    pub limit: f64,
}

impl SoftLimit {
    /// `v` with its length l replaced by `knee + (limit - knee) tanh((l - knee) / (limit - knee))`
    /// where l is above the knee: continuous with its first derivative.
    pub fn apply(self, v: DVec3) -> DVec3 {
        let length = v.length();
        if length <= self.knee {
            return v;
        }
        let room = self.limit - self.knee;
        let limited = self.knee + room * ((length - self.knee) / room).tanh();
        v * (limited / length)
    }
}

/// As [`SoftLimit::apply`], in single precision; nothing is left where the limit is 0.
#[inline]
pub fn soft_limited(v: Vec3, knee: f32, limit: f32) -> Vec3 {
    let squared = v.length_squared();
    if squared <= knee * knee {
        return v;
    }
    limited(v, squared.sqrt(), knee, limit)
}

/// `v` of the length `length`, which is beyond `knee`. Few are: apart, so that the rest stays small
/// enough to be put where it is called.
#[inline(never)]
fn limited(v: Vec3, length: f32, knee: f32, limit: f32) -> Vec3 {
    if limit <= 0.0 {
        return Vec3::ZERO;
    }
    let room = limit - knee;
    let limited = knee + room * ((length - knee) / room).tanh();
    v * (limited / length)
}

/// Saturates an acceleration smoothly at `limit_m_per_s2`: `a / (1 + (|a|/limit)⁴)^¼`.
///
/// Motion capture contains accelerations of hundreds of m/s² that no body could follow. Half the
/// limit passes with 1.5 % less, the limit itself becomes 84 % of it, everything stays below it.
pub fn soft_clip(acceleration_m_per_s2: Vec3, limit_m_per_s2: f32) -> Vec3 {
    // Bounded first, so that the fourth power stays finite.
    let bound = Vec3::splat(1e4 * limit_m_per_s2);
    let bounded = acceleration_m_per_s2.clamp(-bound, bound);
    let ratio2 = bounded.length_squared() / (limit_m_per_s2 * limit_m_per_s2);
    bounded / (1.0 + ratio2 * ratio2).sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_precisions_limit_alike() {
        let limit = SoftLimit {
            knee: 0.1,
            limit: 0.2,
        };
        for length in [0.05, 0.1, 0.15, 0.3, 20.0] {
            let v = DVec3::new(0.6, -0.8, 0.0) * length;
            let single = soft_limited(v.as_vec3(), 0.1, 0.2);
            assert!(limit.apply(v).as_vec3().distance(single) < 1e-7, "{length}");
        }
        assert_eq!(soft_limited(Vec3::X, 0.0, 0.0), Vec3::ZERO);
        assert_eq!(soft_limited(Vec3::ZERO, 0.0, 0.0), Vec3::ZERO);
    }

    #[test]
    fn soft_clip_keeps_small_and_bounds_large_accelerations() {
        let limit = 40.0;
        assert_eq!(soft_clip(Vec3::ZERO, limit), Vec3::ZERO);
        assert!((soft_clip(Vec3::X * 10.0, limit).x - 10.0).abs() < 0.02);
        assert!((soft_clip(Vec3::Y * 40.0, limit).y - 33.64).abs() < 0.01);
        for size in [100.0, 1e4, 1e10, 1e20] {
            let clipped = soft_clip(Vec3::Z * size, limit);
            assert!(
                clipped.z > 38.0 && clipped.z <= limit * 1.000_001,
                "{size}: {clipped}"
            );
        }
    }
}
