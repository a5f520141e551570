//! The two networks of a bundle: contract checks and stepping.

use std::sync::Arc;

use tract_core::prelude::*;

use super::{Graph, Port, read};
use crate::state::{Reader, Writer};
use crate::{Network, RuntimeError};

/// The predictor: features and state to latent and next state.
#[derive(Debug)]
pub struct Predictor {
    plan: Arc<TypedRunnableModel>,
    ports: PredictorPorts,
}

/// Where the predictor's values stand among the graph's inputs and outputs.
#[derive(Debug)]
struct PredictorPorts {
    inputs: usize,
    feature_count: usize,
    latent: usize,
    latent_count: usize,
    states: Vec<StatePort>,
}

#[derive(Debug)]
struct StatePort {
    input: usize,
    output: usize,
    count: usize,
}

/// The recurrent state between two ticks.
#[derive(Clone, Debug)]
pub struct PredictorState(Vec<TValue>);

impl PredictorState {
    /// Adds the state's numbers to a saved state.
    pub(crate) fn write(&self, writer: &mut Writer) -> Result<(), RuntimeError> {
        for value in &self.0 {
            writer.floats(numbers(Network::Predictor, value)?);
        }
        Ok(())
    }
}

/// One avatar's use of a [`Predictor`].
#[derive(Debug)]
pub struct PredictorSession {
    predictor: Arc<Predictor>,
    runner: TypedSimpleState,
}

impl Predictor {
    /// Reads `onnx_bytes` and checks it against the contract.
    ///
    /// # Errors
    /// What is wrong with the file: [`RuntimeError::NotOnnx`] and its like; [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`],
    /// [`RuntimeError::NonFinite`] where a run on zeros does not give finite numbers.
    pub fn load(onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        let graph = read(Network::Predictor, onnx_bytes)?;
        let ports = PredictorPorts::of(&graph)?;
        let plan = plan(Network::Predictor, graph)?;
        Ok(Self { plan, ports })
    }

    /// F: numbers that [`PredictorSession::step`] takes as features.
    pub fn feature_count(&self) -> usize {
        self.ports.feature_count
    }

    /// L: numbers that [`PredictorSession::step`] writes.
    pub fn latent_count(&self) -> usize {
        self.ports.latent_count
    }

    /// The numbers of a saved state.
    pub(crate) fn read_state(
        &self,
        reader: &mut Reader<'_>,
    ) -> Result<PredictorState, RuntimeError> {
        let mut values = Vec::with_capacity(self.ports.states.len());
        for port in &self.ports.states {
            let tensor = Tensor::from_shape(&[1, port.count], &reader.floats(port.count)?)
                .map_err(|error| failed(Network::Predictor, &error))?;
            values.push(tensor.into_tvalue());
        }
        Ok(PredictorState(values))
    }

    /// The state before anything was seen: zeros.
    pub fn zero_state(&self) -> Result<PredictorState, RuntimeError> {
        let zeros = self.ports.states.iter().map(|port| {
            Tensor::zero::<f32>(&[1, port.count])
                .map(IntoTValue::into_tvalue)
                .map_err(|error| failed(Network::Predictor, &error))
        });
        Ok(PredictorState(zeros.collect::<Result<_, _>>()?))
    }
}

impl PredictorPorts {
    fn of(graph: &Graph) -> Result<Self, RuntimeError> {
        let network = Network::Predictor;
        let (_, feature_count) = row(network, &graph.inputs, "features")?;
        let (latent, latent_count) = row(network, &graph.outputs, "latent")?;
        let mut states = Vec::new();
        for port in &graph.inputs {
            if port.name == "features" {
                continue;
            }
            if !port.name.starts_with("state_") {
                let place = format!("input `{}`", port.name);
                return Err(broken(
                    network,
                    place,
                    "`features` or `state_...`",
                    "this name",
                ));
            }
            let (input, count) = row(network, &graph.inputs, &port.name)?;
            let next = format!("{}_out", port.name);
            let (output, next_count) = row(network, &graph.outputs, &next)?;
            if count != next_count {
                let place = format!("output `{next}`");
                let (expected, got) = (format!("[1, {count}]"), format!("[1, {next_count}]"));
                return Err(broken(network, place, expected, got));
            }
            states.push(StatePort {
                input,
                output,
                count,
            });
        }
        if graph.outputs.len() != states.len() + 1 {
            let expected = format!("`latent` and {} states", states.len());
            return Err(broken(network, "outputs", expected, names(&graph.outputs)));
        }
        Ok(Self {
            inputs: graph.inputs.len(),
            feature_count,
            latent,
            latent_count,
            states,
        })
    }
}

impl PredictorSession {
    /// Sets up a run of `predictor`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot set the run up.
    pub fn new(predictor: Arc<Predictor>) -> Result<Self, RuntimeError> {
        let runner = predictor
            .plan
            .spawn()
            .map_err(|error| failed(Network::Predictor, &error))?;
        Ok(Self { predictor, runner })
    }

    /// The predictor.
    pub fn predictor(&self) -> &Predictor {
        &self.predictor
    }

    /// One tick: reads `features`, writes `latent`, and moves `state` on.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`]; [`RuntimeError::NonFinite`], with `state` as it was.
    pub fn step(
        &mut self,
        features: &[f32],
        state: &mut PredictorState,
        latent: &mut [f32],
    ) -> Result<(), RuntimeError> {
        let ports = &self.predictor.ports;
        let network = Network::Predictor;
        let features = Tensor::from_shape(&[1, ports.feature_count], features)
            .map_err(|error| failed(network, &error))?
            .into_tvalue();
        let mut inputs: TVec<TValue> = TVec::with_capacity(ports.inputs);
        for index in 0..ports.inputs {
            let state_at = ports.states.iter().position(|port| port.input == index);
            inputs.push(match state_at {
                Some(slot) => state.0[slot].clone(),
                None => features.clone(),
            });
        }
        let outputs = self
            .runner
            .run(inputs)
            .map_err(|error| failed(network, &error))?;
        copy_out(network, &outputs[ports.latent], latent)?;
        for port in &ports.states {
            finite(network, numbers(network, &outputs[port.output])?)?;
        }
        for (slot, port) in ports.states.iter().enumerate() {
            state.0[slot] = outputs[port.output].clone();
        }
        Ok(())
    }
}

/// The decoder: latent to offsets.
#[derive(Debug)]
pub struct Decoder {
    plan: Arc<TypedRunnableModel>,
    latent_count: usize,
    vertex_count: usize,
}

/// One avatar's use of a [`Decoder`].
#[derive(Debug)]
pub struct DecoderSession {
    runner: TypedSimpleState,
    latent_count: usize,
}

impl Decoder {
    /// Reads `onnx_bytes` and checks it against the contract.
    ///
    /// # Errors
    /// As [`Predictor::load`].
    pub fn load(onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        let network = Network::Decoder;
        let graph = read(network, onnx_bytes)?;
        if graph.inputs.len() != 1 || graph.outputs.len() != 1 {
            let got = format!("{}; {}", names(&graph.inputs), names(&graph.outputs));
            return Err(broken(
                network,
                "ports",
                "input `latent`; output `offsets`",
                got,
            ));
        }
        let (_, latent_count) = row(network, &graph.inputs, "latent")?;
        let output = &graph.outputs[0];
        let vertex_count = match output.shape[..] {
            [1, vertices, 3] if output.name == "offsets" => vertices,
            _ => {
                let got = format!("`{}` {:?}", output.name, output.shape);
                return Err(broken(network, "output", "`offsets` [1, V, 3]", got));
            }
        };
        let plan = plan(network, graph)?;
        Ok(Self {
            plan,
            latent_count,
            vertex_count,
        })
    }

    /// L: numbers that [`DecoderSession::decode`] takes.
    pub fn latent_count(&self) -> usize {
        self.latent_count
    }

    /// V: a third of the numbers that [`DecoderSession::decode`] writes.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}

impl DecoderSession {
    /// Sets up a run of `decoder`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot set the run up.
    pub fn new(decoder: &Decoder) -> Result<Self, RuntimeError> {
        let runner = decoder
            .plan
            .spawn()
            .map_err(|error| failed(Network::Decoder, &error))?;
        Ok(Self {
            runner,
            latent_count: decoder.latent_count,
        })
    }

    /// Decodes `latent` into `offsets_m`, three numbers a vertex.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
    pub fn decode(&mut self, latent: &[f32], offsets_m: &mut [f32]) -> Result<(), RuntimeError> {
        let network = Network::Decoder;
        let latent = Tensor::from_shape(&[1, self.latent_count], latent)
            .map_err(|error| failed(network, &error))?;
        let outputs = self
            .runner
            .run(tvec!(latent.into_tvalue()))
            .map_err(|error| failed(network, &error))?;
        copy_out(network, &outputs[0], offsets_m)
    }
}

/// Optimises a graph and tries it on zeros.
fn plan(network: Network, graph: Graph) -> Result<Arc<TypedRunnableModel>, RuntimeError> {
    let inputs = graph.inputs.iter().map(|port| {
        Tensor::zero::<f32>(&port.shape)
            .map(IntoTValue::into_tvalue)
            .map_err(|error| failed(network, &error))
    });
    let inputs = inputs.collect::<Result<TVec<_>, _>>()?;
    let plan = graph
        .model
        .into_optimized()
        .and_then(|model| model.into_runnable())
        .map_err(|error| failed(network, &error))?;
    let outputs = plan.run(inputs).map_err(|error| failed(network, &error))?;
    for (output, port) in outputs.iter().zip(&graph.outputs) {
        if output.shape() != port.shape {
            let place = format!("output `{}`", port.name);
            let (expected, got) = (format!("{:?}", port.shape), format!("{:?}", output.shape()));
            return Err(broken(network, place, expected, got));
        }
        finite(network, numbers(network, output)?)?;
    }
    Ok(plan)
}

/// Index and length of the port `name`, which must have the shape [1, length].
fn row(network: Network, ports: &[Port], name: &str) -> Result<(usize, usize), RuntimeError> {
    let Some(index) = ports.iter().position(|port| port.name == name) else {
        let expected = format!("a value `{name}`");
        return Err(broken(network, "ports", expected, names(ports)));
    };
    match ports[index].shape[..] {
        [1, length] => Ok((index, length)),
        _ => {
            let got = format!("{:?}", ports[index].shape);
            Err(broken(network, format!("`{name}`"), "shape [1, N]", got))
        }
    }
}

fn names(ports: &[Port]) -> String {
    let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
    format!("{names:?}")
}

fn copy_out(network: Network, value: &TValue, target: &mut [f32]) -> Result<(), RuntimeError> {
    let source = numbers(network, value)?;
    finite(network, source)?;
    if source.len() != target.len() {
        let (expected, got) = (target.len().to_string(), source.len().to_string());
        return Err(broken(network, "output length", expected, got));
    }
    target.copy_from_slice(source);
    Ok(())
}

fn numbers(network: Network, value: &TValue) -> Result<&[f32], RuntimeError> {
    value
        .try_as_plain_ram()
        .and_then(|ram| ram.as_slice::<f32>())
        .map_err(|error| failed(network, &error))
}

fn finite(network: Network, numbers: &[f32]) -> Result<(), RuntimeError> {
    // A sum of finite numbers this small cannot overflow, and it vectorises where `all` does not.
    let sum: f32 = numbers.iter().map(|n| n * 0.0).sum();
    if sum == 0.0 {
        Ok(())
    } else {
        Err(RuntimeError::NonFinite { network })
    }
}

fn failed(network: Network, error: &TractError) -> RuntimeError {
    RuntimeError::Inference {
        network,
        reason: format!("{error:#}"),
    }
}

fn broken(
    network: Network,
    place: impl Into<String>,
    expected: impl Into<String>,
    got: impl Into<String>,
) -> RuntimeError {
    RuntimeError::BrokenContract {
        network,
        place: place.into(),
        expected: expected.into(),
        got: got.into(),
    }
}
