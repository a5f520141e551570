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
        let drawn = draw("x", 1, training, 3);
        assert_eq!(drawn.iter().filter(|&&s| s < training).count(), 3);
    }
}
