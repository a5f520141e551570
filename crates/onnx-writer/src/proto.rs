//! Protobuf messages of an ONNX file.

use tract_onnx::pb;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::type_proto;

/// Operator set of the files: the newest that takes `Split` without `num_outputs`, and inside the
/// range that tract and onnxruntime-web test.
const OPERATOR_SET: i64 = 17;

/// IR version that came with operator set 17.
const IR_VERSION: i64 = 8;

pub(crate) fn model(graph: pb::GraphProto) -> pb::ModelProto {
    pb::ModelProto {
        ir_version: IR_VERSION,
        opset_import: vec![pb::OperatorSetIdProto {
            domain: String::new(),
            version: OPERATOR_SET,
        }],
        producer_name: "dynaskin".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        graph: Some(graph),
        ..Default::default()
    }
}

pub(crate) fn value_info(name: &str, shape: &[usize]) -> pb::ValueInfoProto {
    let dim = shape.iter().map(|&length| Dimension {
        value: Some(dimension::Value::DimValue(length as i64)),
        ..Default::default()
    });
    let tensor = type_proto::Tensor {
        elem_type: DataType::Float as i32,
        shape: Some(pb::TensorShapeProto { dim: dim.collect() }),
    };
    pb::ValueInfoProto {
        name: name.to_owned(),
        r#type: Some(pb::TypeProto {
            value: Some(type_proto::Value::TensorType(tensor)),
            ..Default::default()
        }),
        ..Default::default()
    }
}

/// A tensor of little-endian `raw` numbers.
pub(crate) fn tensor(name: &str, shape: &[usize], kind: DataType, raw: Vec<u8>) -> pb::TensorProto {
    pb::TensorProto {
        name: name.to_owned(),
        dims: shape.iter().map(|&length| length as i64).collect(),
        data_type: kind as i32,
        raw_data: raw,
        ..Default::default()
    }
}

pub(crate) fn int_attribute(name: &str, number: i64) -> pb::AttributeProto {
    pb::AttributeProto {
        name: name.to_owned(),
        r#type: AttributeType::Int as i32,
        i: number,
        ..Default::default()
    }
}

pub(crate) fn ints_attribute(name: &str, numbers: &[usize]) -> pb::AttributeProto {
    pb::AttributeProto {
        name: name.to_owned(),
        r#type: AttributeType::Ints as i32,
        ints: numbers.iter().map(|&number| number as i64).collect(),
        ..Default::default()
    }
}
