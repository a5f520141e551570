//! The body shapes of a data set.

use dynaskin_body::SHAPE_COUNT;
use sha2::{Digest as _, Sha256};

/// Shapes to train on, spread over the shape space of the default bodies, whose first coefficient
/// is stature, the second fat and the fifth and sixth mostly the chest: mean, heavy, lean, tall and
/// muscular, short, large chest, small chest.
pub const TRAINING_SHAPES: [[f32; SHAPE_COUNT]; 7] = [
    [0.0; SHAPE_COUNT],
    [0.3, 1.8, 0.5, 0.0, -0.3, 0.2, 0.0, 0.4, 0.0, 0.0],
    [-0.4, -1.5, -0.6, 0.3, 0.2, 0.0, 0.5, 0.0, 0.0, 0.0],
    [1.3, -0.2, 0.6, 0.4, -0.2, 0.9, 1.0, 1.3, 0.3, 0.7],
    [-1.3, 0.4, -1.3, 0.8, -0.2, 0.3, 0.0, -0.5, 0.0, 0.4],
    [0.2, 0.5, 0.3, 0.4, 1.7, -1.3, 0.3, 0.0, -0.4, 0.0],
    [-0.2, 0.3, 0.0, -0.5, -1.5, 1.2, 0.0, 0.3, 0.0, -0.4],
];

/// Shapes never trained on: one inside the range of the training shapes, one heavier than all of
/// them, one leaner than all with a large chest.
pub const HELD_OUT_SHAPES: [[f32; SHAPE_COUNT]; 3] = [
    [0.3, 0.9, -0.4, 0.5, -0.6, 0.4, 0.2, 0.0, 0.0, 0.0],
    [-0.6, 2.4, 0.6, -0.8, 0.7, -0.5, 0.0, 0.0, 0.0, 0.0],
    [0.6, -1.9, 0.4, -0.3, 1.9, -1.4, -0.3, 0.2, 0.0, 0.0],
];

/// How many further training shapes there are to draw from.
pub const DRAWN_SHAPES: usize = 256;

/// Drawn shapes reach this much farther from the middle than [`TRAINING_SHAPES`] do: about as far as
/// people who set shapes by hand go. A network interpolates between bodies and cannot be trusted
/// beyond them.
const REACH: f32 = 1.35;

/// Index of the first drawn shape: they come after the held-out ones.
pub(super) const FIRST_DRAWN: usize = TRAINING_SHAPES.len() + HELD_OUT_SHAPES.len();

/// A drawn shape: each coefficient by itself and evenly over 1.35 times the range of
/// [`TRAINING_SHAPES`]. Seven shapes show a network what a swing looks like but not how it depends on
/// ten coefficients; a clip each of many shapes does. Depends on nothing but `index`.
pub fn drawn_shape(index: usize) -> [f32; SHAPE_COUNT] {
    even_shape("drawn shape", index, REACH)
}

/// The shape number `index` of the row `label`: each coefficient by itself and evenly over `reach` times
/// the range of [`TRAINING_SHAPES`].
pub(crate) fn even_shape(label: &str, index: usize, reach: f32) -> [f32; SHAPE_COUNT] {
    let digest = Sha256::new()
        .chain_update(label)
        .chain_update((index as u64).to_le_bytes())
        .finalize();
    std::array::from_fn(|coefficient| {
        // Two bytes a number: 20 of the 32.
        let bytes = [digest[2 * coefficient], digest[2 * coefficient + 1]];
        let even = f32::from(u16::from_le_bytes(bytes)) / f32::from(u16::MAX);
        let (least, most) = shape_range(coefficient, reach);
        least + even * (most - least)
    })
}

/// The range of a coefficient over [`TRAINING_SHAPES`], `reach` times as wide about its middle.
fn shape_range(coefficient: usize, reach: f32) -> (f32, f32) {
    let of_shapes = TRAINING_SHAPES.iter().map(|shape| shape[coefficient]);
    let (least, most) = of_shapes.fold((f32::MAX, f32::MIN), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    let (middle, half) = ((least + most) / 2.0, reach * (most - least) / 2.0);
    (middle - half, middle + half)
}

/// The drawn shape of a clip (index into all shapes), for every second clip. Depends on nothing but
/// name and seed.
pub(super) fn draw_further(name: &str, seed: u64) -> Option<usize> {
    let digest = Sha256::new()
        .chain_update(b"further shape")
        .chain_update(seed.to_le_bytes())
        .chain_update(name.as_bytes())
        .finalize();
    let index = FIRST_DRAWN + usize::from(digest[1]) % DRAWN_SHAPES;
    digest[0].is_multiple_of(2).then_some(index)
}

/// Different training shapes below `available` for a clip, and for every fourth clip one held-out
/// shape (counted on after all training shapes). Depends on nothing but name and seed.
pub(super) fn draw(name: &str, seed: u64, available: usize, draws: usize) -> Vec<usize> {
    let available = available.clamp(1, TRAINING_SHAPES.len());
    let digest = Sha256::new()
        .chain_update(seed.to_le_bytes())
        .chain_update(name.as_bytes())
        .finalize();
    let mut left: Vec<usize> = (0..available).collect();
    let mut shapes: Vec<usize> = (0..draws.min(available))
        .map(|k| left.remove(usize::from(digest[4 + k]) % left.len()))
        .collect();
    shapes.sort_unstable();
    if digest[2].is_multiple_of(4) {
        let held_out = usize::from(digest[3]) % HELD_OUT_SHAPES.len();
        shapes.push(TRAINING_SHAPES.len() + held_out);
    }
    shapes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_shapes_fill_their_box() {
        for coefficient in 0..SHAPE_COUNT {
            let (least, most) = shape_range(coefficient, REACH);
            let mean = (0..DRAWN_SHAPES)
                .map(|index| drawn_shape(index)[coefficient])
                .inspect(|value| assert!((least..=most).contains(value)))
                .sum::<f32>()
                / DRAWN_SHAPES as f32;
            let middle = (least + most) / 2.0;
            assert!(
                (mean - middle).abs() < 0.15 * (most - least),
                "{coefficient}"
            );
        }
        // The lean one only by its seventh coefficient, which hardly shows.
        let outside = |shape: &[f32; SHAPE_COUNT], reach: f32| {
            (0..SHAPE_COUNT).any(|c| {
                let (least, most) = shape_range(c, reach);
                shape[c] < least || shape[c] > most
            })
        };
        let outside_training = HELD_OUT_SHAPES.map(|s| outside(&s, 1.0));
        assert_eq!(outside_training, [false, true, true]);
        let outside_drawn = HELD_OUT_SHAPES.map(|s| outside(&s, REACH));
        assert_eq!(outside_drawn, [false, true, true]);
    }

    #[test]
    fn draws_spread_over_the_shapes_and_repeat() {
        let training = TRAINING_SHAPES.len();
        let mut count = [0; TRAINING_SHAPES.len() + HELD_OUT_SHAPES.len()];
        for clip in 0..400 {
            let name = format!("clip{clip}");
            let shapes = draw(&name, 1, training, 1);
            assert_eq!(shapes, draw(&name, 1, training, 1));
            for shape in shapes {
                count[shape] += 1;
            }
        }
        assert!(count.iter().all(|&n| n > 20), "{count:?}");
        let drawn = draw("x", 1, 3, 3);
        assert!(drawn.iter().filter(|&&s| s < training).all(|&s| s < 3));
        let further: Vec<_> = (0..400)
            .filter_map(|clip| draw_further(&format!("clip{clip}"), 1))
            .collect();
        assert!((160..240).contains(&further.len()), "{}", further.len());
        let different: std::collections::BTreeSet<_> = further.iter().collect();
        assert!(different.len() > 120, "{}", different.len());
        let drawn = draw("x", 1, training, 3);
        assert_eq!(drawn.iter().filter(|&&s| s < training).count(), 3);
    }
}
