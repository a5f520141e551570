//! The messages of the ONNX format (`onnx.proto3` of the ONNX project), as far as graphs of the
//! contract use them; other fields are skipped when a file is decoded.
//!
//! Declared here and not taken from tract-onnx, whose dependencies alone would double the time to
//! build for the browser. Reader and writer share them; what the fields mean stands in ONNX's own
//! definition. Labels that the reader does not look at are bytes, so that it takes them as they come.

#![allow(missing_docs)] // The fields carry ONNX's names.

use prost::{DecodeError, Message, Oneof};

/// `AttributeProto.AttributeType`: an integer.
pub const INT: i32 = 2;
/// `AttributeProto.AttributeType`: integers.
pub const INTS: i32 = 7;
/// `TensorProto.DataType`: single precision.
pub const FLOAT: i32 = 1;
/// `TensorProto.DataType`: 64-bit integers.
pub const INT64: i32 = 7;
/// `TensorProto.DataType`: half precision.
pub const FLOAT16: i32 = 10;
/// `TensorProto.DataLocation`: the numbers lie in another file.
pub const EXTERNAL: i32 = 1;

/// `ModelProto`: the file.
#[derive(Clone, PartialEq, Message)]
pub struct Model {
    #[prost(int64, tag = "1")]
    pub ir_version: i64,
    #[prost(bytes = "vec", tag = "2")]
    pub producer_name: Vec<u8>,
    #[prost(bytes = "vec", tag = "3")]
    pub producer_version: Vec<u8>,
    #[prost(message, optional, tag = "7")]
    pub graph: Option<GraphMessage>,
    #[prost(message, repeated, tag = "8")]
    pub opset_import: Vec<OperatorSet>,
}

impl Model {
    /// Decodes a file. Unlike [`crate::read`] it counts nothing first.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn from_bytes(onnx_bytes: &[u8]) -> Result<Self, DecodeError> {
        Self::decode(onnx_bytes)
    }

    /// The file.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.encode_to_vec()
    }
}

/// `OperatorSetIdProto`.
#[derive(Clone, PartialEq, Message)]
pub struct OperatorSet {
    #[prost(string, tag = "1")]
    pub domain: String,
    #[prost(int64, tag = "2")]
    pub version: i64,
}

/// `GraphProto`.
#[derive(Clone, PartialEq, Message)]
pub struct GraphMessage {
    #[prost(message, repeated, tag = "1")]
    pub node: Vec<NodeMessage>,
    #[prost(bytes = "vec", tag = "2")]
    pub name: Vec<u8>,
    #[prost(message, repeated, tag = "5")]
    pub initializer: Vec<TensorMessage>,
    #[prost(message, repeated, tag = "11")]
    pub input: Vec<ValueInfo>,
    #[prost(message, repeated, tag = "12")]
    pub output: Vec<ValueInfo>,
}

/// `NodeProto`.
#[derive(Clone, PartialEq, Message)]
pub struct NodeMessage {
    #[prost(string, repeated, tag = "1")]
    pub input: Vec<String>,
    #[prost(string, repeated, tag = "2")]
    pub output: Vec<String>,
    #[prost(string, tag = "3")]
    pub name: String,
    #[prost(string, tag = "4")]
    pub op_type: String,
    #[prost(message, repeated, tag = "5")]
    pub attribute: Vec<Attribute>,
    #[prost(string, tag = "7")]
    pub domain: String,
}

/// `AttributeProto`, with the three kinds of value that the operators have.
#[derive(Clone, PartialEq, Message)]
pub struct Attribute {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(float, tag = "2")]
    pub f: f32,
    #[prost(int64, tag = "3")]
    pub i: i64,
    #[prost(int64, repeated, tag = "8")]
    pub ints: Vec<i64>,
    #[prost(int32, tag = "20")]
    pub kind: i32,
}

/// `TensorProto`.
#[derive(Clone, PartialEq, Message)]
pub struct TensorMessage {
    #[prost(int64, repeated, tag = "1")]
    pub dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    pub data_type: i32,
    #[prost(float, repeated, tag = "4")]
    pub float_data: Vec<f32>,
    #[prost(int32, repeated, tag = "5")]
    pub int32_data: Vec<i32>,
    #[prost(int64, repeated, tag = "7")]
    pub int64_data: Vec<i64>,
    #[prost(string, tag = "8")]
    pub name: String,
    #[prost(bytes = "vec", tag = "9")]
    pub raw_data: Vec<u8>,
    #[prost(int32, tag = "14")]
    pub data_location: i32,
}

/// `ValueInfoProto`.
#[derive(Clone, PartialEq, Message)]
pub struct ValueInfo {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(message, optional, tag = "2")]
    pub r#type: Option<TypeMessage>,
}

/// `TypeProto`, with the one kind of type that the contract has.
#[derive(Clone, PartialEq, Message)]
pub struct TypeMessage {
    #[prost(message, optional, tag = "1")]
    pub tensor_type: Option<TensorType>,
}

/// `TypeProto.Tensor`.
#[derive(Clone, PartialEq, Message)]
pub struct TensorType {
    #[prost(int32, tag = "1")]
    pub elem_type: i32,
    #[prost(message, optional, tag = "2")]
    pub shape: Option<TensorShape>,
}

/// `TensorShapeProto`.
#[derive(Clone, PartialEq, Message)]
pub struct TensorShape {
    #[prost(message, repeated, tag = "1")]
    pub dim: Vec<Dimension>,
}

/// `TensorShapeProto.Dimension`.
#[derive(Clone, PartialEq, Message)]
pub struct Dimension {
    #[prost(oneof = "Length", tags = "1, 2")]
    pub value: Option<Length>,
}

/// The length of an axis.
#[derive(Clone, PartialEq, Oneof)]
pub enum Length {
    /// A fixed length.
    #[prost(int64, tag = "1")]
    Fixed(i64),
    /// A named length, unknown in the file.
    #[prost(string, tag = "2")]
    Named(String),
}

/// What a field adds to a file's lists, for the count before decoding: an entry of a list that grows
/// in memory more than in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Entries {
    /// A message, with its own fields.
    Message(&'static [(u64, Entries)]),
    /// A node of the graph.
    Node,
    /// An initialiser.
    Initializer,
    /// A message of another list.
    Listed(&'static [(u64, Entries)]),
    /// A name of a list.
    Name,
    /// Integers, alone or packed.
    Integers,
}

/// Lists of [`Model`] and of what is in it, by field; held to the definitions by a test.
pub(crate) const MODEL: &[(u64, Entries)] =
    &[(7, Entries::Message(GRAPH)), (8, Entries::Listed(&[]))];

const GRAPH: &[(u64, Entries)] = &[
    (1, Entries::Node),
    (5, Entries::Initializer),
    (11, Entries::Listed(VALUE_INFO)),
    (12, Entries::Listed(VALUE_INFO)),
];

pub(crate) const NODE: &[(u64, Entries)] = &[
    (1, Entries::Name),
    (2, Entries::Name),
    (5, Entries::Listed(ATTRIBUTE)),
];

const ATTRIBUTE: &[(u64, Entries)] = &[(8, Entries::Integers)];

/// Without the numbers, which the shape's limit bounds.
pub(crate) const TENSOR: &[(u64, Entries)] = &[(1, Entries::Integers)];

/// Down to the lengths of the axes.
const VALUE_INFO: &[(u64, Entries)] = &[(
    2,
    Entries::Message(&[(
        1,
        Entries::Message(&[(2, Entries::Message(&[(1, Entries::Listed(&[]))]))]),
    )]),
)];
