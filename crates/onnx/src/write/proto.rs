//! Protobuf messages of an ONNX file.

use crate::messages::{
    Attribute, Dimension, FLOAT, GraphMessage, INT, INTS, Length, Model, OperatorSet,
    TensorMessage, TensorShape, TensorType, TypeMessage, ValueInfo,
};

/// Operator set of the files: the newest that takes `Split` without `num_outputs`, and inside the
/// range that tract and onnxruntime-web test.
const OPERATOR_SET: i64 = 17;

/// IR version that came with operator set 17.
const IR_VERSION: i64 = 8;

pub(super) fn model(graph: GraphMessage) -> Model {
    Model {
        ir_version: IR_VERSION,
        opset_import: vec![OperatorSet {
            domain: String::new(),
            version: OPERATOR_SET,
        }],
        producer_name: b"dynaskin".to_vec(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        graph: Some(graph),
    }
}

pub(super) fn value_info(name: &str, shape: &[usize]) -> ValueInfo {
    let dim = shape.iter().map(|&length| Dimension {
        value: Some(Length::Fixed(length as i64)),
    });
    let tensor = TensorType {
        elem_type: FLOAT,
        shape: Some(TensorShape { dim: dim.collect() }),
    };
    ValueInfo {
        name: name.to_owned(),
        r#type: Some(TypeMessage {
            tensor_type: Some(tensor),
        }),
    }
}

/// A tensor of little-endian `raw` numbers.
pub(super) fn tensor(name: &str, shape: &[usize], kind: i32, raw: Vec<u8>) -> TensorMessage {
    TensorMessage {
        name: name.to_owned(),
        dims: shape.iter().map(|&length| length as i64).collect(),
        data_type: kind,
        raw_data: raw,
        ..Default::default()
    }
}

pub(super) fn int_attribute(name: &str, number: i64) -> Attribute {
    Attribute {
        name: name.to_owned(),
        kind: INT,
        i: number,
        ..Default::default()
    }
}

pub(super) fn ints_attribute(name: &str, numbers: &[usize]) -> Attribute {
    Attribute {
        name: name.to_owned(),
        kind: INTS,
        ints: numbers.iter().map(|&number| number as i64).collect(),
        ..Default::default()
    }
}
