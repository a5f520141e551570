//! A network as tract runs it: one plan for a single row and one for [`BATCH`] rows at once.
//!
//! A row is one avatar's call of the network. A single row makes every weight matrix times a
//! vector, which reads each weight once for one multiplication; a batch makes it times a matrix,
//! which reads it once for eight. The files of the contract have one row, so the batched plan is
//! the same graph translated with a longer first axis, and it is used only where it gives what
//! the single plan gives.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use tract_core::prelude::*;

use super::plans::{BATCH, Rows, finite};
use crate::onnx::{Graph, read};
use crate::ports::Port;
use crate::{Network, RuntimeError};

/// Least rows for which a batch with unused rows is faster than as many single runs.
const LEAST_BATCHED: usize = 3;

/// Largest difference of a batched from a single run, as a fraction of the largest number put out.
const BATCH_TOLERANCE: f32 = 1e-4;

/// A graph's plans.
#[derive(Debug)]
pub(crate) struct GraphPlans {
    network: Network,
    onnx_bytes: Box<[u8]>,
    input_widths: Vec<usize>,
    single: Arc<TypedRunnableModel>,
    /// Made when first needed; none where the graph cannot be batched.
    batched: OnceLock<Option<Arc<TypedRunnableModel>>>,
}

impl GraphPlans {
    /// Optimises `graph`, read from `onnx_bytes`, and tries it on zeros.
    ///
    /// # Errors
    /// [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
    pub fn new(network: Network, onnx_bytes: &[u8], graph: Graph) -> Result<Self, RuntimeError> {
        let width = |port: &Port| port.shape.iter().product();
        Ok(Self {
            network,
            onnx_bytes: onnx_bytes.into(),
            input_widths: graph.inputs.iter().map(width).collect(),
            single: plan(network, graph)?,
            batched: OnceLock::new(),
        })
    }

    /// The batched plan, where it can be made and agrees with the single one.
    fn batched(&self) -> Option<&Arc<TypedRunnableModel>> {
        let make = || {
            let graph = read(self.network, &self.onnx_bytes, BATCH).ok()?;
            let batched = plan(self.network, graph).ok()?;
            self.agrees(&batched).then_some(batched)
        };
        self.batched.get_or_init(make).as_ref()
    }

    /// Whether `batched` gives in each row what a single run of that row gives.
    fn agrees(&self, batched: &Arc<TypedRunnableModel>) -> bool {
        let mut singles = Probe::default();
        let mut batch = Probe::default();
        let ran = self.single.spawn().and_then(|mut runner| {
            let widths = &self.input_widths;
            (0..BATCH)
                .try_for_each(|row| run(&mut runner, widths, 1, row..row + 1, &mut singles))?;
            run(&mut batched.spawn()?, widths, BATCH, 0..BATCH, &mut batch)
        });
        let got = batch.rows.concat();
        let expected = singles.rows.concat();
        let size = expected.iter().fold(0.0_f32, |size, x| size.max(x.abs()));
        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= BATCH_TOLERANCE * size;
        ran.is_ok() && got.len() == expected.len() && got.iter().zip(&expected).all(near)
    }
}

/// Made-up numbers, different in each row, and what becomes of them.
#[derive(Default)]
struct Probe {
    rows: [Vec<f32>; BATCH],
    kept: [Vec<f32>; BATCH],
}

impl Rows for Probe {
    fn fill(&self, port: usize, row: usize, target: &mut [f32]) {
        for (slot, number) in target.iter_mut().enumerate() {
            *number = ((port * 7 + row * 31 + slot * 13) as f32).sin();
        }
    }

    fn take(&mut self, _port: usize, row: usize, source: &[f32]) {
        self.rows[row].extend_from_slice(source);
    }

    fn kept(&mut self, row: usize) -> &mut Vec<f32> {
        &mut self.kept[row]
    }
}

/// What runs a graph's plans.
#[derive(Debug)]
pub(crate) struct GraphRunner {
    plans: Arc<GraphPlans>,
    single: TypedSimpleState,
    batched: Option<TypedSimpleState>,
}

impl GraphRunner {
    /// Sets up runs of `plans`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot.
    pub fn new(plans: &Arc<GraphPlans>) -> Result<Self, RuntimeError> {
        let single = plans.single.spawn();
        Ok(Self {
            single: single.map_err(|error| failed(plans.network, &error))?,
            plans: Arc::clone(plans),
            batched: None,
        })
    }

    /// Runs the rows 0 to `count` of `rows`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`].
    pub fn run(&mut self, count: usize, rows: &mut impl Rows) -> Result<(), RuntimeError> {
        let network = self.plans.network;
        let widths = &self.plans.input_widths;
        if count >= LEAST_BATCHED
            && self.batched.is_none()
            && let Some(plan) = self.plans.batched()
        {
            self.batched = Some(plan.spawn().map_err(|error| failed(network, &error))?);
        }
        let mut start = 0;
        while start < count {
            let (end, ran) = match &mut self.batched {
                Some(batched) if count - start >= LEAST_BATCHED => {
                    let end = count.min(start + BATCH);
                    (end, run(batched, widths, BATCH, start..end, rows))
                }
                _ => {
                    let end = start + 1;
                    (end, run(&mut self.single, widths, 1, start..end, rows))
                }
            };
            ran.map_err(|error| failed(network, &error))?;
            start = end;
        }
        Ok(())
    }
}

/// One run of a plan for `length` rows with those of `range`, which may be fewer.
fn run(
    runner: &mut TypedSimpleState,
    widths: &[usize],
    length: usize,
    range: Range<usize>,
    rows: &mut impl Rows,
) -> TractResult<()> {
    let mut inputs: TVec<TValue> = TVec::with_capacity(widths.len());
    for (port, &width) in widths.iter().enumerate() {
        let mut tensor = Tensor::zero::<f32>(&[length, width])?;
        let mut ram = tensor.try_as_plain_ram_mut()?;
        let numbers = ram.as_slice_mut::<f32>()?;
        for (row, target) in range.clone().zip(numbers.chunks_exact_mut(width.max(1))) {
            rows.fill(port, row, target);
        }
        inputs.push(tensor.into_tvalue());
    }
    let outputs = runner.run(inputs)?;
    for (port, output) in outputs.iter().enumerate() {
        let ram = output.try_as_plain_ram()?;
        let numbers = ram.as_slice::<f32>()?;
        let width = (numbers.len() / length).max(1);
        for (row, source) in range.clone().zip(numbers.chunks_exact(width)) {
            rows.take(port, row, source);
        }
    }
    Ok(())
}

/// Optimises a graph and tries it on zeros.
pub(super) fn plan(
    network: Network,
    graph: Graph,
) -> Result<Arc<TypedRunnableModel>, RuntimeError> {
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
            return Err(RuntimeError::BrokenContract {
                network,
                place: format!("output `{}`", port.name),
                expected: format!("{:?}", port.shape),
                got: format!("{:?}", output.shape()),
            });
        }
        let numbers = output
            .try_as_plain_ram()
            .and_then(|ram| ram.as_slice::<f32>())
            .map_err(|error| failed(network, &error))?;
        if !finite(numbers) {
            return Err(RuntimeError::NonFinite { network });
        }
    }
    Ok(plan)
}

pub(super) fn failed(network: Network, error: &TractError) -> RuntimeError {
    RuntimeError::Inference {
        network,
        reason: format!("{error:#}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "guests")]
    use dynaskin_onnx::{Graph, Precision, Steps, WriteError};

    /// The networks of a shipped model.
    fn shipped(network: Network) -> GraphPlans {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/female");
        let path = format!("{folder}/{network}.onnx");
        let onnx_bytes = std::fs::read(path).expect("a shipped network");
        let graph = read(network, &onnx_bytes, 1).expect("a valid graph");
        GraphPlans::new(network, &onnx_bytes, graph).expect("a network that runs")
    }

    #[test]
    fn the_shipped_networks_can_be_batched() {
        for network in [Network::Predictor, Network::Decoder] {
            assert!(shipped(network).batched().is_some(), "{network}");
        }
    }

    #[cfg(feature = "guests")]
    #[test]
    fn convolutions_can_be_batched() {
        let plans = || -> anyhow::Result<GraphPlans> {
            let onnx_bytes = convolutional_decoder()?;
            let graph = read(Network::Decoder, &onnx_bytes, 1)?;
            Ok(GraphPlans::new(Network::Decoder, &onnx_bytes, graph)?)
        };
        let plans = plans().expect("a network that runs");
        assert!(plans.batched().is_some());
    }

    /// Four numbers to eleven vertices through every operator that DSNet's decoder has.
    #[cfg(feature = "guests")]
    fn convolutional_decoder() -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("decoder");
        let weights = |graph: &mut Graph, name: &str, shape: &[usize]| {
            let count: usize = shape.iter().product();
            let numbers: Vec<f32> = (0..count).map(|i| (i as f32 * 1.7).sin()).collect();
            graph.weights(name, shape, &numbers, Precision::Half)
        };
        let latent = graph.input("latent", &[1, 4])?;
        let dense = weights(&mut graph, "dense", &[4, 18])?;
        let up = weights(&mut graph, "up", &[3, 2, 5])?;
        let up_bias = weights(&mut graph, "up bias", &[2])?;
        let out = weights(&mut graph, "out", &[3, 2, 1])?;
        let out_bias = weights(&mut graph, "out bias", &[3])?;
        let x = graph.matmul(&latent, &dense)?;
        let x = graph.reshape(&x, &[1, 3, 6])?;
        let steps = Steps {
            stride: 2,
            padding: 2,
            output_padding: 0,
        };
        let x = graph.conv_transpose1d(&x, &up, &up_bias, steps)?;
        let x = graph.relu(&x);
        let steps = Steps {
            stride: 1,
            padding: 0,
            output_padding: 0,
        };
        let x = graph.conv1d(&x, &out, &out_bias, steps)?;
        let x = graph.exp(&x);
        let offsets = graph.transpose(&x, &[0, 2, 1])?;
        graph.output("offsets", &offsets)?;
        Ok(graph.into_bytes())
    }

    #[test]
    fn a_batch_that_disagrees_is_not_used() {
        let plans = shipped(Network::Decoder);
        let other = shipped(Network::Predictor);
        let wrong = other.batched().expect("a batched plan");
        assert!(!plans.agrees(wrong));
        // A single row in the batch's place gives no eight rows.
        assert!(!plans.agrees(&plans.single));
    }
}
