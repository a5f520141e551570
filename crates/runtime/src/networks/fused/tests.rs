//! Fused networks beside tract and beside the plain reference.

use std::sync::Arc;

use dynaskin_onnx::{Graph, Precision, Value, WriteError};
use proptest::prelude::*;
use tract_core::prelude::*;

use super::{Fused, Seldom, operator, recognise, reference};
use crate::networks::plans::Rows;

/// Largest difference from tract, beside numbers of about 1.
const TOLERANCE: f32 = 3e-6;

/// Made-up numbers in -1..1.
fn numbers(seed: u64, count: usize) -> Vec<f32> {
    let number = |index: usize| {
        let mixed = (seed ^ (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
            .wrapping_mul(0xD134_2543_DE82_EF95);
        ((mixed ^ (mixed >> 29)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..count).map(number).collect()
}

/// Rows of numbers by port, and what becomes of them.
struct Table {
    inputs: Vec<Vec<Vec<f32>>>,
    outputs: Vec<Vec<Vec<f32>>>,
    kept: Vec<Vec<f32>>,
}

impl Table {
    /// `inputs` by row and port.
    fn new(inputs: Vec<Vec<Vec<f32>>>) -> Self {
        Self {
            outputs: vec![Vec::new(); inputs.len()],
            kept: vec![Vec::new(); inputs.len()],
            inputs,
        }
    }
}

impl Rows for Table {
    fn fill(&self, port: usize, row: usize, target: &mut [f32]) {
        target.copy_from_slice(&self.inputs[row][port]);
    }

    fn take(&mut self, _port: usize, row: usize, source: &[f32]) {
        self.outputs[row].push(source.to_vec());
    }

    fn kept(&mut self, row: usize) -> &mut Vec<f32> {
        &mut self.kept[row]
    }
}

/// A graph read from its file, as the runtime reads it.
fn model(onnx_bytes: &[u8]) -> TypedModel {
    dynaskin_onnx::read(onnx_bytes, 1)
        .expect("a graph that reads")
        .model
}

/// What tract gives, as `model` stands.
fn by_tract(model: &TypedModel, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let values = model.input_outlets().expect("inputs").iter().zip(inputs);
    let values = values.map(|(outlet, numbers)| {
        let shape = model
            .outlet_fact(*outlet)
            .expect("a fact")
            .shape
            .as_concrete();
        let tensor = Tensor::from_shape(shape.expect("fixed"), numbers).expect("a tensor");
        tensor.into_tvalue()
    });
    let plan = model.clone().into_runnable().expect("a plan");
    let outputs = plan.run(values.collect()).expect("a run");
    let list = |value: &TValue| {
        let view = value.to_plain_array_view::<f32>().expect("numbers");
        view.iter().copied().collect()
    };
    outputs.iter().map(list).collect()
}

fn near(got: &[Vec<f32>], expected: &[Vec<f32>]) -> Result<(), TestCaseError> {
    prop_assert_eq!(got.len(), expected.len());
    for (got, expected) in got.iter().zip(expected) {
        prop_assert_eq!(got.len(), expected.len());
        let size = expected.iter().fold(1.0_f32, |size, x| size.max(x.abs()));
        for (index, (a, b)) in got.iter().zip(expected).enumerate() {
            prop_assert!(
                (a - b).abs() <= TOLERANCE * size,
                "{index}: {a}, expected {b}"
            );
        }
    }
    Ok(())
}

/// A graph put together from random steps.
struct Made {
    graph: Graph,
    /// Values of shape [1, n].
    values: Vec<Value>,
    seed: u64,
}

/// One random step: what, of which value, and a number more.
type Draw = (u8, usize, usize);

impl Made {
    fn new(widths: &[usize], seed: u64) -> Result<Self, WriteError> {
        let mut graph = Graph::new("made up");
        let mut values = Vec::new();
        for (port, &width) in widths.iter().enumerate() {
            let name = if port == 0 {
                "features".to_owned()
            } else {
                format!("state_{port}")
            };
            values.push(graph.input(&name, &[1, width])?);
        }
        Ok(Self {
            graph,
            values,
            seed,
        })
    }

    /// A matrix of blocks, a share of which is zeros: none at 0, all at 4.
    fn matrix(&mut self, rows: usize, columns: usize, zeros: usize) -> Result<Value, WriteError> {
        self.seed += 1;
        let scale = 1.0 / (rows as f32).sqrt();
        let mut weights = numbers(self.seed, rows * columns);
        let (high, wide) = (1 + self.seed as usize % 5, 1 + self.seed as usize % 7);
        let blocks = numbers(self.seed + 77, rows * columns);
        for (index, weight) in weights.iter_mut().enumerate() {
            let block = index / columns / high * columns + index % columns / wide;
            let is_zero = blocks[block] < 0.5 * zeros as f32 - 1.0;
            *weight *= if is_zero { 0.0 } else { scale };
        }
        let name = format!("weights {}", self.seed);
        self.graph
            .weights(&name, &[rows, columns], &weights, Precision::Single)
    }

    fn vector(&mut self, shape: &[usize]) -> Result<Value, WriteError> {
        self.seed += 1;
        let name = format!("vector {}", self.seed);
        let weights = numbers(self.seed, shape.iter().product());
        self.graph
            .weights(&name, shape, &weights, Precision::Single)
    }

    fn step(&mut self, (what, which, more): Draw) -> Result<(), WriteError> {
        let x = self.values[which % self.values.len()].clone();
        let width = x.shape()[1];
        let columns = 1 + more % 50;
        let graph = &mut self.graph;
        let made = match what % 14 {
            0 => {
                let matrix = self.matrix(width, columns, more % 5)?;
                self.graph.matmul(&x, &matrix)?
            }
            1 | 2 => {
                let matrix = self.matrix(width, columns, more % 5)?;
                let bias = self.vector(&[columns])?;
                self.graph.dense(&x, &matrix, &bias)?
            }
            3 => graph.sigmoid(&x),
            4 => graph.tanh(&x),
            5 => {
                let x = graph.tanh(&x);
                graph.exp(&x)
            }
            6 => graph.relu(&x),
            7 => {
                let other = self.values[more % self.values.len()].clone();
                self.graph.concat(&[&x, &other], 1)?
            }
            8 => {
                let indices: Vec<usize> = (0..columns).map(|i| (i * more + i) % width).collect();
                graph.gather(&x, 1, &indices)?
            }
            9 if width > 1 => {
                let first = 1 + more % (width - 1);
                let parts = graph.split(&x, 1, &[first, width - first])?;
                parts[more % 2].clone()
            }
            10 => {
                let triples = graph.concat(&[&x, &x, &x], 1)?;
                let triples = graph.reshape(&triples, &[1, width, 3])?;
                let turned = graph.transpose(&triples, &[0, 2, 1])?;
                graph.reshape(&turned, &[1, 3 * width])?
            }
            11 => {
                let factors = self.vector(&[width])?;
                let scaled = self.graph.mul(&x, &factors)?;
                let other = self.vector(&[1, width])?;
                let changed = self.graph.sub(&other, &scaled)?;
                let limits = self.vector(&[width])?;
                self.graph.sub(&changed, &limits)?
            }
            _ => {
                let matrix = self.matrix(width, columns, more % 5)?;
                let a = self.graph.matmul(&x, &matrix)?;
                let y = self.values[more % self.values.len()].clone();
                let matrix = self.matrix(y.shape()[1], columns, 3)?;
                let b = self.graph.matmul(&y, &matrix)?;
                match what % 3 {
                    0 => self.graph.add(&a, &b)?,
                    1 => self.graph.mul(&a, &b)?,
                    _ => self.graph.sub(&a, &b)?,
                }
            }
        };
        if made.shape()[1] < 400 {
            self.values.push(made);
        }
        Ok(())
    }

    /// The file, whose outputs are the last values.
    fn onnx(widths: &[usize], seed: u64, draws: &[Draw]) -> Result<Vec<u8>, WriteError> {
        let mut made = Self::new(widths, seed)?;
        for draw in draws {
            made.step(*draw)?;
        }
        let last = made
            .values
            .iter()
            .rev()
            .take(3)
            .cloned()
            .collect::<Vec<_>>();
        for (index, value) in last.iter().enumerate() {
            made.graph.output(&format!("output {index}"), value)?;
        }
        Ok(made.graph.into_bytes())
    }
}

fn draws() -> impl Strategy<Value = Vec<Draw>> {
    prop::collection::vec((any::<u8>(), 0..1000_usize, 0..1000_usize), 1..14)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_graph_gives_what_tract_gives_whatever_changes_seldom(
        widths in prop::collection::vec(1..40_usize, 1..4),
        seed in any::<u32>(),
        draws in draws(),
        (from, to) in (0..40_usize, 0..40_usize),
    ) {
        let onnx_bytes = Made::onnx(&widths, seed.into(), &draws).expect("a graph");
        let model = model(&onnx_bytes);
        let (from, to) = (from.min(to).min(widths[0]), from.max(to).min(widths[0]));
        let seldom = Seldom { port: 0, numbers: from..to };
        let fused = Fused::new(&model, Some(seldom.clone())).expect("a recognised graph");
        let whole = Fused::new(&model, None).expect("a recognised graph");
        let (mut memory, mut whole_memory) = (fused.memory(), whole.memory());
        let row = |seed: u64| -> Vec<Vec<f32>> {
            widths.iter().enumerate().map(|(port, width)| numbers(seed * 10 + port as u64, *width)).collect()
        };
        // Eleven rows: more than run together at once. What changes seldom stays for the second tick
        // and changes for the third.
        let mut table = Table::new((0..11).map(|n| row(u64::from(seed) + n)).collect());
        let mut whole_table = Table::new(table.inputs.clone());
        for tick in 0..3 {
            for (n, inputs) in table.inputs.iter_mut().enumerate() {
                let held = inputs[0][seldom.numbers.clone()].to_vec();
                *inputs = row(u64::from(seed) + 100 * (tick + 1) + n as u64);
                if tick == 1 {
                    inputs[0][seldom.numbers.clone()].copy_from_slice(&held);
                }
            }
            whole_table.inputs.clone_from(&table.inputs);
            for table in [&mut table, &mut whole_table] {
                table.outputs.iter_mut().for_each(Vec::clear);
            }
            fused.run(&mut memory, 11, &mut table);
            whole.run(&mut whole_memory, 11, &mut whole_table);
            for n in 0..11 {
                let expected = by_tract(&model, &table.inputs[n]);
                near(&table.outputs[n], &expected)?;
                near(&whole_table.outputs[n], &expected)?;
            }
            // Alone, and without anything kept: the same bits.
            let mut alone = Table::new(vec![table.inputs[5].clone()]);
            fused.run(&mut fused.memory(), 1, &mut alone);
            prop_assert_eq!(&alone.outputs[0], &table.outputs[5]);
        }
    }

    #[test]
    fn the_plain_reference_gives_the_same(
        widths in prop::collection::vec(1..40_usize, 1..4),
        seed in any::<u32>(),
        draws in draws(),
    ) {
        let onnx_bytes = Made::onnx(&widths, seed.into(), &draws).expect("a graph");
        let model = model(&onnx_bytes);
        let calculation = recognise::recognise(&model).expect("a recognised graph");
        let inputs: Vec<Vec<f32>> = widths.iter().map(|width| numbers(seed.into(), *width)).collect();
        let expected = reference::run(&calculation, &inputs);
        let fused = Fused::new(&model, None).expect("a recognised graph");
        let mut table = Table::new(vec![inputs]);
        fused.run(&mut fused.memory(), 1, &mut table);
        near(&table.outputs[0], &expected)?;
    }
}

#[test]
fn tract_runs_the_operator_as_it_runs_the_graph() {
    let draws: Vec<Draw> = (0..12)
        .map(|n| (n, 3 * usize::from(n), 11 * usize::from(n)))
        .collect();
    let onnx_bytes = Made::onnx(&[9, 5], 3, &draws).expect("a graph");
    let model = model(&onnx_bytes);
    let seldom = Seldom {
        port: 0,
        numbers: 4..9,
    };
    let fused = Arc::new(Fused::new(&model, Some(seldom)).expect("a recognised graph"));
    let whole = operator(&model, &fused).expect("a model of one operator");
    let inputs = [numbers(5, 9), numbers(6, 5)];
    let (got, expected) = (by_tract(&whole, &inputs), by_tract(&model, &inputs));
    near(&got, &expected).expect("the same numbers");
    let operators = whole
        .nodes
        .iter()
        .filter(|node| node.op.name() == "FusedNetwork");
    assert_eq!((operators.count(), whole.nodes.len()), (1, 3));
}

#[test]
fn graphs_with_other_operators_are_not_recognised() {
    let product_of_two = || -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("two inputs multiplied");
        let a = graph.input("features", &[1, 3])?;
        let b = graph.input("state_b", &[3, 2])?;
        let product = graph.matmul(&a, &b)?;
        graph.output("latent", &product)?;
        Ok(graph.into_bytes())
    };
    let several_rows = || -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("two rows");
        let a = graph.input("features", &[2, 3])?;
        let matrix = graph.weights("matrix", &[3, 2], &[0.5; 6], Precision::Single)?;
        let product = graph.matmul(&a, &matrix)?;
        graph.output("latent", &product)?;
        Ok(graph.into_bytes())
    };
    for onnx_bytes in [product_of_two(), several_rows()] {
        let model = model(&onnx_bytes.expect("a graph"));
        assert!(Fused::new(&model, None).is_err());
    }
}
