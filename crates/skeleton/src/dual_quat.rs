//! Rigid motions as dual quaternions (Kavan et al. 2008).

use glam::{Affine3A, Quat, Vec3};

/// How the motions of several joints are blended at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Skinning {
    /// The mean of the joints' matrices. Skin loses volume where joints twist or bend far.
    #[default]
    Linear,
    /// The mean of the joints' dual quaternions, which is rigid: twisted wrists stay thick, and bent elbows
    /// bulge a little.
    DualQuaternion,
}

/// A rigid motion as a unit dual quaternion, after a uniform scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualQuat {
    /// The rotation, of unit length.
    pub real: Quat,
    /// Half of the translation in metres, times the rotation.
    pub dual: Quat,
    /// Size afterwards over size before; negative where the motion mirrors at a point.
    pub scale: f32,
}

impl DualQuat {
    /// The motion of an affine transform whose matrix is a rotation times a scale. Of another matrix the
    /// scale is that of the volume and the rotation one nearby, and of a singular one there is none.
    pub fn from_affine(affine: &Affine3A) -> Self {
        let scale = affine.matrix3.determinant().cbrt();
        let rotation = if scale.abs() > f32::MIN_POSITIVE {
            Quat::from_mat3a(&(affine.matrix3 * scale.recip()))
        } else {
            Quat::IDENTITY
        };
        let length = rotation.length();
        let real = if length.is_finite() && length > 0.0 {
            rotation * length.recip()
        } else {
            Quat::IDENTITY
        };
        let half = affine.translation * 0.5;
        Self {
            real,
            dual: Quat::from_xyzw(half.x, half.y, half.z, 0.0) * real,
            scale,
        }
    }

    /// The blend of motions with their weights, which sum to 1. As `q` and `-q` are one rotation, each is
    /// taken on the side of the first; that must have a weight.
    #[inline]
    pub fn blend<'a>(weighted: impl IntoIterator<Item = (&'a Self, f32)>) -> Self {
        let mut weighted = weighted.into_iter();
        let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let mut sum = Self {
            real: zero,
            dual: zero,
            scale: 0.0,
        };
        let Some((first, weight)) = weighted.next() else {
            return sum;
        };
        sum.add(first, weight, weight);
        for (motion, weight) in weighted {
            let is_beyond = motion.real.dot(first.real) < 0.0;
            sum.add(motion, if is_beyond { -weight } else { weight }, weight);
        }
        let inverse_length = sum.real.length().recip();
        Self {
            real: sum.real * inverse_length,
            dual: sum.dual * inverse_length,
            scale: sum.scale,
        }
    }

    #[inline]
    fn add(&mut self, motion: &Self, signed_weight: f32, weight: f32) {
        self.real += motion.real * signed_weight;
        self.dual += motion.dual * signed_weight;
        self.scale += motion.scale * weight;
    }

    /// The translation in metres, after scale and rotation.
    #[inline]
    pub fn translation_m(&self) -> Vec3 {
        let doubled = (self.dual * self.real.conjugate()) * 2.0;
        Vec3::new(doubled.x, doubled.y, doubled.z)
    }

    /// The motion as a transform.
    #[inline]
    pub fn to_affine(&self) -> Affine3A {
        let scale = Vec3::splat(self.scale);
        Affine3A::from_scale_rotation_translation(scale, self.real, self.translation_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(axis: Vec3, angle: f32, translation_m: Vec3, scale: f32) -> Affine3A {
        let rotation = Quat::from_axis_angle(axis.normalize(), angle);
        Affine3A::from_scale_rotation_translation(Vec3::splat(scale), rotation, translation_m)
    }

    fn apart(a: &Affine3A, b: &Affine3A) -> f32 {
        let columns = a.to_cols_array().into_iter().zip(b.to_cols_array());
        columns.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn a_motion_comes_back_with_its_scale() {
        for (angle, scale) in [
            (0.0, 1.0),
            (2.9, 1.0),
            (3.1, 0.1),
            (-1.2, 10.0),
            (0.7, -2.0),
        ] {
            let moved = motion(
                Vec3::new(0.3, -1.0, 0.5),
                angle,
                Vec3::new(1.0, 2.0, -0.4),
                scale,
            );
            let again = DualQuat::from_affine(&moved).to_affine();
            assert!(
                apart(&moved, &again) < 2e-6 * scale.abs().max(1.0),
                "{again:?}"
            );
        }
    }

    #[test]
    fn a_blend_of_one_motion_is_that_motion_whatever_its_sign() {
        let moved = motion(Vec3::X, 1.9, Vec3::new(0.2, 1.0, 0.1), 1.5);
        let one = DualQuat::from_affine(&moved);
        let other = DualQuat {
            real: -one.real,
            dual: -one.dual,
            ..one
        };
        let blended = DualQuat::blend([(&one, 0.5), (&other, 0.3), (&one, 0.2)]).to_affine();
        assert!(apart(&moved, &blended) < 3e-6, "{blended:?}");
    }

    #[test]
    fn half_of_a_twist_is_half_the_angle() {
        let still = DualQuat::from_affine(&Affine3A::IDENTITY);
        let twist = DualQuat::from_affine(&motion(Vec3::Y, 3.0, Vec3::ZERO, 1.0));
        let blended = DualQuat::blend([(&still, 0.5), (&twist, 0.5)]).to_affine();
        assert!(apart(&motion(Vec3::Y, 1.5, Vec3::ZERO, 1.0), &blended) < 1e-6);
    }

    #[test]
    fn what_is_no_motion_gives_numbers() {
        let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
        let affine = DualQuat::from_affine(&flat).to_affine();
        assert!(affine.is_finite(), "{affine:?}");
        assert!(
            DualQuat::from_affine(&Affine3A::ZERO)
                .to_affine()
                .is_finite()
        );
    }
}
