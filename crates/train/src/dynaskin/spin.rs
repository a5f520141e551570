//! What a turning bone does to its tissue beside what the features say as they are.
//!
//! The inertial force at a point r of a bone's frame is that of `a + α × r + ω × (ω × r)`. The features
//! hold a, α and ω, so springs whose drive is linear in them cover the first two terms everywhere. The
//! third is linear in the six products of ω's components; a network that has to find squares by itself
//! finds them for the speeds it learned from only, and arms or shanks of another motion turn faster.

use dynaskin_runtime::features::INERTIAL_JOINTS;
use serde::{Deserialize, Serialize};

/// Features of each of [`INERTIAL_JOINTS`]: acceleration, angular velocity, angular acceleration.
const INERTIAL: usize = 9;
/// Where the angular velocity stands among them.
const ANGULAR_VELOCITY: usize = 3;
/// The factors of each product: components of the angular velocity.
pub(super) const FACTORS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
/// Products of each joint.
pub const SPINS: usize = FACTORS.len();
/// Number of products.
pub const SPIN_COUNT: usize = SPINS * INERTIAL_JOINTS.len();
/// Below this deviation in (rad/s)² a product counts as nothing and is not blown up.
const SMALLEST_DEVIATION: f32 = 0.05;

/// Products of angular velocities, scaled to a deviation of 1 about 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spin {
    /// What each product is multiplied with, `[joint][product]` flat.
    pub scale: Vec<f32>,
}

impl Spin {
    /// Indices of the motion features whose products are taken: the first factors, then the second.
    pub fn factors() -> [Vec<usize>; 2] {
        let joints = 0..INERTIAL_JOINTS.len();
        let place = |joint: usize, axis: usize| INERTIAL * joint + ANGULAR_VELOCITY + axis;
        let factors = joints
            .flat_map(|joint| FACTORS.map(|(one, other)| (place(joint, one), place(joint, other))));
        let (first, second) = factors.unzip();
        [first, second]
    }

    /// Products of a frame's motion features, in (rad/s)².
    fn raw(motion: &[f32]) -> Vec<f32> {
        let [first, second] = Self::factors();
        let pairs = first.iter().zip(&second);
        pairs.map(|(a, b)| motion[*a] * motion[*b]).collect()
    }

    /// The scale by frames of motion features that are learned from.
    pub fn fit<'a>(frames: impl Iterator<Item = &'a [f32]>) -> Self {
        let mut squares = vec![0.0f64; SPIN_COUNT];
        let mut count = 0usize;
        for motion in frames {
            for (square, product) in squares.iter_mut().zip(Self::raw(motion)) {
                *square += f64::from(product).powi(2);
            }
            count += 1;
        }
        let scale = squares.iter().map(|square| {
            let deviation = (square / count.max(1) as f64).sqrt() as f32;
            1.0 / deviation.max(SMALLEST_DEVIATION)
        });
        Self {
            scale: scale.collect(),
        }
    }

    /// Scaled products of a frame's motion features as the runtime gives them.
    pub fn of(&self, motion: &[f32]) -> Vec<f32> {
        let products = Self::raw(motion).into_iter().zip(&self.scale);
        products.map(|(product, scale)| product * scale).collect()
    }
}

#[cfg(test)]
mod tests {
    use dynaskin_runtime::features::FeatureKind;

    use super::*;

    #[test]
    fn products_are_those_of_angular_velocities() {
        let names = FeatureKind::InertialMaterials.names();
        let factors = Spin::factors();
        for (first, second) in factors[0].iter().zip(&factors[1]) {
            assert!(names[*first].contains("angular_velocity"), "{first}");
            let joint = |index: &usize| names[*index].split('.').next().map(str::to_owned);
            assert_eq!(joint(first), joint(second));
        }
        let mut motion = vec![1.0; FeatureKind::InertialMaterials.motion_count()];
        // The second joint's angular velocity.
        motion[12..15].copy_from_slice(&[1.0, 2.0, 3.0]);
        let raw = Spin::raw(&motion);
        assert_eq!(raw.len(), SPIN_COUNT);
        assert_eq!(raw[SPINS..2 * SPINS], [1.0, 4.0, 9.0, 2.0, 3.0, 6.0]);
    }

    #[test]
    fn the_scale_gives_unit_squares() {
        let mut frame = vec![0.0; FeatureKind::InertialMaterials.motion_count()];
        frame[3] = 2.0;
        let spin = Spin::fit([frame.as_slice()].into_iter());
        let of = spin.of(&frame);
        assert!((of[0] - 1.0).abs() < 1e-6);
        assert!(of[1..].iter().all(|product| *product == 0.0));
    }
}
