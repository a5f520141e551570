//! A fused network as an operator of tract.

use std::sync::Arc;

use tract_core::internal::*;

use super::Fused;
use crate::networks::plans::Rows;

/// A network in one node.
#[derive(Clone, Debug)]
struct FusedNetwork {
    fused: Arc<Fused>,
    outputs: TVec<TypedFact>,
}

impl PartialEq for FusedNetwork {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.fused, &other.fused)
    }
}

impl Eq for FusedNetwork {}

/// `model` with one operator, `fused`, in the place of its own.
///
/// # Errors
/// Where tract refuses it.
pub(in crate::networks) fn operator(
    model: &TypedModel,
    fused: &Arc<Fused>,
) -> TractResult<TypedModel> {
    let mut whole = TypedModel::default();
    let mut inputs: TVec<OutletId> = tvec![];
    for outlet in model.input_outlets()? {
        let name = model.node(outlet.node).name.as_str();
        inputs.push(whole.add_source(name, model.outlet_fact(*outlet)?.clone())?);
    }
    let outputs = model.output_outlets()?.iter();
    let outputs = outputs.map(|outlet| Ok(model.outlet_fact(*outlet)?.without_value()));
    let operator = FusedNetwork {
        fused: Arc::clone(fused),
        outputs: outputs.collect::<TractResult<_>>()?,
    };
    let outlets = whole.wire_node("fused", operator, &inputs)?;
    whole.select_output_outlets(&outlets)?;
    Ok(whole)
}

impl Op for FusedNetwork {
    fn name(&self) -> StaticName {
        "FusedNetwork".into()
    }

    op_as_typed_op!();
}

impl EvalOp for FusedNetwork {
    op_out_of_plan!();

    fn eval(&self, _ctx: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let outputs = self.outputs.iter().map(|fact| {
            let shape = fact
                .shape
                .as_concrete()
                .context("a shape that is not fixed")?;
            Tensor::zero::<f32>(shape)
        });
        let mut outputs = outputs.collect::<TractResult<TVec<Tensor>>>()?;
        let mut row = Row {
            inputs: inputs.iter().map(numbers).collect::<TractResult<_>>()?,
            outputs: vec![Vec::new(); outputs.len()],
            kept: Vec::new(),
        };
        self.fused.run(&mut self.fused.memory(), 1, &mut row);
        for (tensor, numbers) in outputs.iter_mut().zip(&row.outputs) {
            let mut ram = tensor.try_as_plain_ram_mut()?;
            ram.as_slice_mut::<f32>()?.copy_from_slice(numbers);
        }
        Ok(outputs.into_iter().map(IntoTValue::into_tvalue).collect())
    }
}

fn numbers(value: &TValue) -> TractResult<Vec<f32>> {
    Ok(value.try_as_plain_ram()?.as_slice::<f32>()?.to_vec())
}

impl TypedOp for FusedNetwork {
    as_op!();

    fn output_facts(&self, _inputs: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        Ok(self.outputs.clone())
    }
}

/// Tensors as one row.
struct Row {
    inputs: Vec<Vec<f32>>,
    outputs: Vec<Vec<f32>>,
    kept: Vec<f32>,
}

impl Rows for Row {
    fn fill(&self, port: usize, _row: usize, target: &mut [f32]) {
        target.copy_from_slice(&self.inputs[port]);
    }

    fn take(&mut self, port: usize, _row: usize, source: &[f32]) {
        self.outputs[port] = source.to_vec();
    }

    fn kept(&mut self, _row: usize) -> &mut Vec<f32> {
        &mut self.kept
    }
}
