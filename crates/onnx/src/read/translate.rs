//! Checks a decoded graph value by value and wires it with tract's core operators.

use std::collections::HashMap;

use tract_core::prelude::*;

use super::checked::{CheckedGraph, Port};
use super::error::{MAX_NODES, ReadError, invalid, too_many_nodes};
use super::operators;
use super::proto::{self, Numbers};
use crate::messages::{FLOAT, GraphMessage, Length, TensorMessage, ValueInfo};

/// Most multiplications of one run. The fully connected autoencoder of Casas and Otaduy, the
/// largest planned, needs 0.15e9; a file above this would hang a page.
const MAX_MULTIPLICATIONS: u64 = 1 << 30;

/// Most numbers that all nodes of one run put out together: 16 MiB in single precision, of which
/// reading, planning and running take some ten times as much. The largest network of the project puts out
/// 0.2e6.
const MAX_OUTPUTS: usize = 1 << 22;

/// A value of the graph that is known so far.
#[derive(Clone, Debug)]
pub(super) enum Known {
    /// Single precision, wired in the tract model.
    Wire { outlet: OutletId, shape: Vec<usize> },
    /// Half-precision weights, waiting for their `Cast`.
    Half {
        shape: Vec<usize>,
        numbers: Vec<f32>,
    },
    /// Integers, which only shape other values.
    Integers(Vec<i64>),
}

/// The tract model under construction.
pub(super) struct Translation {
    pub model: TypedModel,
    /// Rows of the inputs.
    pub rows: usize,
    values: HashMap<String, Known>,
    multiplications: u64,
    outputs: usize,
}

pub(super) fn translate(graph: &GraphMessage, rows: usize) -> Result<CheckedGraph, ReadError> {
    if graph.node.len() > MAX_NODES || graph.initializer.len() > MAX_NODES {
        return Err(too_many_nodes());
    }
    let mut translation = Translation {
        model: TypedModel::default(),
        rows,
        values: HashMap::new(),
        multiplications: 0,
        outputs: 0,
    };
    for tensor in &graph.initializer {
        translation.add_initializer(tensor)?;
    }
    let mut inputs = Vec::new();
    for input in &graph.input {
        // Files of IR version 3 and older list initialisers among the inputs.
        if !translation.values.contains_key(&input.name) {
            inputs.push(translation.add_input(input)?);
        }
    }
    for (index, node) in graph.node.iter().enumerate() {
        operators::wire(&mut translation, index, node)?;
    }
    translation.finish(graph, inputs)
}

impl Translation {
    fn add_initializer(&mut self, tensor: &TensorMessage) -> Result<(), ReadError> {
        let (shape, numbers) = proto::numbers(tensor)?;
        let known = match numbers {
            Numbers::Single(numbers) => self.constant(&tensor.name, shape, &numbers)?,
            Numbers::Half(numbers) => Known::Half { shape, numbers },
            Numbers::Integers(numbers) => Known::Integers(numbers),
        };
        self.define(&tensor.name, known)
    }

    fn add_input(&mut self, input: &ValueInfo) -> Result<Port, ReadError> {
        let kind = input.r#type.as_ref();
        let Some(tensor) = kind.and_then(|kind| kind.tensor_type.as_ref()) else {
            return Err(invalid(input.name.as_str(), "the input has no tensor type"));
        };
        if tensor.elem_type != FLOAT {
            let problem = format!(
                "the input's data type is {}, expected FLOAT (1)",
                tensor.elem_type
            );
            return Err(invalid(input.name.as_str(), problem));
        }
        let dims: Option<Vec<i64>> = tensor.shape.as_ref().and_then(|shape| {
            let fixed = shape.dim.iter().map(|dim| match dim.value {
                Some(Length::Fixed(length)) => Some(length),
                _ => None,
            });
            fixed.collect()
        });
        let Some(dims) = dims else {
            let problem = "the input's shape is not fixed; export with fixed shapes";
            return Err(invalid(input.name.as_str(), problem));
        };
        let mut shape = proto::shape(&input.name, &dims)?;
        if let Some(first) = shape.first_mut().filter(|first| **first == 1) {
            *first = self.rows;
        }
        let fact = f32::fact(&shape);
        let outlet = self
            .model
            .add_source(format!("input.{}", input.name), fact)
            .map_err(|error| self.refused(&error))?;
        let known = Known::Wire {
            outlet,
            shape: shape.clone(),
        };
        self.define(&input.name, known)?;
        Ok(Port {
            name: input.name.clone(),
            shape,
        })
    }

    fn finish(
        mut self,
        graph: &GraphMessage,
        inputs: Vec<Port>,
    ) -> Result<CheckedGraph, ReadError> {
        let mut outputs = Vec::new();
        let mut outlets = Vec::new();
        for output in &graph.output {
            let Some(Known::Wire { outlet, shape }) = self.values.get(&output.name) else {
                let problem = "no node of single precision puts this output out";
                return Err(invalid(output.name.as_str(), problem));
            };
            outlets.push(*outlet);
            outputs.push(Port {
                name: output.name.clone(),
                shape: shape.clone(),
            });
        }
        self.model
            .select_output_outlets(&outlets)
            .map_err(|error| self.refused(&error))?;
        Ok(CheckedGraph {
            model: self.model,
            inputs,
            outputs,
        })
    }

    /// The value called `name`.
    pub fn value(&self, place: &str, name: &str) -> Result<&Known, ReadError> {
        self.values
            .get(name)
            .ok_or_else(|| invalid(place, format!("its input `{name}` is not known")))
    }

    /// Names a value.
    pub fn define(&mut self, name: &str, known: Known) -> Result<(), ReadError> {
        if name.is_empty() {
            return Err(invalid("graph", "a value has no name"));
        }
        match self.values.insert(name.to_owned(), known) {
            None => Ok(()),
            Some(_) => Err(invalid(name, "two values have this name")),
        }
    }

    /// A single-precision constant.
    pub fn constant(
        &mut self,
        name: &str,
        shape: Vec<usize>,
        numbers: &[f32],
    ) -> Result<Known, ReadError> {
        let outlet = Tensor::from_shape(&shape, numbers)
            .and_then(|tensor| self.model.add_const(format!("constant.{name}"), tensor))
            .map_err(|error| self.refused(&error))?;
        Ok(Known::Wire { outlet, shape })
    }

    /// Counts the multiplications of a matrix product against [`MAX_MULTIPLICATIONS`].
    pub fn spend(&mut self, place: &str, multiplications: [usize; 3]) -> Result<(), ReadError> {
        let product = multiplications
            .iter()
            .try_fold(1_u64, |product, &n| product.checked_mul(n as u64));
        self.multiplications = product
            .and_then(|product| self.multiplications.checked_add(product))
            .filter(|&sum| sum <= MAX_MULTIPLICATIONS)
            .ok_or_else(|| {
                let problem = format!("more than {MAX_MULTIPLICATIONS} multiplications a run");
                invalid(place, problem)
            })?;
        Ok(())
    }

    /// Counts the numbers of a node's output against [`MAX_OUTPUTS`].
    pub fn put_out(&mut self, place: &str, numbers: usize) -> Result<(), ReadError> {
        self.outputs = self.outputs.saturating_add(numbers);
        if self.outputs > MAX_OUTPUTS {
            let problem = format!("its nodes put out more than {MAX_OUTPUTS} numbers a run");
            return Err(invalid(place, problem));
        }
        Ok(())
    }

    /// The error for what tract refuses although the checks passed.
    pub fn refused(&self, error: &TractError) -> ReadError {
        ReadError::Refused {
            reason: format!("{error:#}"),
        }
    }
}
