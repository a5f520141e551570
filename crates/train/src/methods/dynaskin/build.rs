//! What the predictor is told about a body: its materials, and how thick its tissue is.
//!
//! β has ten coefficients, and a data set has few shapes beside that: a network that sees β itself
//! fits these few and fails on others. What a region's swing depends on is the depth of its tissue
//! (`f = sqrt(G / rho) / (4 h)`): few numbers, over which few shapes are spread well. So each block
//! hears the logarithm of the mean thickness of two parts of its own region, the thicker half (of the
//! chest: the breasts) and the thinner, and its own materials. β itself is heard, too, but
//! no further than it was learned from: beyond that only the thickness tells. How loud it is beside
//! the rest is a setting: the more shapes were learned from, the more it can be trusted.

use dynaskin_body::{BodyModel, LEAST_THICKNESS_M, REGION_COUNT, SHAPE_COUNT};
use dynaskin_runtime::features::MATERIAL_COUNT;
use serde::{Deserialize, Serialize};

/// Below this deviation a number counts as constant and is not blown up.
const SMALLEST_DEVIATION: f32 = 0.1;

/// Parts of a region whose thickness is told.
const PARTS: usize = 2;

/// Turns the features of a body (materials, then β) into what the predictor hears: the materials
/// (binary logarithms), β within the range learned from, then for each region and part the natural logarithm of its mean thickness
/// over that at β = 0, if the thickness of the body is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Build {
    /// Mean thickness of each part of each region (`[region][part]` flat) at β = 0 in metres, or
    /// empty where it is not known.
    pub thickness_m: Vec<f32>,
    /// Its change in metres per standard deviation, `[coefficient][region][part]` flat.
    pub thickness_dirs_m: Vec<f32>,
    /// The least and the greatest of each coefficient of β among the bodies learned from.
    pub shape_range: [(f32, f32); SHAPE_COUNT],
    /// What each number is multiplied with before the predictor hears it.
    pub scale: Vec<f32>,
}

impl Build {
    /// Of the body `model`; nothing is scaled or limited yet.
    pub fn of_body(model: &BodyModel) -> Self {
        let known = model.region_weights.len() == REGION_COUNT
            && !model.thickness_template_m.is_empty()
            && model.thickness_shape_dirs_m.len() == SHAPE_COUNT;
        let parts: Vec<Vec<f32>> = match known {
            true => parts(model),
            false => Vec::new(),
        };
        let of_parts = |thickness: &[f32]| {
            let mean = |weights: &Vec<f32>| {
                let sum: f32 = thickness.iter().zip(weights).map(|(t, w)| t * w).sum();
                sum / weights.iter().sum::<f32>().max(f32::MIN_POSITIVE)
            };
            parts.iter().map(mean).collect::<Vec<f32>>()
        };
        // A region that the body does not have is thin and stays so.
        let thickness_m = of_parts(&model.thickness_template_m);
        let thickness_m = thickness_m.into_iter().map(|t| t.max(LEAST_THICKNESS_M));
        let dirs = model.thickness_shape_dirs_m.iter();
        let dirs = dirs.flat_map(|dirs| of_parts(dirs));
        let mut build = Self {
            thickness_dirs_m: dirs.collect(),
            thickness_m: thickness_m.collect(),
            shape_range: [(-10.0, 10.0); SHAPE_COUNT],
            scale: Vec::new(),
        };
        build.scale = vec![1.0; build.count()];
        build
    }

    /// How many numbers the predictor hears.
    pub fn count(&self) -> usize {
        MATERIAL_COUNT + SHAPE_COUNT + self.thickness_m.len()
    }

    /// Whether the block that belongs to `region` hears the number `index`; a block of no region
    /// hears all.
    pub fn is_heard(&self, index: usize, region: Option<usize>) -> bool {
        let Some(region) = region else { return true };
        match index.checked_sub(MATERIAL_COUNT) {
            None => index % REGION_COUNT == region,
            Some(index) => match index.checked_sub(SHAPE_COUNT) {
                None => true,
                Some(index) => index / PARTS == region,
            },
        }
    }

    /// Sets range and scale by the bodies learned from, each `[materials, β]`, so that numbers come
    /// out with deviations of 1 about 0, those of β with `shape_loudness`.
    pub fn fit<'a>(&mut self, bodies: impl Iterator<Item = &'a [f32]>, shape_loudness: f32) {
        self.scale.fill(1.0);
        self.shape_range = [(f32::MAX, f32::MIN); SHAPE_COUNT];
        let mut squares = vec![0.0; self.count()];
        let mut bodies_seen = 0;
        for body in bodies {
            for ((least, most), beta) in self.shape_range.iter_mut().zip(&body[MATERIAL_COUNT..]) {
                (*least, *most) = (least.min(*beta), most.max(*beta));
            }
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
        for scale in &mut self.scale[MATERIAL_COUNT..MATERIAL_COUNT + SHAPE_COUNT] {
            *scale *= shape_loudness;
        }
    }

    /// What the predictor hears of the body with these features: materials, then β.
    pub fn of(&self, body: &[f32]) -> Vec<f32> {
        let (materials, shape) = body.split_at(MATERIAL_COUNT);
        let within = shape.iter().zip(&self.shape_range);
        let within = within.map(|(beta, (least, most))| beta.max(*least).min(*most));
        let mut heard: Vec<f32> = materials.iter().copied().chain(within).collect();
        for (part, at_zero_m) in self.thickness_m.iter().enumerate() {
            let dirs_m = self.thickness_dirs_m.iter().skip(part);
            let dirs_m = dirs_m.step_by(self.thickness_m.len());
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

/// Weights of the vertices in each part of each region: the vertices that are thicker at β = 0 than
/// the median of their region, counted by weight, and the others.
fn parts(model: &BodyModel) -> Vec<Vec<f32>> {
    let thickness_m = &model.thickness_template_m;
    let mut parts = Vec::new();
    for weights in &model.region_weights {
        let mut order: Vec<usize> = (0..weights.len()).collect();
        order.sort_by(|a, b| thickness_m[*b].total_cmp(&thickness_m[*a]));
        let half = 0.5 * weights.iter().sum::<f32>();
        let (mut thick, mut thin, mut seen) = (weights.clone(), weights.clone(), 0.0);
        for vertex in order {
            // Both halves have a vertex where a region has two.
            let other = if seen < half { &mut thin } else { &mut thick };
            other[vertex] = 0.0;
            seen += weights[vertex];
        }
        parts.extend([thick, thin]);
    }
    parts
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
        assert_eq!(build.count(), 34);
        let thickness = MATERIAL_COUNT + SHAPE_COUNT;
        let mut body = [0.0; MATERIAL_COUNT + SHAPE_COUNT];
        body[2] = -1.0;
        body[MATERIAL_COUNT + 3] = 1.0;
        let heard = build.of(&body);
        assert_eq!(heard[2], -1.0);
        assert_eq!(heard[MATERIAL_COUNT + 3], 1.0);
        // Each region has one vertex here, which is its thicker half.
        for (region, numbers) in heard[thickness..].chunks(PARTS).enumerate() {
            let expected = if region % vertices == 1 {
                2f32.ln()
            } else {
                0.0
            };
            assert!(
                (numbers[0] - expected).abs() < 1e-6 && numbers[1] == 0.0,
                "region {region}: {numbers:?}"
            );
        }
        body[MATERIAL_COUNT + 3] = -50.0;
        let least = (LEAST_THICKNESS_M / 0.02).ln();
        assert!((build.of(&body)[thickness + PARTS] - least).abs() < 1e-6);
    }

    #[test]
    fn the_halves_of_a_region_are_its_thick_and_its_thin_vertices() {
        let mut model = fixture::symmetric_body(4);
        let vertices = model.vertex_count();
        model.region_weights = vec![vec![0.0; vertices]; REGION_COUNT];
        model.region_weights[0][..4].fill(1.0);
        model.thickness_template_m = vec![0.01; vertices];
        model.thickness_template_m[..4].copy_from_slice(&[0.02, 0.05, 0.03, 0.04]);
        model.thickness_shape_dirs_m = vec![vec![0.0; vertices]; SHAPE_COUNT];
        let build = Build::of_body(&model);
        assert!((build.thickness_m[0] - 0.045).abs() < 1e-6);
        assert!((build.thickness_m[1] - 0.025).abs() < 1e-6);
    }

    #[test]
    fn blocks_hear_their_own_region_and_the_shape() {
        let build = Build {
            thickness_m: vec![0.02; PARTS * REGION_COUNT],
            thickness_dirs_m: vec![0.0; PARTS * REGION_COUNT * SHAPE_COUNT],
            shape_range: [(-2.0, 2.0); SHAPE_COUNT],
            scale: vec![1.0; 34],
        };
        let heard: Vec<usize> = (0..34).filter(|i| build.is_heard(*i, Some(1))).collect();
        let shape = MATERIAL_COUNT..MATERIAL_COUNT + SHAPE_COUNT;
        let expected: Vec<usize> = [1, 7].into_iter().chain(shape).chain([24, 25]).collect();
        assert_eq!(heard, expected);
        assert!((0..34).all(|index| build.is_heard(index, None)));
    }

    #[test]
    fn bodies_learned_from_give_the_scale_and_the_range() {
        let mut build = Build::of_body(&fixture::symmetric_body(4));
        let bodies: Vec<Vec<f32>> = [-2.0f32, 2.0]
            .map(|number| vec![number; MATERIAL_COUNT + SHAPE_COUNT])
            .into();
        build.fit(bodies.iter().map(Vec::as_slice), 0.5);
        assert!(
            build.of(&bodies[1])[..MATERIAL_COUNT]
                .iter()
                .all(|n| (n - 1.0).abs() < 1e-6)
        );
        let shape = MATERIAL_COUNT..MATERIAL_COUNT + SHAPE_COUNT;
        assert!(
            build.of(&bodies[1])[shape]
                .iter()
                .all(|n| (n - 0.5).abs() < 1e-6)
        );
        let beyond = vec![5.0; MATERIAL_COUNT + SHAPE_COUNT];
        let shape = MATERIAL_COUNT..MATERIAL_COUNT + SHAPE_COUNT;
        assert_eq!(
            build.of(&beyond)[shape.clone()],
            build.of(&bodies[1])[shape]
        );
    }
}
