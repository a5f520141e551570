//! What the predictor is told about a body: its materials, and how thick its tissue is.
//!
//! β has ten coefficients, and a data set has a handful of shapes: a network that sees β itself
//! fits these few and fails on others. What a region's swing depends on is the depth of its tissue
//! (`f = sqrt(G / rho) / (4 h)`), one number, over which few shapes are spread well. So each block
//! hears the logarithm of its own region's mean thickness, and its own materials.

use dynaskin_body::{BodyModel, LEAST_THICKNESS_M, REGION_COUNT, SHAPE_COUNT};
use dynaskin_runtime::features::MATERIAL_COUNT;
use serde::{Deserialize, Serialize};

/// Below this deviation a number counts as constant and is not blown up.
const SMALLEST_DEVIATION: f32 = 0.1;

/// Turns the features of a body (materials, then β) into what the predictor hears: the materials
/// (binary logarithms), then for each region the natural logarithm of its mean thickness over that at
/// β = 0. Bodies of unknown thickness give β instead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Build {
    /// Mean thickness of each region at β = 0 in metres, or empty where it is not known.
    pub thickness_m: Vec<f32>,
    /// Its change in metres per standard deviation, `[coefficient][region]` flat.
    pub thickness_dirs_m: Vec<f32>,
    /// What each number is multiplied with before the predictor hears it.
    pub scale: Vec<f32>,
}

impl Build {
    /// Of the body `model`; nothing is scaled yet.
    pub fn of_body(model: &BodyModel) -> Self {
        let known = model.region_weights.len() == REGION_COUNT
            && !model.thickness_template_m.is_empty()
            && model.thickness_shape_dirs_m.len() == SHAPE_COUNT;
        let mean = |thickness: &[f32], weights: &[f32]| {
            let sum: f32 = thickness.iter().zip(weights).map(|(t, w)| t * w).sum();
            sum / weights.iter().sum::<f32>().max(f32::MIN_POSITIVE)
        };
        let of_regions = |thickness: &[f32]| {
            let regions = model.region_weights.iter();
            regions
                .map(|weights| mean(thickness, weights))
                .collect::<Vec<f32>>()
        };
        // A region that the body does not have is thin and stays so.
        let at_zero = |thickness_m: &f32| thickness_m.max(LEAST_THICKNESS_M);
        let thickness_m: Vec<f32> = match known {
            true => of_regions(&model.thickness_template_m)
                .iter()
                .map(at_zero)
                .collect(),
            false => Vec::new(),
        };
        let dirs = model.thickness_shape_dirs_m.iter();
        let dirs = dirs.flat_map(|dirs| of_regions(dirs));
        let mut build = Self {
            thickness_dirs_m: if known { dirs.collect() } else { Vec::new() },
            thickness_m,
            scale: Vec::new(),
        };
        build.scale = vec![1.0; build.count()];
        build
    }

    /// How many numbers the predictor hears.
    pub fn count(&self) -> usize {
        MATERIAL_COUNT + self.shape_count()
    }

    /// How many of them are about the shape.
    pub fn shape_count(&self) -> usize {
        if self.thickness_m.is_empty() {
            SHAPE_COUNT
        } else {
            REGION_COUNT
        }
    }

    /// Whether the block that belongs to `region` hears the number `index`; a block of no region
    /// hears all.
    pub fn is_heard(&self, index: usize, region: Option<usize>) -> bool {
        let Some(region) = region else { return true };
        let shape = index.checked_sub(MATERIAL_COUNT);
        match shape {
            None => index % REGION_COUNT == region,
            Some(index) => self.thickness_m.is_empty() || index == region,
        }
    }

    /// Sets the scale so that the given features of bodies, each `[materials, β]`, come out with
    /// deviations of 1 about 0.
    pub fn fit_scale<'a>(&mut self, bodies: impl Iterator<Item = &'a [f32]>) {
        self.scale.fill(1.0);
        let mut squares = vec![0.0; self.count()];
        let mut bodies_seen = 0;
        for body in bodies {
            for (square, number) in squares.iter_mut().zip(self.of(body)) {
                *square += number * number;
            }
            bodies_seen += 1;
        }
        let deviation = |square: &f32| (square / bodies_seen.max(1) as f32).sqrt();
        self.scale = squares
            .iter()
            .map(|square| 1.0 / deviation(square).max(SMALLEST_DEVIATION))
            .collect();
    }

    /// What the predictor hears of the body with these features: materials, then β.
    pub fn of(&self, body: &[f32]) -> Vec<f32> {
        let (materials, shape) = body.split_at(MATERIAL_COUNT);
        let mut heard = materials.to_vec();
        if self.thickness_m.is_empty() {
            heard.extend_from_slice(shape);
        }
        for (region, at_zero_m) in self.thickness_m.iter().enumerate() {
            let dirs_m = self
                .thickness_dirs_m
                .iter()
                .skip(region)
                .step_by(REGION_COUNT);
            let change_m: f32 = dirs_m.zip(shape).map(|(dir, beta)| dir * beta).sum();
            let thickness_m = (at_zero_m + change_m).max(LEAST_THICKNESS_M);
            heard.push((thickness_m / at_zero_m).ln());
        }
        for (number, scale) in heard.iter_mut().zip(&self.scale) {
            *number *= scale;
        }
        heard
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn thickness_is_the_regions_own_and_has_a_floor() {
        let mut model = fixture::symmetric_body(4);
        let vertices = model.vertex_count();
        model.region_weights = vec![vec![0.0; vertices]; REGION_COUNT];
        for region in 0..REGION_COUNT {
            model.region_weights[region][region % vertices] = 1.0;
        }
        model.thickness_template_m = (0..vertices).map(|v| 0.01 * (v + 1) as f32).collect();
        model.thickness_shape_dirs_m = vec![vec![0.0; vertices]; SHAPE_COUNT];
        model.thickness_shape_dirs_m[3][1] = 0.02;
        let build = Build::of_body(&model);
        assert_eq!(build.count(), 18);
        let mut body = [0.0; MATERIAL_COUNT + SHAPE_COUNT];
        body[2] = -1.0;
        body[MATERIAL_COUNT + 3] = 1.0;
        let heard = build.of(&body);
        assert_eq!(heard[2], -1.0);
        for (region, number) in heard[MATERIAL_COUNT..].iter().enumerate() {
            let expected = if region % vertices == 1 {
                2f32.ln()
            } else {
                0.0
            };
            assert!(
                (number - expected).abs() < 1e-6,
                "region {region}: {number}"
            );
        }
        body[MATERIAL_COUNT + 3] = -50.0;
        let least = (LEAST_THICKNESS_M / 0.02).ln();
        assert!((build.of(&body)[MATERIAL_COUNT + 1] - least).abs() < 1e-6);
    }

    #[test]
    fn blocks_hear_their_own_region() {
        let build = Build {
            thickness_m: vec![0.02; REGION_COUNT],
            thickness_dirs_m: vec![0.0; REGION_COUNT * SHAPE_COUNT],
            scale: vec![1.0; 18],
        };
        let heard: Vec<usize> = (0..18).filter(|i| build.is_heard(*i, Some(1))).collect();
        assert_eq!(heard, [1, 7, 13]);
        assert!((0..18).all(|index| build.is_heard(index, None)));
    }

    #[test]
    fn the_scale_gives_unit_deviations() {
        let mut build = Build::of_body(&fixture::symmetric_body(4));
        let bodies: Vec<Vec<f32>> = [-2.0f32, 2.0]
            .map(|number| vec![number; MATERIAL_COUNT + SHAPE_COUNT])
            .into();
        build.fit_scale(bodies.iter().map(Vec::as_slice));
        assert!(
            build.of(&bodies[1])[..MATERIAL_COUNT]
                .iter()
                .all(|n| (n - 1.0).abs() < 1e-6)
        );
    }
}
