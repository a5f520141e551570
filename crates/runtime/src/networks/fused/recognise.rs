//! From a graph of tract's operators to a [`Calculation`], if all its operators are known here.
//!
//! What a graph is called, and what its values are called, does not matter: what it does is followed
//! operator by operator, as `dynaskin-onnx` wires them.

use std::collections::HashMap;
use std::sync::Arc;

use tract_core::axes::AxesMapping;
use tract_core::internal::{AxisOp, DimLike as _, TypedNode};
use tract_core::ops::array::{Gather, Slice, TypedConcat};
use tract_core::ops::binary::TypedBinOp;
use tract_core::ops::einsum::EinSum;
use tract_core::ops::element_wise::ElementWiseOp;
use tract_core::ops::konst::Const;
use tract_core::ops::source::TypedSource;
use tract_core::ops::{math, nn};
use tract_core::prelude::*;

use super::calculation::{Calculation, Element, Sum, Term, Vector, Weights};
use super::functions::{Binary, Unary};

/// What a value of the graph is.
#[derive(Clone)]
enum Known {
    /// Row-major, one row's.
    Numbers {
        shape: Vec<usize>,
        elements: Arc<Vec<Element>>,
    },
    /// Single precision, the same in every run.
    Constant {
        shape: Vec<usize>,
        numbers: Arc<Vec<f32>>,
    },
    /// Indices.
    Integers(Arc<Vec<i64>>),
}

/// A node that is not known here.
#[derive(Clone, Debug)]
pub(crate) struct Unrecognised {
    /// The node's name.
    pub node: String,
    /// Its operator in tract.
    pub operator: String,
}

/// What `model`, a graph of one row, calculates.
///
/// # Errors
/// The first node that is not known here.
pub(super) fn recognise(model: &TypedModel) -> Result<Calculation, Unrecognised> {
    let mut graph = Recognition {
        model,
        values: HashMap::new(),
        calculation: Calculation::default(),
    };
    let whole = |what: &str| Unrecognised {
        node: what.to_owned(),
        operator: "none".to_owned(),
    };
    let at = |outlet: &OutletId| {
        let node = &model.nodes[outlet.node];
        Unrecognised {
            node: node.name.clone(),
            operator: node.op.name().into_owned(),
        }
    };
    for outlet in model.input_outlets().map_err(|_| whole("the inputs"))? {
        graph.add_input(*outlet).ok_or_else(|| at(outlet))?;
    }
    for id in model.eval_order().map_err(|_| whole("the order"))? {
        let node = &model.nodes[id];
        if !node.op_is::<TypedSource>() {
            let outlet = OutletId::new(id, 0);
            let known = graph.node(node).ok_or_else(|| at(&outlet))?;
            graph.values.insert(outlet, known);
        }
    }
    for outlet in model.output_outlets().map_err(|_| whole("the outputs"))? {
        let elements = graph.values.get(outlet).and_then(Known::elements);
        let (_, elements) = elements.ok_or_else(|| at(outlet))?;
        graph.calculation.outputs.push(elements.to_vec());
    }
    Ok(graph.calculation)
}

struct Recognition<'a> {
    model: &'a TypedModel,
    values: HashMap<OutletId, Known>,
    calculation: Calculation,
}

impl Known {
    /// Its shape and its numbers, where it has such.
    fn elements(&self) -> Option<(&[usize], Arc<Vec<Element>>)> {
        match self {
            Self::Numbers { shape, elements } => Some((shape, Arc::clone(elements))),
            Self::Constant { shape, numbers } => {
                let elements = numbers.iter().map(|&number| Element::Constant(number));
                Some((shape, Arc::new(elements.collect())))
            }
            Self::Integers(_) => None,
        }
    }

    /// Its shape and its numbers, where they are the same in every run.
    fn constant(&self) -> Option<(&[usize], Vec<f32>)> {
        match self {
            Self::Constant { shape, numbers } => Some((shape, numbers.to_vec())),
            Self::Numbers { shape, elements } => {
                let number = |element: &Element| match element {
                    Element::Constant(number) => Some(*number),
                    Element::Of { .. } => None,
                };
                Some((shape, elements.iter().map(number).collect::<Option<_>>()?))
            }
            Self::Integers(_) => None,
        }
    }
}

impl Recognition<'_> {
    fn add_input(&mut self, outlet: OutletId) -> Option<()> {
        let shape = concrete(self.model.outlet_fact(outlet).ok()?)?;
        self.calculation
            .inputs
            .push(self.calculation.vectors.len() as u32);
        let elements = self.calculation.push(Vector::Input(shape.iter().product()));
        self.values.insert(outlet, numbers(shape, elements));
        Some(())
    }

    fn node(&mut self, node: &TypedNode) -> Option<Known> {
        if node.outputs.len() != 1 {
            return None;
        }
        if let Some(op) = node.op_as::<Const>() {
            return constant(op);
        }
        let shape = concrete(&node.outputs[0].fact)?;
        if let Some(op) = node.op_as::<EinSum>() {
            return self.product(node, op, shape);
        }
        if let Some(op) = node.op_as::<TypedBinOp>() {
            return self.binary(node, op, shape);
        }
        if let Some(op) = node.op_as::<ElementWiseOp>() {
            let function = unary(op)?;
            let (_, of) = self.value(node, 0)?.elements()?;
            let vector = Vector::Unary(function, of.to_vec());
            return Some(numbers(shape, self.calculation.push(vector)));
        }
        if let Some(op) = node.op_as::<AxisOp>() {
            return moved(op, self.value(node, 0)?, shape);
        }
        self.picked(node, shape)
    }

    /// What joining, cutting and picking give.
    fn picked(&self, node: &TypedNode, shape: Vec<usize>) -> Option<Known> {
        let (_, first) = self.value(node, 0)?.elements()?;
        let lengths = |index: usize, axis: usize| -> Option<(usize, usize)> {
            let (shape, _) = self.value(node, index)?.elements()?;
            let length = *shape.get(axis)?;
            Some((length, shape[axis + 1..].iter().product()))
        };
        let mut elements = Vec::with_capacity(shape.iter().product());
        if let Some(op) = node.op_as::<TypedConcat>() {
            let mut parts = Vec::with_capacity(node.inputs.len());
            for index in 0..node.inputs.len() {
                let (length, inner) = lengths(index, op.axis)?;
                parts.push((self.value(node, index)?.elements()?.1, length * inner));
            }
            for outer in 0..shape[..op.axis].iter().product() {
                for (part, size) in &parts {
                    elements.extend_from_slice(part.get(outer * size..(outer + 1) * size)?);
                }
            }
        } else if let Some(op) = node.op_as::<Slice>() {
            let (start, end) = (op.start.to_usize().ok()?, op.end.to_usize().ok()?);
            let (length, inner) = lengths(0, op.axis)?;
            for outer in 0..shape[..op.axis].iter().product() {
                let at = |index: usize| (outer * length + index) * inner;
                elements.extend_from_slice(first.get(at(start)..at(end))?);
            }
        } else if let Some(op) = node.op_as::<Gather>() {
            let Known::Integers(indices) = self.value(node, 1)? else {
                return None;
            };
            let (length, inner) = lengths(0, op.axis)?;
            for outer in 0..shape[..op.axis].iter().product() {
                for &index in indices.iter() {
                    let start = (outer * length + usize::try_from(index).ok()?) * inner;
                    elements.extend_from_slice(first.get(start..start + inner)?);
                }
            }
        } else {
            return None;
        }
        Some(numbers(shape, elements))
    }

    /// A row times a constant matrix.
    fn product(&mut self, node: &TypedNode, op: &EinSum, shape: Vec<usize>) -> Option<Known> {
        let matmul = |transposed| AxesMapping::for_numpy_matmul(2, false, transposed, false).ok();
        let transposed = match &op.axes {
            axes if Some(axes) == matmul(false).as_ref() => false,
            axes if Some(axes) == matmul(true).as_ref() => true,
            _ => return None,
        };
        let plain = op.operating_dt == f32::datum_type() && op.q_params.is_none();
        let (row, of) = self.value(node, 0)?.elements()?;
        let one_row = row.len() == 2 && row[0] == 1;
        let (size, stored) = self.value(node, 1)?.constant()?;
        if !plain || !one_row || node.inputs.len() != 2 {
            return None;
        }
        let (rows, columns) = if transposed {
            (size[1], size[0])
        } else {
            (size[0], size[1])
        };
        let weights = if transposed {
            let places = (0..rows).flat_map(|k| (0..columns).map(move |c| c * rows + k));
            places.map(|place| stored[place]).collect()
        } else {
            stored
        };
        let term = Term {
            of: of.to_vec(),
            weights: Arc::new(Weights {
                columns,
                numbers: weights,
            }),
            columns: (0..columns as u32).map(Some).collect(),
        };
        let sum = Sum {
            first: vec![Element::Constant(0.0); columns],
            terms: vec![term],
        };
        Some(numbers(shape, self.calculation.push(Vector::Sum(sum))))
    }

    fn binary(&mut self, node: &TypedNode, op: &TypedBinOp, shape: Vec<usize>) -> Option<Known> {
        let function = if op.0.is::<math::Add>() {
            Binary::Add
        } else if op.0.is::<math::Sub>() {
            Binary::Sub
        } else if op.0.is::<math::Mul>() {
            Binary::Mul
        } else if op.0.is::<math::Max>() {
            Binary::Max
        } else {
            return None;
        };
        if op.1.is_some_and(|kind| kind != f32::datum_type()) {
            return None;
        }
        let operand = |index: usize| {
            let (from, elements) = self.value(node, index)?.elements()?;
            broadcast(from, &elements, &shape)
        };
        let (a, b) = (operand(0)?, operand(1)?);
        let vector = match function {
            Binary::Add => match self.added(&a, &b).or_else(|| self.added(&b, &a)) {
                Some(sum) => Vector::Sum(sum),
                None => Vector::Binary(function, [a, b]),
            },
            _ => Vector::Binary(function, [a, b]),
        };
        Some(numbers(shape, self.calculation.push(vector)))
    }

    /// `a + b` as one sum, where `a` is a sum and `b` is another or something it can start from.
    fn added(&self, a: &[Element], b: &[Element]) -> Option<Sum> {
        let sum = self.calculation.whole_sum(a)?;
        let starts_from_zero = |sum: &Sum| sum.first.iter().all(|x| *x == Element::Constant(0.0));
        let mut sum = sum.clone();
        match self.calculation.whole_sum(b) {
            Some(other) if starts_from_zero(other) => sum.terms.extend(other.terms.clone()),
            Some(other) if starts_from_zero(&sum) => {
                sum.first.clone_from(&other.first);
                sum.terms.extend(other.terms.clone());
            }
            _ if starts_from_zero(&sum) => sum.first = b.to_vec(),
            _ => return None,
        }
        Some(sum)
    }

    fn value(&self, node: &TypedNode, index: usize) -> Option<&Known> {
        self.values.get(node.inputs.get(index)?)
    }
}

fn numbers(shape: Vec<usize>, elements: Vec<Element>) -> Known {
    Known::Numbers {
        shape,
        elements: Arc::new(elements),
    }
}

/// The lengths of a value's axes, of single precision.
fn concrete(fact: &TypedFact) -> Option<Vec<usize>> {
    let single = fact.datum_type == f32::datum_type();
    single.then(|| fact.shape.as_concrete().map(<[usize]>::to_vec))?
}

fn constant(op: &Const) -> Option<Known> {
    let tensor = op.val();
    let ram = tensor.try_as_plain_ram().ok()?;
    if let Ok(numbers) = ram.as_slice::<f32>() {
        return Some(Known::Constant {
            shape: tensor.shape().to_vec(),
            numbers: Arc::new(numbers.to_vec()),
        });
    }
    let indices = ram.as_slice::<i64>().ok()?;
    Some(Known::Integers(Arc::new(indices.to_vec())))
}

fn unary(op: &ElementWiseOp) -> Option<Unary> {
    if op.1.is_some_and(|kind| kind != f32::datum_type()) {
        None
    } else if op.0.is::<nn::Sigmoid>() {
        Some(Unary::Sigmoid)
    } else if op.0.is::<math::Tanh>() {
        Some(Unary::Tanh)
    } else if op.0.is::<math::Exp>() {
        Some(Unary::Exp)
    } else if op.0.is::<math::Ln>() {
        Some(Unary::Log)
    } else {
        None
    }
}

/// What changing the axes of `known` to `shape` gives.
fn moved(op: &AxisOp, known: &Known, shape: Vec<usize>) -> Option<Known> {
    let AxisOp::Move(from, to) = *op else {
        return Some(match known {
            Known::Constant { numbers, .. } => Known::Constant {
                shape,
                numbers: Arc::clone(numbers),
            },
            known => Known::Numbers {
                elements: known.elements()?.1,
                shape,
            },
        });
    };
    let (before, elements) = known.elements()?;
    let mut order: Vec<usize> = (0..before.len()).collect();
    let axis = order.remove(from);
    order.insert(to, axis);
    let steps = steps(before);
    let steps: Vec<usize> = order.iter().map(|&axis| steps[axis]).collect();
    let moved = places(&shape, &steps)
        .map(|place| elements[place])
        .collect();
    Some(numbers(shape, moved))
}

/// `elements` of the shape `from` stretched to the shape `to` of as many axes.
fn broadcast(from: &[usize], elements: &[Element], to: &[usize]) -> Option<Vec<Element>> {
    let fits = |(length, to): (&usize, &usize)| *length == *to || *length == 1;
    if from.len() != to.len() || !from.iter().zip(to).all(fits) {
        return None;
    }
    let mut steps = steps(from);
    for (step, &length) in steps.iter_mut().zip(from) {
        if length == 1 {
            *step = 0;
        }
    }
    Some(places(to, &steps).map(|place| elements[place]).collect())
}

/// How far apart two numbers are that differ by one along each axis.
fn steps(shape: &[usize]) -> Vec<usize> {
    let mut steps = vec![1; shape.len()];
    for axis in (1..shape.len()).rev() {
        steps[axis - 1] = steps[axis] * shape[axis];
    }
    steps
}

/// Where the numbers of a value of shape `shape` stand, in order.
fn places(shape: &[usize], steps: &[usize]) -> impl Iterator<Item = usize> {
    let (shape, steps) = (shape.to_vec(), steps.to_vec());
    (0..shape.iter().product::<usize>()).map(move |mut index| {
        let axes = shape.iter().zip(&steps).rev();
        axes.map(|(length, step)| {
            let along = index % length;
            index /= length;
            along * step
        })
        .sum()
    })
}
