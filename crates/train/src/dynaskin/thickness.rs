//! Thickness of the tissue of each part of the body, an input where no compliance is known.

use dynaskin_body::{BodyModel, LEAST_THICKNESS_M, SHAPE_COUNT};
use dynaskin_onnx::{Graph, Precision, Value, WriteError};
use serde::{Deserialize, Serialize};

/// The natural logarithm of the mean thickness of each part of each region, over that at β = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thickness {
    /// At β = 0 in metres, `[region][part]` flat.
    at_zero_m: Vec<f32>,
    /// Change in metres per standard deviation, `[coefficient][region][part]` flat.
    dirs_m: Vec<f32>,
}

impl Thickness {
    /// Of the body `model`; none where it knows no thickness.
    pub(super) fn of_body(model: &BodyModel) -> Option<Self> {
        let parts = model.region_parts();
        if parts.is_empty() || model.thickness_shape_dirs_m.len() != SHAPE_COUNT {
            return None;
        }
        let of_parts = |thickness: &[f32]| {
            let mean = |weights: &Vec<f32>| {
                let sum: f32 = thickness.iter().zip(weights).map(|(t, w)| t * w).sum();
                sum / weights.iter().sum::<f32>().max(f32::MIN_POSITIVE)
            };
            parts.iter().map(mean).collect::<Vec<f32>>()
        };
        // A region that the body does not have is thin and stays so.
        let at_zero_m = of_parts(&model.thickness_template_m);
        let at_zero_m = at_zero_m.into_iter().map(|t| t.max(LEAST_THICKNESS_M));
        let dirs = model.thickness_shape_dirs_m.iter();
        Some(Self {
            at_zero_m: at_zero_m.collect(),
            dirs_m: dirs.flat_map(|dirs| of_parts(dirs)).collect(),
        })
    }

    /// How many numbers it tells.
    pub(super) fn count(&self) -> usize {
        self.at_zero_m.len()
    }

    /// The numbers of the body with this β.
    pub(super) fn of(&self, shape: &[f32]) -> Vec<f32> {
        let of_part = |(part, at_zero_m): (usize, &f32)| {
            let dirs_m = self.dirs_m.iter().skip(part).step_by(self.count());
            let change_m: f32 = dirs_m.zip(shape).map(|(dir, beta)| dir * beta).sum();
            ((at_zero_m + change_m).max(LEAST_THICKNESS_M) / at_zero_m).ln()
        };
        self.at_zero_m.iter().enumerate().map(of_part).collect()
    }

    /// The same in a graph, from β `[1,10]`.
    pub(super) fn write(&self, graph: &mut Graph, shape: &Value) -> Result<Value, WriteError> {
        let count = self.count();
        let single = Precision::Single;
        let dirs = graph.weights(
            "thickness_dirs",
            &[SHAPE_COUNT, count],
            &self.dirs_m,
            single,
        )?;
        // max(t, least) = relu(t - least) + least
        let above: Vec<f32> = self
            .at_zero_m
            .iter()
            .map(|t| t - LEAST_THICKNESS_M)
            .collect();
        let above = graph.weights("thickness", &[count], &above, single)?;
        let least = vec![LEAST_THICKNESS_M; count];
        let least = graph.weights("least_thickness", &[count], &least, single)?;
        let at_zero: Vec<f32> = self.at_zero_m.iter().map(|t| t.ln()).collect();
        let at_zero = graph.weights("log_thickness", &[count], &at_zero, single)?;
        let thickness = graph.dense(shape, &dirs, &above)?;
        let thickness = graph.relu(&thickness);
        let thickness = graph.add(&thickness, &least)?;
        let thickness = graph.log(&thickness);
        graph.sub(&thickness, &at_zero)
    }
}

#[cfg(test)]
mod tests {
    use dynaskin_body::{PARTS, REGION_COUNT};

    use super::*;
    use crate::fixture;

    #[test]
    fn it_is_the_parts_own_and_has_a_floor() {
        let mut model = fixture::symmetric_body(4);
        let vertices = model.vertex_count();
        model.region_weights = vec![vec![0.0; vertices]; REGION_COUNT];
        for region in 0..REGION_COUNT {
            model.region_weights[region][region % vertices] = 1.0;
        }
        model.thickness_template_m = (0..vertices).map(|v| 0.01 * (v + 1) as f32).collect();
        model.thickness_shape_dirs_m = vec![vec![0.0; vertices]; SHAPE_COUNT];
        model.thickness_shape_dirs_m[3][1] = 0.02;
        let thickness = Thickness::of_body(&model).expect("thickness");
        assert_eq!(thickness.count(), 12);
        let mut shape = [0.0; SHAPE_COUNT];
        shape[3] = 1.0;
        // Each region has one vertex here, which is its thicker half.
        for (region, numbers) in thickness.of(&shape).chunks(PARTS).enumerate() {
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
        shape[3] = -50.0;
        let least = (LEAST_THICKNESS_M / 0.02).ln();
        assert!((thickness.of(&shape)[PARTS] - least).abs() < 1e-6);
    }
}
