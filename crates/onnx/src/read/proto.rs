//! The protobuf layer: decoding, and tensors with checked sizes.

use tract_core::prelude::f16;

use super::entries;
use super::error::{ReadError, invalid};
use crate::messages::{EXTERNAL, FLOAT, FLOAT16, GraphMessage, INT64, Model, TensorMessage};

/// Operator sets whose definitions of the operators are the ones implemented: from 13 on
/// `Split` takes its lengths as an input; 23 was the newest when this was written.
const OPERATOR_SETS: std::ops::RangeInclusive<i64> = 13..=23;

/// Largest number of elements of one value: 64 MiB in single precision.
const MAX_ELEMENTS: usize = 1 << 24;

/// Largest number of elements of an initialiser, all of which are in the file: 256 MiB in single precision. The
/// last layer of Casas & Otaduy's decoder of the published size has 62 million over 6,890 vertices.
const MAX_WEIGHTS: usize = 1 << 26;

/// Largest number of axes of one value.
const MAX_AXES: usize = 6;

/// The numbers of an initialiser.
#[derive(Debug)]
pub(super) enum Numbers {
    Single(Vec<f32>),
    /// Half-precision weights, already widened.
    Half(Vec<f32>),
    Integers(Vec<i64>),
}

/// Decodes the file as far as its graph.
pub(super) fn decode(onnx_bytes: &[u8]) -> Result<GraphMessage, ReadError> {
    let not_onnx = |reason: String| ReadError::NotOnnx { reason };
    entries::check(onnx_bytes)?;
    let model = Model::from_bytes(onnx_bytes).map_err(|error| not_onnx(error.to_string()))?;
    let graph = model
        .graph
        .ok_or_else(|| not_onnx(format!("no graph in its {} bytes", onnx_bytes.len())))?;
    let set = model
        .opset_import
        .iter()
        .find(|set| set.domain.is_empty() || set.domain == "ai.onnx")
        .map(|set| set.version);
    match set {
        Some(version) if OPERATOR_SETS.contains(&version) => Ok(graph),
        _ => Err(invalid(
            "opset_import",
            format!("the operator set is {set:?}, expected {OPERATOR_SETS:?}"),
        )),
    }
}

/// The shape `dims`, refused where it is negative, empty or larger than [`MAX_ELEMENTS`].
pub(super) fn shape(name: &str, dims: &[i64]) -> Result<Vec<usize>, ReadError> {
    shape_up_to(MAX_ELEMENTS, name, dims)
}

fn shape_up_to(most: usize, name: &str, dims: &[i64]) -> Result<Vec<usize>, ReadError> {
    let elements = dims.iter().try_fold(1_usize, |product, &length| {
        let length = usize::try_from(length).ok().filter(|&length| length > 0)?;
        product.checked_mul(length).filter(|&p| p <= most)
    });
    if elements.is_none() || dims.len() > MAX_AXES {
        let problem = format!(
            "the shape is {dims:?}, expected at most {MAX_AXES} axes of fixed length above 0 with \
             at most {most} elements in all"
        );
        return Err(invalid(name, problem));
    }
    Ok(dims.iter().map(|&length| length as usize).collect())
}

/// The shape and the numbers of an initialiser.
pub(super) fn numbers(tensor: &TensorMessage) -> Result<(Vec<usize>, Numbers), ReadError> {
    let shape = shape_up_to(MAX_WEIGHTS, &tensor.name, &tensor.dims)?;
    let problem = |text: String| invalid(tensor.name.as_str(), text);
    if tensor.data_location == EXTERNAL {
        return Err(problem(
            "its numbers lie in another file; store them in the .onnx file".to_owned(),
        ));
    }
    let count = shape.iter().product::<usize>();
    let raw = &tensor.raw_data[..];
    let numbers = match tensor.data_type {
        FLOAT if raw.is_empty() => Numbers::Single(tensor.float_data.clone()),
        FLOAT => Numbers::Single(from_raw(raw, f32::from_le_bytes)),
        FLOAT16 if raw.is_empty() => Numbers::Half(
            tensor
                .int32_data
                .iter()
                .map(|&bits| f16::from_bits(bits as u16).to_f32())
                .collect(),
        ),
        FLOAT16 => Numbers::Half(from_raw(raw, |bytes| f16::from_le_bytes(bytes).to_f32())),
        INT64 if raw.is_empty() => Numbers::Integers(tensor.int64_data.clone()),
        INT64 => Numbers::Integers(from_raw(raw, i64::from_le_bytes)),
        _ => {
            return Err(problem(format!(
                "its data type is {}, expected FLOAT (1), FLOAT16 (10) or INT64 (7)",
                tensor.data_type
            )));
        }
    };
    let (got, finite, number_bytes) = match &numbers {
        Numbers::Single(list) => (list.len(), list.iter().all(|n| n.is_finite()), 4),
        Numbers::Half(list) => (list.len(), list.iter().all(|n| n.is_finite()), 2),
        Numbers::Integers(list) => (list.len(), true, 8),
    };
    if got != count || !raw.len().is_multiple_of(number_bytes) {
        return Err(problem(format!(
            "its shape {shape:?} asks for {count} numbers, the file holds {got}"
        )));
    }
    if !finite {
        return Err(problem("it holds NaN or an infinite number".to_owned()));
    }
    Ok((shape, numbers))
}

/// Little-endian numbers of `N` bytes each; a rest is left out.
fn from_raw<const N: usize, T>(raw: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    raw.as_chunks::<N>().0.iter().copied().map(number).collect()
}
