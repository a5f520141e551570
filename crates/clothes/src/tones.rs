//! What a painter meant by the colours of vertices: two colours, and mixtures of them where they meet.

use std::collections::HashMap;

/// Two colours closer than this (of 255) are shades of one.
const LEAST_DISTANCE: f32 = 40.0;

/// How far (of 255) a colour may be off the line between the two: files round their colours.
const LINE_TOLERANCE: f32 = 6.0;

/// The two colours of a surface all of whose vertices have one of them or a mixture.
#[derive(Clone, Debug, PartialEq)]
pub struct Tones {
    /// The most frequent colour, and the other one (sRGB).
    pub srgb: [[u8; 3]; 2],
    /// How much of the second each vertex has, 0..=1.
    pub shares: Vec<f32>,
}

impl Tones {
    /// The tones of vertices in these colours (sRGB and opacity, which does not count); None where there are
    /// fewer than two, or other colours besides.
    pub fn of(colors_srgba: &[[u8; 4]]) -> Option<Self> {
        let srgb = most_frequent_two(colors_srgba)?;
        let shares = colors_srgba
            .iter()
            .map(|color| share_of_second(&srgb, *color));
        Some(Self {
            srgb,
            shares: shares.collect::<Option<_>>()?,
        })
    }
}

/// The most frequent colour, and the most frequent one that differs clearly from it.
fn most_frequent_two(painted: &[[u8; 4]]) -> Option<[[u8; 3]; 2]> {
    let mut counts: HashMap<[u8; 3], usize> = HashMap::new();
    for &[r, g, b, _] in painted {
        *counts.entry([r, g, b]).or_default() += 1;
    }
    // Ties go to the lower colour, so that the order of the map does not show.
    let most_frequent = |accept: &dyn Fn([u8; 3]) -> bool| {
        let accepted = counts.iter().filter(|(color, _)| accept(**color));
        let best = accepted.max_by_key(|&(color, count)| (count, std::cmp::Reverse(color)));
        best.map(|(color, _)| *color)
    };
    let first = most_frequent(&|_| true)?;
    let differs = |color: [u8; 3]| distance(color.map(f32::from), first.map(f32::from));
    let second = most_frequent(&|color| differs(color) >= LEAST_DISTANCE)?;
    Some([first, second])
}

/// How much of the second tone, 0..=1, is in a colour; none if it is no mixture of the two.
fn share_of_second(tones: &[[u8; 3]; 2], [r, g, b, _]: [u8; 4]) -> Option<f32> {
    let [first, second] = tones.map(|tone| tone.map(f32::from));
    let color = [r, g, b].map(f32::from);
    let axis: [f32; 3] = std::array::from_fn(|idx| second[idx] - first[idx]);
    let length_squared: f32 = axis.iter().map(|part| part * part).sum();
    let along: f32 = (0..3)
        .map(|idx| (color[idx] - first[idx]) * axis[idx])
        .sum();
    let share = (along / length_squared).clamp(0.0, 1.0);
    let mixture = std::array::from_fn(|idx| first[idx] + share * axis[idx]);
    (distance(color, mixture) <= LINE_TOLERANCE).then_some(share)
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f32>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: [u8; 4] = [206, 176, 155, 255];
    const CLOTH: [u8; 4] = [38, 66, 85, 255];
    const HALF: [u8; 4] = [122, 121, 120, 255];

    #[test]
    fn mixtures_of_skin_and_cloth_are_told_apart() {
        let tones = Tones::of(&[SKIN, SKIN, SKIN, HALF, CLOTH, CLOTH]).unwrap();
        assert_eq!(tones.srgb, [[206, 176, 155], [38, 66, 85]]);
        let shares = tones.shares;
        assert_eq!([&shares[..3], &shares[4..]], [&[0.0; 3][..], &[1.0; 2]]);
        assert!((shares[3] - 0.5).abs() < 0.01, "{shares:?}");
    }

    #[test]
    fn other_paintings_have_no_two_tones() {
        let red = [200, 10, 10, 255];
        let off_line = [210, 178, 155, 255];
        for painted in [
            vec![SKIN, CLOTH, red],
            vec![SKIN, SKIN],
            vec![SKIN, off_line],
            vec![],
        ] {
            assert_eq!(Tones::of(&painted), None, "{painted:?}");
        }
    }
}
