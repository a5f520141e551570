//! Offsets times their gains, softly limited, four vertices at once.

use dynaskin_skeleton::soft_limited;
use glam::{Vec3, Vec4, Vec4Swizzles as _};

use super::vertex_controls::VertexControls;

/// Vertices that are worked on at once.
const VERTICES: usize = 4;

/// Shortest share of a limit, along each axis, below which an offset is left alone for certain: half
/// the limit over the square root of 3, rounded down.
const SAFE_SHARE: f32 = 0.288;

/// Writes the offsets `given_m` under `controls`, from slot `first` on, to `shown_m`, and the positions
/// `rest_m` with them to `positions_m`. All four are flat, three numbers a vertex, and as long.
pub(super) fn shown(
    given_m: &[f32],
    (controls, first): (&VertexControls, usize),
    rest_m: &[f32],
    shown_m: &mut [f32],
    positions_m: &mut [f32],
) {
    let count = given_m.len() / 3;
    let gains = &controls.gains[first..first + count];
    let limits_m = &controls.limits_m[first..first + count];
    let (given, given_left) = given_m.as_chunks::<{ 3 * VERTICES }>();
    let (shown, shown_left) = shown_m.as_chunks_mut::<{ 3 * VERTICES }>();
    let (gains, gains_left) = gains.as_chunks::<VERTICES>();
    let (limits, limits_left) = limits_m.as_chunks::<VERTICES>();
    let controls = gains.iter().zip(limits);
    for ((shown, given), (gains, limits)) in shown.iter_mut().zip(given).zip(controls) {
        if !four(given, gains, limits, shown) {
            each(given, gains, limits, shown);
        }
    }
    each(given_left, gains_left, limits_left, shown_left);
    for ((position, rest), offset) in positions_m.iter_mut().zip(rest_m).zip(&*shown_m) {
        *position = rest + offset;
    }
}

/// Writes four offsets; whether none of them can be limited, without which they are not the right ones.
#[inline(always)]
fn four(
    given: &[f32; 3 * VERTICES],
    gains: &[f32; VERTICES],
    limits_m: &[f32; VERTICES],
    shown: &mut [f32; 3 * VERTICES],
) -> bool {
    let gains = Vec4::from_array(*gains);
    let safe = Vec4::from_array(*limits_m) * SAFE_SHARE;
    let gains = [gains.xxxy(), gains.yyzz(), gains.zwww()];
    let safe = [safe.xxxy(), safe.yyzz(), safe.zwww()];
    let mut fine = true;
    let parts = given.as_chunks::<4>().0.iter().zip(gains).zip(safe);
    for (((given, gain), safe), shown) in parts.zip(shown.as_chunks_mut::<4>().0) {
        let offset = Vec4::from_array(*given) * gain;
        fine &= offset.abs().cmple(safe).all();
        *shown = offset.to_array();
    }
    fine
}

/// One offset after the other.
fn each(given: &[f32], gains: &[f32], limits_m: &[f32], shown: &mut [f32]) {
    let offsets = given
        .as_chunks::<3>()
        .0
        .iter()
        .zip(shown.as_chunks_mut::<3>().0);
    for ((given, shown), (gain, limit_m)) in offsets.zip(gains.iter().zip(limits_m)) {
        // Offsets up to half the limit are left alone.
        let offset_m = soft_limited(Vec3::from_array(*given) * *gain, 0.5 * limit_m, *limit_m);
        *shown = offset_m.to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_at_once_are_as_one_by_one() {
        let count = 23;
        let given: Vec<f32> = (0..3 * count)
            .map(|n| (n as f32 * 1.7).sin() * 0.05)
            .collect();
        let rest: Vec<f32> = (0..3 * count).map(|n| n as f32).collect();
        let controls = VertexControls {
            gains: (0..count + 2).map(|n| (n % 3) as f32).collect(),
            limits_m: (0..count + 2).map(|n| 0.04 * (n % 5) as f32).collect(),
        };
        let (mut got, mut positions) = (vec![0.0; 3 * count], vec![0.0; 3 * count]);
        shown(&given, (&controls, 2), &rest, &mut got, &mut positions);
        let mut expected = vec![0.0; 3 * count];
        each(
            &given,
            &controls.gains[2..],
            &controls.limits_m[2..],
            &mut expected,
        );
        assert_eq!(got, expected);
        let limited = |vertex: usize| 3 * vertex..3 * vertex + 3;
        let changed = (0..count).filter(|&vertex| {
            let plain = given[limited(vertex)]
                .iter()
                .map(|x| x * controls.gains[vertex + 2]);
            !plain.eq(got[limited(vertex)].iter().copied())
        });
        assert!(
            (1..count).contains(&changed.count()),
            "some are limited, others are not"
        );
        let sums = rest
            .iter()
            .zip(&expected)
            .map(|(rest, offset)| rest + offset);
        assert!(sums.eq(positions));
    }
}
