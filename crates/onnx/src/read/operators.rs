//! The ONNX operators that the project's networks consist of.

use tract_core::axes::AxesMapping;
use tract_core::internal::{AxisOp, TDim, TypedOp};
use tract_core::ops::array::{Gather, Slice, TypedConcat};
use tract_core::ops::change_axes::{perm_to_ops, wire_with_rank_broadcast};
use tract_core::ops::einsum::EinSum;
use tract_core::ops::{math, nn};
use tract_core::prelude::*;

use super::translate::{Known, Translation};
use super::{ReadError, invalid, proto};
use crate::messages::{Attribute, FLOAT, NodeMessage};

/// The operators there are, for messages.
#[cfg(feature = "convolutions")]
const SUPPORTED: &str = "Add, Cast, Concat, Conv, ConvTranspose, Exp, Gather, Gemm, Identity, Log, \
                         MatMul, Mul, Relu, Reshape, Sigmoid, Split, Sub, Tanh and Transpose";
#[cfg(not(feature = "convolutions"))]
const SUPPORTED: &str = "Add, Cast, Concat, Exp, Gather, Gemm, Identity, Log, MatMul, Mul, Relu, \
                         Reshape, Sigmoid, Split, Sub, Tanh and Transpose";

/// One node on its way into the tract model.
pub(super) struct Node<'a> {
    pub translation: &'a mut Translation,
    pub proto: &'a NodeMessage,
    /// Unique name of the node in the tract model and in messages.
    pub place: String,
}

/// A wired single-precision value.
#[derive(Clone, Debug)]
pub(super) struct Wire {
    pub outlet: OutletId,
    pub shape: Vec<usize>,
}

/// Adds the graph's node number `index`.
pub(super) fn wire(
    translation: &mut Translation,
    index: usize,
    proto: &NodeMessage,
) -> Result<(), ReadError> {
    let mut node = Node {
        translation,
        proto,
        place: format!("{}.{}", index, proto.op_type),
    };
    let official = proto.domain.is_empty() || proto.domain == "ai.onnx";
    match proto.op_type.as_str() {
        "Add" if official => node.elementwise(math::add()),
        "Sub" if official => node.elementwise(math::sub()),
        "Mul" if official => node.elementwise(math::mul()),
        "Sigmoid" if official => node.unary(nn::sigmoid()),
        "Log" if official => node.unary(math::ln()),
        "Tanh" if official => node.unary(math::tanh()),
        "Exp" if official => node.unary(math::exp()),
        "Relu" if official => node.relu(),
        "Identity" if official => node.identity(),
        "Cast" if official => node.cast(),
        "Gemm" if official => node.gemm(),
        "MatMul" if official => node.matmul(),
        "Concat" if official => node.concat(),
        "Gather" if official => node.gather(),
        "Split" if official => node.split(),
        "Reshape" if official => node.reshape(),
        "Transpose" if official => node.transpose(),
        #[cfg(feature = "convolutions")]
        "Conv" if official => node.conv(),
        #[cfg(feature = "convolutions")]
        "ConvTranspose" if official => node.conv_transpose(),
        _ => Err(ReadError::UnknownOperator {
            node: proto.name.clone(),
            operator: format!("{}{}", domain_prefix(&proto.domain), proto.op_type),
            supported: SUPPORTED.to_owned(),
        }),
    }
}

fn domain_prefix(domain: &str) -> String {
    if domain.is_empty() {
        String::new()
    } else {
        format!("{domain}.")
    }
}

impl Node<'_> {
    fn elementwise(&mut self, op: impl Into<Box<dyn TypedOp>>) -> Result<(), ReadError> {
        self.attributes(&[])?;
        let (a, b) = (self.input(0)?, self.input(1)?);
        self.arity(2, 1)?;
        let shape = self.broadcast(&a.shape, &b.shape)?;
        let outlet = wire_with_rank_broadcast(
            &self.place,
            &mut self.translation.model,
            op,
            &[a.outlet, b.outlet],
        );
        self.finish(outlet, shape)
    }

    fn unary(&mut self, op: impl Into<Box<dyn TypedOp>>) -> Result<(), ReadError> {
        self.attributes(&[])?;
        self.arity(1, 1)?;
        let x = self.input(0)?;
        self.push(op, &[x.outlet], x.shape)
    }

    fn relu(&mut self) -> Result<(), ReadError> {
        self.attributes(&[])?;
        self.arity(1, 1)?;
        let x = self.input(0)?;
        let zero_shape = vec![1; x.shape.len()];
        let name = format!("{}.zero", self.place);
        let zero = self.translation.constant(&name, zero_shape, &[0.0])?;
        let Known::Wire { outlet: zero, .. } = zero else {
            return Err(self.problem("its constant is not a value"));
        };
        self.push(math::max(), &[x.outlet, zero], x.shape)
    }

    fn identity(&mut self) -> Result<(), ReadError> {
        self.attributes(&[])?;
        self.arity(1, 1)?;
        let source = self.proto.input[0].as_str();
        let known = self.translation.value(&self.place, source)?.clone();
        self.translation.define(&self.proto.output[0], known)
    }

    fn cast(&mut self) -> Result<(), ReadError> {
        self.attributes(&["to"])?;
        self.arity(1, 1)?;
        if self.integer("to", 0)? != i64::from(FLOAT) {
            return Err(self.problem("it casts to another type than FLOAT"));
        }
        let source = self.proto.input[0].as_str();
        let known = match self.translation.value(&self.place, source)?.clone() {
            Known::Half { shape, numbers } => {
                self.translation.constant(&self.place, shape, &numbers)?
            }
            Known::Integers(_) => return Err(self.problem("it casts integers")),
            wire @ Known::Wire { .. } => wire,
        };
        self.translation.define(&self.proto.output[0], known)
    }

    /// `A · B + C`, `B` transposed where `transB` is 1; without scaling.
    fn gemm(&mut self) -> Result<(), ReadError> {
        self.attributes(&["alpha", "beta", "transA", "transB"])?;
        let unscaled = ["alpha", "beta"].iter().all(|name| {
            self.attribute(name)
                .is_none_or(|attribute| attribute.f == 1.0)
        });
        if !unscaled || self.integer("transA", 0)? != 0 {
            return Err(self.problem("alpha and beta must be 1 and transA 0"));
        }
        let transposed = self.integer("transB", 0)? != 0;
        let (a, b) = (self.input(0)?, self.input(1)?);
        if self.proto.input.len() == 2 {
            self.arity(2, 1)?;
            let place = self.place.clone();
            let (outlet, shape) = self.product(&place, &a, &b, transposed)?;
            return self.finish(Ok(tvec!(outlet)), shape);
        }
        self.arity(3, 1)?;
        let bias = self.input(2)?;
        let name = format!("{}.product", self.place);
        let (product, shape) = self.product(&name, &a, &b, transposed)?;
        if self.broadcast(&shape, &bias.shape)? != shape {
            let problem = format!("its bias {:?} is larger than {shape:?}", bias.shape);
            return Err(self.problem(problem));
        }
        let outlet = wire_with_rank_broadcast(
            &self.place,
            &mut self.translation.model,
            math::add(),
            &[product, bias.outlet],
        );
        self.finish(outlet, shape)
    }

    fn matmul(&mut self) -> Result<(), ReadError> {
        self.attributes(&[])?;
        self.arity(2, 1)?;
        let (a, b) = (self.input(0)?, self.input(1)?);
        let place = self.place.clone();
        let (outlet, shape) = self.product(&place, &a, &b, false)?;
        self.finish(Ok(tvec!(outlet)), shape)
    }

    fn concat(&mut self) -> Result<(), ReadError> {
        self.attributes(&["axis"])?;
        self.arity(self.proto.input.len().max(1), 1)?;
        let parts = (0..self.proto.input.len())
            .map(|index| self.input(index))
            .collect::<Result<Vec<_>, _>>()?;
        let mut shape = parts[0].shape.clone();
        let axis = self.axis(shape.len())?;
        shape[axis] = 0;
        for part in &parts {
            let fits = part.shape.len() == shape.len()
                && (0..shape.len()).all(|a| a == axis || part.shape[a] == shape[a]);
            if !fits {
                let problem = format!("its inputs differ on another axis than {axis}");
                return Err(self.problem(problem));
            }
            shape[axis] += part.shape[axis];
        }
        let outlets: Vec<OutletId> = parts.iter().map(|part| part.outlet).collect();
        self.push(TypedConcat { axis }, &outlets, shape)
    }

    /// Picks parts of `x` along an axis by a list of constant indices.
    fn gather(&mut self) -> Result<(), ReadError> {
        self.attributes(&["axis"])?;
        self.arity(2, 1)?;
        let x = self.input(0)?;
        let axis = self.axis(x.shape.len())?;
        if axis == 0 {
            // The first axis counts avatars, whatever the file says.
            return Err(self.problem("its axis must not be the first"));
        }
        let length = x.shape[axis] as i64;
        let indices = self.integers(1)?;
        let from_start = |index: &i64| if *index < 0 { index + length } else { *index };
        let indices: Vec<i64> = indices.iter().map(from_start).collect();
        if let Some(index) = indices.iter().find(|index| !(0..length).contains(*index)) {
            let problem = format!("its index {index} is outside the axis of {length}");
            return Err(self.problem(problem));
        }
        let mut shape = x.shape.clone();
        shape[axis] = indices.len();
        let name = format!("{}.indices", self.place);
        let indices = self
            .translation
            .model
            .add_const(name, tensor1(&indices))
            .map_err(|error| self.translation.refused(&error))?;
        self.push(Gather::new(axis), &[x.outlet, indices], shape)
    }

    fn split(&mut self) -> Result<(), ReadError> {
        self.attributes(&["axis", "num_outputs"])?;
        self.arity(2, self.proto.output.len().max(1))?;
        let x = self.input(0)?;
        let axis = self.axis(x.shape.len())?;
        let lengths = self.integers(1)?;
        let sum = lengths.iter().try_fold(
            0_i64,
            |sum, &n| if n > 0 { sum.checked_add(n) } else { None },
        );
        if lengths.len() != self.proto.output.len() || sum != Some(x.shape[axis] as i64) {
            let problem = format!("its lengths {lengths:?} do not fit {:?}", x.shape);
            return Err(self.problem(problem));
        }
        let mut start = 0;
        for (index, &length) in lengths.iter().enumerate() {
            let end = start + length as usize;
            let mut shape = x.shape.clone();
            shape[axis] = length as usize;
            let name = format!("{}.{index}", self.place);
            let op = Slice::new(axis, start, end);
            let outlet = self
                .translation
                .model
                .wire_node(name, op, &[x.outlet])
                .map_err(|error| self.translation.refused(&error))?[0];
            let known = Known::Wire { outlet, shape };
            self.translation.define(&self.proto.output[index], known)?;
            start = end;
        }
        Ok(())
    }

    fn reshape(&mut self) -> Result<(), ReadError> {
        self.attributes(&["allowzero"])?;
        self.arity(2, 1)?;
        let x = self.input(0)?;
        let mut shape = proto::shape(&self.place, &self.integers(1)?)?;
        let rows = self.translation.rows;
        if x.shape.first() == Some(&rows) && shape.first() == Some(&1) {
            shape[0] = rows;
        }
        if shape.iter().product::<usize>() != x.shape.iter().product::<usize>() {
            let problem = format!("{:?} does not have as many numbers as {shape:?}", x.shape);
            return Err(self.problem(problem));
        }
        let dims = |shape: &[usize]| shape.iter().map(|&n| TDim::from(n as i64)).collect();
        let op = AxisOp::Reshape(0, dims(&x.shape), dims(&shape));
        self.push(op, &[x.outlet], shape)
    }

    /// Axes in another order; the first stays, because it counts avatars.
    fn transpose(&mut self) -> Result<(), ReadError> {
        self.attributes(&["perm"])?;
        self.arity(1, 1)?;
        let x = self.input(0)?;
        let order = self.attribute("perm").map_or(&[][..], |a| &a.ints);
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        let every_axis = sorted.iter().copied().eq(0..x.shape.len() as i64);
        if !every_axis || order.first() != Some(&0) {
            let problem = format!(
                "its perm is {order:?}, expected the {} axes of its input with 0 first",
                x.shape.len()
            );
            return Err(self.problem(problem));
        }
        let order: Vec<usize> = order.iter().map(|&axis| axis as usize).collect();
        let shape = order.iter().map(|&axis| x.shape[axis]).collect();
        let mut outlet = x.outlet;
        for (index, op) in perm_to_ops(&order).into_iter().enumerate() {
            let name = format!("{}.{index}", self.place);
            let moved = self.translation.model.wire_node(name, op, &[outlet]);
            outlet = moved.map_err(|error| self.translation.refused(&error))?[0];
        }
        self.finish(Ok(tvec!(outlet)), shape)
    }

    /// Wires the matrix product of `a` [N, K] and `b` [K, M] ([M, K] where `transposed`).
    fn product(
        &mut self,
        name: &str,
        a: &Wire,
        b: &Wire,
        transposed: bool,
    ) -> Result<(OutletId, Vec<usize>), ReadError> {
        let (inner, columns) = match (&a.shape[..], &b.shape[..]) {
            ([_, k], [rows, m]) if !transposed && k == rows => (*k, *m),
            ([_, k], [m, rows]) if transposed && k == rows => (*k, *m),
            _ => {
                let problem = format!("{:?} and {:?} cannot be multiplied", a.shape, b.shape);
                return Err(self.problem(problem));
            }
        };
        let shape = vec![a.shape[0], columns];
        self.translation
            .spend(&self.place, [a.shape[0], inner, columns])?;
        let outlet = AxesMapping::for_numpy_matmul(2, false, transposed, false)
            .and_then(|axes| {
                let op = EinSum::new(axes, f32::datum_type());
                self.translation
                    .model
                    .wire_node(name, op, &[a.outlet, b.outlet])
            })
            .map_err(|error| self.translation.refused(&error))?[0];
        Ok((outlet, shape))
    }

    /// Adds `op` under the node's name and names its result.
    pub fn push(
        &mut self,
        op: impl Into<Box<dyn TypedOp>>,
        inputs: &[OutletId],
        shape: Vec<usize>,
    ) -> Result<(), ReadError> {
        let outlet = self
            .translation
            .model
            .wire_node(self.place.as_str(), op, inputs);
        self.finish(outlet, shape)
    }

    fn finish(
        &mut self,
        outlets: TractResult<TVec<OutletId>>,
        shape: Vec<usize>,
    ) -> Result<(), ReadError> {
        let outlet = outlets.map_err(|error| self.translation.refused(&error))?[0];
        let dims: Vec<i64> = shape.iter().map(|&n| n as i64).collect();
        proto::shape(&self.place, &dims)?;
        self.translation
            .put_out(&self.place, shape.iter().product())?;
        self.translation
            .define(&self.proto.output[0], Known::Wire { outlet, shape })
    }

    /// Refuses other numbers of inputs and outputs, and outputs without a name.
    pub fn arity(&self, inputs: usize, outputs: usize) -> Result<(), ReadError> {
        let got = (self.proto.input.len(), self.proto.output.len());
        if got != (inputs, outputs) {
            let problem = format!(
                "it has {} inputs and {} outputs, expected {inputs} and {outputs}",
                got.0, got.1
            );
            return Err(self.problem(problem));
        }
        Ok(())
    }

    fn known_input(&self, index: usize) -> Result<&Known, ReadError> {
        let name = self
            .proto
            .input
            .get(index)
            .ok_or_else(|| self.problem(format!("it has no input {index}")))?;
        self.translation.value(&self.place, name)
    }

    pub fn input(&self, index: usize) -> Result<Wire, ReadError> {
        match self.known_input(index)? {
            Known::Wire { outlet, shape } => Ok(Wire {
                outlet: *outlet,
                shape: shape.clone(),
            }),
            Known::Half { .. } => Err(self.problem(format!(
                "its input {index} is in half precision; put a Cast to FLOAT before it"
            ))),
            Known::Integers(_) => Err(self.problem(format!("its input {index} is integers"))),
        }
    }

    fn integers(&self, index: usize) -> Result<Vec<i64>, ReadError> {
        match self.known_input(index)? {
            Known::Integers(numbers) => Ok(numbers.clone()),
            _ => Err(self.problem(format!("its input {index} must be constant integers"))),
        }
    }

    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.proto.attribute.iter().find(|a| a.name == name)
    }

    /// Refuses attributes outside `known`: they would change what the node means.
    pub fn attributes(&self, known: &[&str]) -> Result<(), ReadError> {
        match self
            .proto
            .attribute
            .iter()
            .find(|a| !known.contains(&a.name.as_str()))
        {
            None => Ok(()),
            Some(other) => Err(self.problem(format!("it has the attribute `{}`", other.name))),
        }
    }

    pub fn integer(&self, name: &str, default: i64) -> Result<i64, ReadError> {
        Ok(self
            .attribute(name)
            .map_or(default, |attribute| attribute.i))
    }

    /// The attribute `axis`, counted from the end where negative.
    fn axis(&self, axes: usize) -> Result<usize, ReadError> {
        let axis = self.integer("axis", 0)?;
        let from_start = if axis < 0 {
            axis.checked_add(axes as i64)
        } else {
            Some(axis)
        };
        from_start
            .and_then(|axis| usize::try_from(axis).ok())
            .filter(|&axis| axis < axes)
            .ok_or_else(|| self.problem(format!("its axis is {axis}, the value has {axes} axes")))
    }

    /// Numpy's broadcasting: aligned at the end, an axis of 1 stretches.
    fn broadcast(&self, a: &[usize], b: &[usize]) -> Result<Vec<usize>, ReadError> {
        let axes = a.len().max(b.len());
        let length = |shape: &[usize], axis: usize| {
            let missing = axes - shape.len();
            if axis < missing {
                1
            } else {
                shape[axis - missing]
            }
        };
        (0..axes)
            .map(|axis| match (length(a, axis), length(b, axis)) {
                (x, y) if x == y || y == 1 => Ok(x),
                (1, y) => Ok(y),
                _ => Err(self.problem(format!("{a:?} and {b:?} do not broadcast"))),
            })
            .collect()
    }

    pub fn problem(&self, problem: impl Into<String>) -> ReadError {
        let place = format!("node {} `{}`", self.place, self.proto.name);
        invalid(place, problem)
    }
}
