//! The predictor's inputs about a body: its materials, and the compliance of its tissue.
//!
//! β has ten coefficients, and a data set has few shapes in comparison: a network conditioned on β alone
//! fits these few and fails on others. A region's swing depends on its compliance: few numbers,
//! which few shapes cover well. So each block is conditioned on the logarithm of the
//! compliance of two parts of its own region: the thicker half (of the chest: the breasts) and the thinner.
//! It is conditioned on its own materials as well. If the data set has no compliance, thickness replaces
//! it (`f = sqrt(G / rho) / (4 h)`). β itself is an input, too, clamped to the range of the training
//! data. Its scale relative to the other inputs is a setting: the more shapes the data set has, the more it can
//! be trusted.

use dynaskin_body::{BodyModel, REGION_COUNT, SHAPE_COUNT};
use dynaskin_onnx::{Graph, Value, WriteError};
use dynaskin_runtime::features::MATERIAL_COUNT;
use dynaskin_sim::{COMPLIANCE_COUNT, ComplianceTable};
use serde::{Deserialize, Serialize};

use super::clamped::clamped;
use super::compliance::Compliance;
use super::thickness::Thickness;

/// Below this deviation a number counts as constant and is not blown up.
const SMALLEST_DEVIATION: f32 = 0.1;

/// What is told about the tissue of each part of each region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TissueMeasure {
    /// Nothing: of such bodies only β is known.
    Unknown,
    /// How thick it is.
    Thickness(Thickness),
    /// How far it gives way.
    Compliance(Compliance),
}

impl TissueMeasure {
    fn count(&self) -> usize {
        match self {
            Self::Unknown => 0,
            Self::Thickness(thickness) => thickness.count(),
            Self::Compliance(_) => COMPLIANCE_COUNT,
        }
    }

    fn of(&self, shape: &[f32]) -> Vec<f32> {
        match self {
            Self::Unknown => Vec::new(),
            Self::Thickness(thickness) => thickness.of(shape),
            Self::Compliance(compliance) => compliance.of(shape),
        }
    }

    fn write(&self, graph: &mut Graph, shape: &Value) -> Result<Option<Value>, WriteError> {
        Ok(match self {
            Self::Unknown => None,
            Self::Thickness(thickness) => Some(thickness.write(graph, shape)?),
            Self::Compliance(compliance) => Some(compliance.write(graph, shape)?),
        })
    }
}

/// Turns the features of a body (materials, then β) into the predictor's inputs: the materials
/// (binary logarithms), β within the range learned from, then what is told about the tissue, region by
/// region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Build {
    /// What is told about the tissue.
    pub tissue: TissueMeasure,
    /// The least and the greatest of each coefficient of β among the bodies learned from.
    pub shape_range: [(f32, f32); SHAPE_COUNT],
    /// What each number is multiplied with before it is an input.
    pub scale: Vec<f32>,
}

impl Build {
    /// Of the body `model`, whose compliance `table` tells; nothing is scaled or limited yet.
    pub fn of_body(model: &BodyModel, table: Option<&ComplianceTable>) -> Self {
        let thickness = Thickness::of_body(model);
        let compliance = table.and_then(|table| Compliance::fit(table, thickness.as_ref()));
        let tissue = match (compliance, thickness) {
            (Some(compliance), _) => TissueMeasure::Compliance(compliance),
            (None, Some(thickness)) => TissueMeasure::Thickness(thickness),
            (None, None) => TissueMeasure::Unknown,
        };
        let mut build = Self {
            tissue,
            shape_range: [(-10.0, 10.0); SHAPE_COUNT],
            scale: Vec::new(),
        };
        build.scale = vec![1.0; build.count()];
        build
    }

    /// Number of inputs.
    pub fn count(&self) -> usize {
        MATERIAL_COUNT + SHAPE_COUNT + self.tissue.count()
    }

    /// Whether the block that belongs to `region` is conditioned on input `index`; a block of no region
    /// is on all.
    pub fn is_connected(&self, index: usize, region: Option<usize>) -> bool {
        let Some(region) = region else { return true };
        match index.checked_sub(MATERIAL_COUNT) {
            None => index % REGION_COUNT == region,
            Some(index) => match index.checked_sub(SHAPE_COUNT) {
                None => true,
                Some(index) => index * REGION_COUNT / self.tissue.count() == region,
            },
        }
    }

    /// Sets range and scale by the bodies learned from, each `[materials, β]`, so that numbers come
    /// out with deviations of 1 about 0, those of β with `shape_scale`.
    pub fn fit<'a>(&mut self, bodies: impl Iterator<Item = &'a [f32]>, shape_scale: f32) {
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
            *scale *= shape_scale;
        }
    }

    /// The inputs from the body with these features: materials, then β.
    pub fn of(&self, body: &[f32]) -> Vec<f32> {
        let (materials, shape) = body.split_at(MATERIAL_COUNT);
        let within = shape.iter().zip(&self.shape_range);
        let within = within.map(|(beta, (least, most))| beta.max(*least).min(*most));
        let mut inputs: Vec<f32> = materials.iter().copied().chain(within).collect();
        inputs.extend(self.tissue.of(shape));
        for (number, scale) in inputs.iter_mut().zip(&self.scale) {
            *number *= scale;
        }
        inputs
    }

    /// The same in a graph but for the scale, from `[1, materials + β]`.
    pub(super) fn write(&self, graph: &mut Graph, body: &Value) -> Result<Value, WriteError> {
        let parts = graph.split(body, 1, &[MATERIAL_COUNT, SHAPE_COUNT])?;
        let within = clamped(graph, "shape", &parts[1], &self.shape_range)?;
        match self.tissue.write(graph, &parts[1])? {
            None => graph.concat(&[&parts[0], &within], 1),
            Some(tissue) => graph.concat(&[&parts[0], &within, &tissue], 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn blocks_are_conditioned_on_their_own_region_and_the_shape() {
        let build = Build::of_body(&fixture::symmetric_body(4), None);
        assert_eq!(build.count(), 34);
        let connected: Vec<usize> = (0..34)
            .filter(|i| build.is_connected(*i, Some(1)))
            .collect();
        let shape = MATERIAL_COUNT..MATERIAL_COUNT + SHAPE_COUNT;
        let expected: Vec<usize> = [1, 7].into_iter().chain(shape).chain([24, 25]).collect();
        assert_eq!(connected, expected);
        assert!((0..34).all(|index| build.is_connected(index, None)));
    }

    #[test]
    fn bodies_learned_from_give_the_scale_and_the_range() {
        let mut build = Build::of_body(&fixture::symmetric_body(4), None);
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
            build.of(&bodies[1])[shape.clone()]
                .iter()
                .all(|n| (n - 0.5).abs() < 1e-6)
        );
        let beyond = vec![5.0; MATERIAL_COUNT + SHAPE_COUNT];
        assert_eq!(
            build.of(&beyond)[shape.clone()],
            build.of(&bodies[1])[shape]
        );
    }
}
