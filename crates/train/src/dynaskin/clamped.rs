//! β clamped to the range of the training data, as a graph.

use dynaskin_body::SHAPE_COUNT;
use dynaskin_onnx::{Graph, Precision, Value, WriteError};

/// β `[1,10]` within `range`: `β + relu(least - β) - relu(β - most)`.
pub(super) fn clamped(
    graph: &mut Graph,
    name: &str,
    shape: &Value,
    range: &[(f32, f32); SHAPE_COUNT],
) -> Result<Value, WriteError> {
    let (least, most): (Vec<f32>, Vec<f32>) = range.iter().copied().unzip();
    let (single, size) = (Precision::Single, [1, SHAPE_COUNT]);
    let least = graph.weights(&format!("least_{name}"), &size, &least, single)?;
    let most = graph.weights(&format!("greatest_{name}"), &[SHAPE_COUNT], &most, single)?;
    let below = graph.sub(&least, shape)?;
    let below = graph.relu(&below);
    let beyond = graph.sub(shape, &most)?;
    let beyond = graph.relu(&beyond);
    let within = graph.add(shape, &below)?;
    graph.sub(&within, &beyond)
}
