//! The graph under construction and its elementary operations.

use std::collections::HashSet;

use tract_core::prelude::f16;

use super::{WriteError, proto};
use crate::messages::{Attribute, FLOAT, FLOAT16, GraphMessage, INT64, NodeMessage};

/// A value of the graph: an input, a weight or the result of an operation. All are single
/// precision when computed with.
#[derive(Clone, Debug)]
pub struct Value {
    name: String,
    shape: Vec<usize>,
}

impl Value {
    /// Shape of the value.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }
}

/// How weights are stored in the file. They are computed with in single precision either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 4 bytes a number.
    Single,
    /// 2 bytes a number, followed by a `Cast` to single precision.
    Half,
    /// Like `Half`, with numbers rounded to 8 significant bits (of 11). They take as many bytes in the file and
    /// 15 % fewer once it is compressed.
    ShortHalf,
}

impl Precision {
    /// A number as it is stored.
    fn half(self, number: f32) -> f16 {
        let half = f16::from_f32(number);
        match self {
            Self::ShortHalf if half.is_finite() => {
                // To the nearest, away from zero at a tie; a carry goes on into the exponent.
                let bits = half.to_bits();
                let rounded =
                    f16::from_bits((bits + (1 << (DROPPED_BITS - 1))) & !((1 << DROPPED_BITS) - 1));
                // The largest numbers would become infinite.
                if rounded.is_finite() { rounded } else { half }
            }
            _ => half,
        }
    }
}

/// Bits of the mantissa that [`Precision::ShortHalf`] leaves out.
const DROPPED_BITS: u32 = 3;

/// An ONNX graph under construction: operator set 17, IR version 8.
#[derive(Debug)]
pub struct Graph {
    proto: GraphMessage,
    names: HashSet<String>,
}

impl Graph {
    /// An empty graph called `name`.
    pub fn new(name: &str) -> Self {
        Self {
            proto: GraphMessage {
                name: name.into(),
                ..Default::default()
            },
            names: HashSet::new(),
        }
    }

    /// A graph input of single-precision numbers.
    ///
    /// # Errors
    /// [`WriteError::DuplicateName`].
    pub fn input(&mut self, name: &str, shape: &[usize]) -> Result<Value, WriteError> {
        self.claim(name)?;
        self.proto.input.push(proto::value_info(name, shape));
        Ok(value(name, shape))
    }

    /// Makes `source` a graph output called `name`.
    ///
    /// # Errors
    /// [`WriteError::DuplicateName`].
    pub fn output(&mut self, name: &str, source: &Value) -> Result<(), WriteError> {
        self.claim(name)?;
        self.push("Identity", &[source], &[name], Vec::new());
        self.proto
            .output
            .push(proto::value_info(name, &source.shape));
        Ok(())
    }

    /// Weights (an initialiser) of the given `shape`, row-major.
    ///
    /// # Errors
    /// [`WriteError::WeightCount`], [`WriteError::WeightValue`] for numbers that are not finite in
    /// the chosen precision, [`WriteError::DuplicateName`].
    pub fn weights(
        &mut self,
        name: &str,
        shape: &[usize],
        numbers: &[f32],
        precision: Precision,
    ) -> Result<Value, WriteError> {
        let expected = shape.iter().product();
        if numbers.len() != expected {
            return Err(WriteError::WeightCount {
                name: name.to_owned(),
                shape: shape.to_vec(),
                expected,
                got: numbers.len(),
            });
        }
        let storable = |number: f32| match precision {
            Precision::Single => number.is_finite(),
            Precision::Half | Precision::ShortHalf => precision.half(number).is_finite(),
        };
        if let Some(index) = numbers.iter().position(|number| !storable(*number)) {
            return Err(WriteError::WeightValue {
                name: name.to_owned(),
                index,
                value: numbers[index],
            });
        }
        self.claim(name)?;
        match precision {
            Precision::Single => {
                let raw = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
                let tensor = proto::tensor(name, shape, FLOAT, raw);
                self.proto.initializer.push(tensor);
                Ok(value(name, shape))
            }
            Precision::Half | Precision::ShortHalf => {
                let raw = numbers
                    .iter()
                    .flat_map(|n| precision.half(*n).to_le_bytes())
                    .collect();
                let tensor = proto::tensor(name, shape, FLOAT16, raw);
                self.proto.initializer.push(tensor);
                let to = proto::int_attribute("to", i64::from(FLOAT));
                Ok(self.apply("Cast", &[&value(name, shape)], shape.to_vec(), vec![to]))
            }
        }
    }

    /// `x · weight + bias` (ONNX `Gemm`): `x` [N, inputs], `weight` [inputs, outputs] (burn's
    /// layout of a linear layer), `bias` `[outputs]`; gives [N, outputs].
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn dense(&mut self, x: &Value, weight: &Value, bias: &Value) -> Result<Value, WriteError> {
        match (&x.shape[..], &weight.shape[..], &bias.shape[..]) {
            ([n, inputs], [rows, outputs], [biases]) if inputs == rows && outputs == biases => {
                Ok(self.apply("Gemm", &[x, weight, bias], vec![*n, *outputs], Vec::new()))
            }
            _ => Err(mismatch(
                "Gemm",
                "[N, inputs], [inputs, outputs] and [outputs]",
                &[x, weight, bias],
            )),
        }
    }

    /// Matrix product of `a` [N, K] and `b` [K, M]; gives [N, M].
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn matmul(&mut self, a: &Value, b: &Value) -> Result<Value, WriteError> {
        match (&a.shape[..], &b.shape[..]) {
            ([n, k], [rows, m]) if k == rows => {
                Ok(self.apply("MatMul", &[a, b], vec![*n, *m], Vec::new()))
            }
            _ => Err(mismatch("MatMul", "[N, K] and [K, M]", &[a, b])),
        }
    }

    /// `a + b`, element by element; `b`'s shape may be the end of `a`'s.
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn add(&mut self, a: &Value, b: &Value) -> Result<Value, WriteError> {
        self.elementwise("Add", a, b)
    }

    /// `a - b`, element by element; `b`'s shape may be the end of `a`'s.
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn sub(&mut self, a: &Value, b: &Value) -> Result<Value, WriteError> {
        self.elementwise("Sub", a, b)
    }

    /// `a · b`, element by element; `b`'s shape may be the end of `a`'s.
    ///
    /// # Errors
    /// [`WriteError::Shape`].
    pub fn mul(&mut self, a: &Value, b: &Value) -> Result<Value, WriteError> {
        self.elementwise("Mul", a, b)
    }

    /// Logistic function, element by element.
    pub fn sigmoid(&mut self, x: &Value) -> Value {
        self.apply("Sigmoid", &[x], x.shape.clone(), Vec::new())
    }

    /// Hyperbolic tangent, element by element.
    pub fn tanh(&mut self, x: &Value) -> Value {
        self.apply("Tanh", &[x], x.shape.clone(), Vec::new())
    }

    /// Natural logarithm, element by element.
    pub fn log(&mut self, x: &Value) -> Value {
        self.apply("Log", &[x], x.shape.clone(), Vec::new())
    }

    /// `max(x, 0)`, element by element.
    pub fn relu(&mut self, x: &Value) -> Value {
        self.apply("Relu", &[x], x.shape.clone(), Vec::new())
    }

    /// Exponential function, element by element.
    pub fn exp(&mut self, x: &Value) -> Value {
        self.apply("Exp", &[x], x.shape.clone(), Vec::new())
    }

    /// `x` with its axes in another order: axis `i` of the result is axis `order[i]` of `x`.
    ///
    /// # Errors
    /// [`WriteError::Shape`] where `order` is no permutation of the axes.
    pub fn transpose(&mut self, x: &Value, order: &[usize]) -> Result<Value, WriteError> {
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        if !sorted.into_iter().eq(0..x.shape.len()) {
            let expected = format!("as many axes as {order:?} puts in order");
            return Err(mismatch("Transpose", &expected, &[x]));
        }
        let shape = order.iter().map(|&axis| x.shape[axis]).collect();
        let order = proto::ints_attribute("perm", order);
        Ok(self.apply("Transpose", &[x], shape, vec![order]))
    }

    /// `parts` joined along `axis`.
    ///
    /// # Errors
    /// [`WriteError::Shape`] where the parts differ on another axis, or there are none.
    pub fn concat(&mut self, parts: &[&Value], axis: usize) -> Result<Value, WriteError> {
        let fits = |part: &&Value| {
            part.shape.len() == parts[0].shape.len()
                && (0..part.shape.len()).all(|a| a == axis || part.shape[a] == parts[0].shape[a])
        };
        if parts.is_empty() || axis >= parts[0].shape.len() || !parts.iter().all(fits) {
            let expected = format!("shapes equal except on axis {axis}");
            return Err(mismatch("Concat", &expected, parts));
        }
        let mut shape = parts[0].shape.clone();
        shape[axis] = parts.iter().map(|part| part.shape[axis]).sum();
        let axis = proto::int_attribute("axis", axis as i64);
        Ok(self.apply("Concat", parts, shape, vec![axis]))
    }

    /// The parts of `x` along `axis` that `indices` name, in that order.
    ///
    /// # Errors
    /// [`WriteError::Shape`] where an index is outside the axis.
    pub fn gather(
        &mut self,
        x: &Value,
        axis: usize,
        indices: &[usize],
    ) -> Result<Value, WriteError> {
        let length = x.shape.get(axis).copied().unwrap_or(0);
        if indices.is_empty() || indices.iter().any(|index| *index >= length) {
            let expected = format!(
                "an axis {axis} that all {} indices are inside",
                indices.len()
            );
            return Err(mismatch("Gather", &expected, &[x]));
        }
        let mut shape = x.shape.clone();
        shape[axis] = indices.len();
        let indices = self.integers("indices", indices);
        let axis = proto::int_attribute("axis", axis as i64);
        Ok(self.apply("Gather", &[x, &indices], shape, vec![axis]))
    }

    /// `x` cut along `axis` into pieces of the given `lengths`.
    ///
    /// # Errors
    /// [`WriteError::Shape`] where the lengths do not add up to the axis.
    pub fn split(
        &mut self,
        x: &Value,
        axis: usize,
        lengths: &[usize],
    ) -> Result<Vec<Value>, WriteError> {
        if x.shape.get(axis) != Some(&lengths.iter().sum()) || lengths.contains(&0) {
            let expected = format!("lengths {lengths:?} that add up to axis {axis}");
            return Err(mismatch("Split", &expected, &[x]));
        }
        let lengths_value = self.integers("split", lengths);
        let names: Vec<String> = lengths.iter().map(|_| self.fresh("split")).collect();
        let name_refs: Vec<&str> = names.iter().map(String::as_str).collect();
        let axis_attribute = proto::int_attribute("axis", axis as i64);
        self.push(
            "Split",
            &[x, &lengths_value],
            &name_refs,
            vec![axis_attribute],
        );
        let pieces = names.into_iter().zip(lengths).map(|(name, length)| {
            let mut shape = x.shape.clone();
            shape[axis] = *length;
            Value { name, shape }
        });
        Ok(pieces.collect())
    }

    /// `x`'s numbers, row-major, under another `shape`.
    ///
    /// # Errors
    /// [`WriteError::Shape`] where the counts differ.
    pub fn reshape(&mut self, x: &Value, shape: &[usize]) -> Result<Value, WriteError> {
        if x.shape.iter().product::<usize>() != shape.iter().product::<usize>() {
            let expected = format!("a shape with as many numbers as {shape:?}");
            return Err(mismatch("Reshape", &expected, &[x]));
        }
        let target = self.integers("shape", shape);
        Ok(self.apply("Reshape", &[x, &target], shape.to_vec(), Vec::new()))
    }

    /// The ONNX file.
    pub fn into_bytes(self) -> Vec<u8> {
        proto::model(self.proto).to_bytes()
    }

    fn elementwise(&mut self, op: &'static str, a: &Value, b: &Value) -> Result<Value, WriteError> {
        if !a.shape.ends_with(&b.shape) {
            return Err(mismatch(op, "the second shape to end the first", &[a, b]));
        }
        Ok(self.apply(op, &[a, b], a.shape.clone(), Vec::new()))
    }

    /// An initialiser of 64-bit integers, as `Split` and `Reshape` take their sizes.
    fn integers(&mut self, stem: &str, numbers: &[usize]) -> Value {
        let name = self.fresh(stem);
        let shape = [numbers.len()];
        let raw = numbers
            .iter()
            .flat_map(|n| (*n as i64).to_le_bytes())
            .collect();
        let tensor = proto::tensor(&name, &shape, INT64, raw);
        self.proto.initializer.push(tensor);
        value(&name, &shape)
    }

    /// Adds an operation with one result.
    pub(super) fn apply(
        &mut self,
        op: &str,
        inputs: &[&Value],
        shape: Vec<usize>,
        attributes: Vec<Attribute>,
    ) -> Value {
        let name = self.fresh(&op.to_lowercase());
        self.push(op, inputs, &[&name], attributes);
        Value { name, shape }
    }

    fn push(&mut self, op: &str, inputs: &[&Value], outputs: &[&str], attributes: Vec<Attribute>) {
        self.proto.node.push(NodeMessage {
            name: format!("{op}_{}", self.proto.node.len()),
            op_type: op.to_owned(),
            input: inputs.iter().map(|input| input.name.clone()).collect(),
            output: outputs.iter().map(|&name| name.to_owned()).collect(),
            attribute: attributes,
            ..Default::default()
        });
    }

    fn claim(&mut self, name: &str) -> Result<(), WriteError> {
        if self.names.insert(name.to_owned()) {
            Ok(())
        } else {
            Err(WriteError::DuplicateName {
                name: name.to_owned(),
            })
        }
    }

    /// A name not taken yet that starts with `stem`.
    fn fresh(&mut self, stem: &str) -> String {
        let mut number = self.names.len();
        loop {
            let name = format!("{stem}_{number}");
            if self.names.insert(name.clone()) {
                return name;
            }
            number += 1;
        }
    }
}

fn value(name: &str, shape: &[usize]) -> Value {
    Value {
        name: name.to_owned(),
        shape: shape.to_vec(),
    }
}

pub(super) fn mismatch(op: &'static str, expected: &str, operands: &[&Value]) -> WriteError {
    WriteError::Shape {
        op,
        expected: format!("expected {expected}"),
        got: operands.iter().map(|v| v.shape.clone()).collect(),
    }
}
