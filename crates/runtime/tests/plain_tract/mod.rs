//! A bundle's networks without this project's runtime around them.

use std::path::Path;
use std::sync::Arc;

use tract_onnx::prelude::*;

/// A bundle's networks run by tract alone, from its own ONNX front end.
pub struct PlainTract {
    predictor: Arc<TypedRunnableModel>,
    decoder: Arc<TypedRunnableModel>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    state: Vec<(String, Tensor)>,
}

impl PlainTract {
    /// The networks in a folder, unoptimised, with a state of zeros.
    #[allow(dead_code)] // Not every test that has this module uses it.
    pub fn load(folder: &Path) -> Self {
        Self::load_with(folder, Ok)
    }

    /// As [`Self::load`], optimised: for many ticks.
    #[allow(dead_code)]
    pub fn optimised(folder: &Path) -> Self {
        Self::load_with(folder, TypedModel::into_optimized)
    }

    fn load_with(folder: &Path, prepared: impl Fn(TypedModel) -> TractResult<TypedModel>) -> Self {
        let typed = |file: &str| {
            let model = tract_onnx::onnx()
                .model_for_path(folder.join(file))
                .unwrap();
            model.into_typed().unwrap()
        };
        let predictor = typed("predictor.onnx");
        let label = |outlet: &OutletId| predictor.outlet_label(*outlet).unwrap().to_owned();
        let outputs = predictor
            .output_outlets()
            .unwrap()
            .iter()
            .map(label)
            .collect();
        let inputs: Vec<String> = predictor
            .input_outlets()
            .unwrap()
            .iter()
            .map(|outlet| predictor.node(outlet.node).name.clone())
            .collect();
        let state = predictor.input_outlets().unwrap().iter().zip(&inputs);
        let state = state
            .filter(|(_, name)| name.starts_with("state_"))
            .map(|(outlet, name)| {
                let fact = predictor.outlet_fact(*outlet).unwrap();
                let shape = fact.shape.as_concrete().unwrap().to_vec();
                (name.clone(), Tensor::zero::<f32>(&shape).unwrap())
            })
            .collect();
        Self {
            inputs,
            outputs,
            state,
            predictor: prepared(predictor).unwrap().into_runnable().unwrap(),
            decoder: prepared(typed("decoder.onnx"))
                .unwrap()
                .into_runnable()
                .unwrap(),
        }
    }

    /// One step of the predictor: the latent.
    pub fn tick(&mut self, features: &[f32]) -> Vec<f32> {
        let inputs = self.inputs.iter().map(|name| {
            let state = self.state.iter().find(|(state, _)| state == name);
            match state {
                Some((_, tensor)) => tensor.clone().into_tvalue(),
                None => row(features),
            }
        });
        let values = self.predictor.run(inputs.collect()).unwrap();
        let output = |name: &str| &values[self.outputs.iter().position(|o| o == name).unwrap()];
        for (name, tensor) in &mut self.state {
            *tensor = output(&format!("{name}_out")).clone().into_tensor();
        }
        list(output("latent"))
    }

    /// Offsets in metres, `[slot * 3 + axis]`.
    pub fn decode(&self, latent: &[f32]) -> Vec<f32> {
        list(&self.decoder.run(tvec!(row(latent))).unwrap()[0])
    }
}

fn row(numbers: &[f32]) -> TValue {
    Tensor::from_shape(&[1, numbers.len()], numbers)
        .unwrap()
        .into_tvalue()
}

fn list(value: &TValue) -> Vec<f32> {
    value
        .to_plain_array_view::<f32>()
        .unwrap()
        .iter()
        .copied()
        .collect()
}
