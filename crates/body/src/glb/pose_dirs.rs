//! Pose correctives as 16-bit steps.
//!
//! Their fields differ a thousandfold in size, so each has a step of its own: the smallest power of two
//! with which its largest number fits. Such steps are exact, and writing what was read gives the same
//! numbers.

use glam::Vec3;

/// One field in steps.
pub(super) struct Steps {
    pub step_m: f32,
    pub values: Vec<[i16; 3]>,
}

/// Steps beyond this are no metres of a body, and below the other they are no normal numbers.
const LARGEST_EXPONENT: i32 = 8;
const LEAST_EXPONENT: i32 = -60;

/// The field `dirs_m` in steps; none where it is too large or not finite.
pub(super) fn in_steps(dirs_m: &[Vec3]) -> Option<Steps> {
    let largest_m = dirs_m
        .iter()
        .flat_map(|dir| dir.to_array())
        .try_fold(0.0_f32, |most, x| x.is_finite().then(|| most.max(x.abs())))?;
    let step_m = smallest_step_m(largest_m)?;
    let values = dirs_m
        .iter()
        .map(|dir| (*dir / step_m).round().to_array().map(|x| x as i16));
    Some(Steps {
        step_m,
        values: values.collect(),
    })
}

/// The smallest step with which numbers up to `largest_m` fit into 16 bits; none where they are too large.
pub(crate) fn smallest_step_m(largest_m: f32) -> Option<f32> {
    (LEAST_EXPONENT..=LARGEST_EXPONENT)
        .map(|exponent| 2.0_f32.powi(exponent))
        .find(|step_m| largest_m <= f32::from(i16::MAX) * step_m)
}

/// Whether a step that a file names is one of [`in_steps`].
pub(super) fn is_step(step_m: f32) -> bool {
    (LEAST_EXPONENT..=LARGEST_EXPONENT).any(|exponent| step_m == 2.0_f32.powi(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_is_written_alike() {
        for largest_m in [
            0.0,
            1e-9,
            0.031_3,
            16_383.5 / 65_536.0,
            16_384.0 / 65_536.0,
            2.0,
        ] {
            let dirs_m = [
                Vec3::new(largest_m, -0.3 * largest_m, 0.0),
                Vec3::splat(1e-7),
            ];
            let written = in_steps(&dirs_m).unwrap();
            assert!(is_step(written.step_m));
            let read = written
                .values
                .iter()
                .map(|value| Vec3::from_array(value.map(f32::from)) * written.step_m)
                .collect::<Vec<_>>();
            for (read, dir) in read.iter().zip(dirs_m) {
                assert!((*read - dir).abs().max_element() <= 0.5 * written.step_m);
            }
            let again = in_steps(&read).unwrap();
            assert_eq!(
                (again.step_m, again.values),
                (written.step_m, written.values)
            );
        }
        assert!(in_steps(&[Vec3::splat(f32::NAN)]).is_none());
        assert!(in_steps(&[Vec3::splat(1e9)]).is_none());
    }
}
