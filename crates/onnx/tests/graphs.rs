//! Graphs written here, run by tract and by onnxruntime, against plain Rust.

use std::process::Command;

use dynaskin_onnx::{Graph, GruWeights, LstmWeights, Precision, Value, WriteError};
use tract_onnx::prelude::*;

const INPUTS: usize = 5;
const CELLS: usize = 4;

/// Made-up numbers in -1..1.
fn numbers(seed: usize, count: usize) -> Vec<f32> {
    (0..count)
        .map(|idx| ((seed * 7919 + idx * 104_729) as f32 * 0.618_034).sin())
        .collect()
}

fn run_tract(onnx_bytes: &[u8], inputs: &[Vec<f32>]) -> anyhow::Result<Vec<Vec<f32>>> {
    let model = tract_onnx::onnx()
        .model_for_read(&mut &onnx_bytes[..])?
        .into_optimized()?
        .into_runnable()?;
    let inputs = inputs.iter().map(|row| {
        let tensor = Tensor::from_shape(&[1, row.len()], row)?;
        anyhow::Ok(tensor.into_tvalue())
    });
    let outputs = model.run(inputs.collect::<Result<_, _>>()?)?;
    outputs
        .iter()
        .map(|value| {
            Ok(value
                .to_plain_array_view::<f32>()?
                .iter()
                .copied()
                .collect())
        })
        .collect()
}

fn assert_close(got: &[f32], expected: &[f32]) {
    assert_eq!(got.len(), expected.len());
    for (a, b) in got.iter().zip(expected) {
        assert!((a - b).abs() < 1e-5, "{got:?} is not {expected:?}");
    }
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

/// `x · w` for `w` [x.len(), columns].
fn product(x: &[f32], w: &[f32], columns: usize) -> Vec<f32> {
    let mut out = vec![0.0; columns];
    for (row, value) in x.iter().enumerate() {
        for (column, sum) in out.iter_mut().enumerate() {
            *sum += value * w[row * columns + column];
        }
    }
    out
}

/// Normalisation, an LSTM step and a joined, clamped output: every operation there is.
fn lstm_graph(precision: Precision) -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("lstm");
    let features = graph.input("features", &[1, INPUTS])?;
    let hidden = graph.input("state_h", &[1, CELLS])?;
    let cell = graph.input("state_c", &[1, CELLS])?;
    let mean = graph.weights("mean", &[INPUTS], &numbers(1, INPUTS), Precision::Single)?;
    let scale = graph.weights("scale", &[INPUTS], &numbers(2, INPUTS), Precision::Single)?;
    let x = graph.sub(&features, &mean)?;
    let x = graph.mul(&x, &scale)?;
    let gates = 4 * CELLS;
    let from_input = numbers(3, INPUTS * gates);
    let from_hidden = numbers(4, CELLS * gates);
    let weights = LstmWeights {
        from_input: &graph.weights("w", &[INPUTS, gates], &from_input, precision)?,
        from_hidden: &graph.weights("r", &[CELLS, gates], &from_hidden, precision)?,
        bias: &graph.weights("b", &[gates], &numbers(5, gates), precision)?,
    };
    let (next_hidden, next_cell) = graph.lstm_cell(&x, &hidden, &cell, weights)?;
    let clamped = graph.relu(&next_hidden);
    let joined = graph.concat(&[&next_hidden, &clamped], 1)?;
    graph.output("latent", &joined)?;
    graph.output("state_h_out", &next_hidden)?;
    graph.output("state_c_out", &next_cell)?;
    Ok(graph.into_bytes())
}

fn lstm_inputs() -> Vec<Vec<f32>> {
    vec![numbers(6, INPUTS), numbers(7, CELLS), numbers(8, CELLS)]
}

fn lstm_expected() -> Vec<Vec<f32>> {
    let [features, hidden, cell] = &lstm_inputs()[..] else {
        unreachable!()
    };
    let normalised: Vec<f32> = (0..INPUTS)
        .map(|k| (features[k] - numbers(1, INPUTS)[k]) * numbers(2, INPUTS)[k])
        .collect();
    let gates = 4 * CELLS;
    let mut sums = product(&normalised, &numbers(3, INPUTS * gates), gates);
    let recurrent = product(hidden, &numbers(4, CELLS * gates), gates);
    for k in 0..gates {
        sums[k] += recurrent[k] + numbers(5, gates)[k];
    }
    let (mut next_hidden, mut next_cell) = (vec![], vec![]);
    for k in 0..CELLS {
        let [input, output, forget, candidate] = [0, 1, 2, 3].map(|gate| sums[gate * CELLS + k]);
        let c = sigmoid(forget) * cell[k] + sigmoid(input) * candidate.tanh();
        next_cell.push(c);
        next_hidden.push(sigmoid(output) * c.tanh());
    }
    let mut joined = next_hidden.clone();
    joined.extend(next_hidden.iter().map(|h| h.max(0.0)));
    vec![joined, next_hidden, next_cell]
}

#[test]
fn an_lstm_step_gives_the_numbers_of_its_equations() {
    let onnx_bytes = lstm_graph(Precision::Single).unwrap();
    let outputs = run_tract(&onnx_bytes, &lstm_inputs()).unwrap();
    for (got, expected) in outputs.iter().zip(lstm_expected()) {
        assert_close(got, &expected);
    }
}

#[test]
fn half_precision_weights_are_half_the_bytes_and_nearly_the_numbers() {
    let half = lstm_graph(Precision::Half).unwrap();
    assert!(half.len() < lstm_graph(Precision::Single).unwrap().len());
    let outputs = run_tract(&half, &lstm_inputs()).unwrap();
    for (a, b) in outputs[0].iter().zip(&lstm_expected()[0]) {
        assert!((a - b).abs() < 3e-3, "{a} {b}");
    }
}

#[test]
fn short_halves_have_eight_significant_bits_and_stay_finite() {
    let numbers = [
        0.0, 1.0, 1.003_9, -1.003_9, 1.002, 65_504.0, -65_504.0, 6e-8, 255.5,
    ];
    let mut graph = Graph::new("short");
    let x = graph.input("x", &[1, 1]).unwrap();
    let weights = graph
        .weights("w", &[1, numbers.len()], &numbers, Precision::ShortHalf)
        .unwrap();
    let y = graph.matmul(&x, &weights).unwrap();
    graph.output("y", &y).unwrap();
    let got = run_tract(&graph.into_bytes(), &[vec![1.0]]).unwrap();
    // Between 1 and 2 steps are of 1/128; the largest number has no neighbour above it.
    let expected = [
        0.0,
        1.0,
        1.007_812_5,
        -1.007_812_5,
        1.0,
        65_504.0,
        -65_504.0,
        0.0,
        256.0,
    ];
    for (got, expected) in got[0].iter().zip(expected) {
        assert!((got - expected).abs() < 5e-7, "{got} {expected}");
    }
}

#[test]
fn gathered_parts_stand_in_the_order_of_their_indices() {
    let mut graph = Graph::new("gather");
    let x = graph.input("x", &[1, 6]).unwrap();
    let pairs = graph.reshape(&x, &[1, 3, 2]).unwrap();
    let turned = graph.gather(&pairs, 1, &[2, 0, 1]).unwrap();
    graph.output("y", &turned).unwrap();
    let error = graph.gather(&pairs, 1, &[3]).unwrap_err();
    assert!(matches!(error, WriteError::Shape { .. }), "{error}");
    let x: Vec<f32> = (0..6u8).map(f32::from).collect();
    let got = run_tract(&graph.into_bytes(), &[x]).unwrap();
    assert_eq!(got, [[4.0, 5.0, 0.0, 1.0, 2.0, 3.0]]);
}

#[test]
fn a_gru_step_gives_the_numbers_of_its_equations() {
    let gates = 3 * CELLS;
    let build = || -> Result<Vec<u8>, WriteError> {
        let mut graph = Graph::new("gru");
        let x = graph.input("features", &[1, INPUTS])?;
        let hidden = graph.input("state_h", &[1, CELLS])?;
        let mut weights = |name: &str, shape: &[usize], seed| -> Result<Value, WriteError> {
            let count = shape.iter().product();
            graph.weights(name, shape, &numbers(seed, count), Precision::Single)
        };
        let from_input = weights("w", &[INPUTS, gates], 1)?;
        let from_hidden = weights("r", &[CELLS, gates], 2)?;
        let input_bias = weights("bw", &[gates], 3)?;
        let hidden_bias = weights("br", &[gates], 4)?;
        let weights = GruWeights {
            from_input: &from_input,
            from_hidden: &from_hidden,
            input_bias: &input_bias,
            hidden_bias: &hidden_bias,
        };
        let next = graph.gru_cell(&x, &hidden, weights)?;
        graph.output("state_h_out", &next)?;
        Ok(graph.into_bytes())
    };
    let (x, hidden) = (numbers(5, INPUTS), numbers(6, CELLS));
    let outputs = run_tract(&build().unwrap(), &[x.clone(), hidden.clone()]).unwrap();

    let mut from_x = product(&x, &numbers(1, INPUTS * gates), gates);
    let mut from_h = product(&hidden, &numbers(2, CELLS * gates), gates);
    for k in 0..gates {
        from_x[k] += numbers(3, gates)[k];
        from_h[k] += numbers(4, gates)[k];
    }
    let expected: Vec<f32> = (0..CELLS)
        .map(|k| {
            let update = sigmoid(from_x[k] + from_h[k]);
            let reset = sigmoid(from_x[CELLS + k] + from_h[CELLS + k]);
            let candidate = (from_x[2 * CELLS + k] + reset * from_h[2 * CELLS + k]).tanh();
            (1.0 - update) * candidate + update * hidden[k]
        })
        .collect();
    assert_close(&outputs[0], &expected);
}

#[test]
fn shapes_counts_names_and_numbers_are_checked() {
    let mut graph = Graph::new("bad");
    let x = graph.input("x", &[1, 3]).unwrap();
    let weight = graph
        .weights("w", &[2, 2], &[0.0; 4], Precision::Single)
        .unwrap();
    let bias = graph
        .weights("b", &[2], &[0.0; 2], Precision::Single)
        .unwrap();
    assert!(matches!(
        graph.dense(&x, &weight, &bias),
        Err(WriteError::Shape { op: "Gemm", .. })
    ));
    assert!(matches!(
        graph.split(&x, 1, &[1, 1]),
        Err(WriteError::Shape { op: "Split", .. })
    ));
    assert!(matches!(
        graph.weights("c", &[2], &[0.0; 3], Precision::Single),
        Err(WriteError::WeightCount {
            expected: 2,
            got: 3,
            ..
        })
    ));
    assert!(matches!(
        graph.weights("w", &[1], &[0.0], Precision::Single),
        Err(WriteError::DuplicateName { .. })
    ));
    for (number, precision) in [(f32::NAN, Precision::Single), (7e4, Precision::Half)] {
        assert!(matches!(
            graph.weights("d", &[2], &[0.0, number], precision),
            Err(WriteError::WeightValue { index: 1, .. })
        ));
    }
}

/// Runs the file through `onnx.checker` and onnxruntime. Needs Python with the packages onnx,
/// onnxruntime and numpy: `DYNASKIN_PYTHON` names the interpreter, else `python3`.
#[test]
fn onnx_checker_passes_and_onnxruntime_agrees() {
    let python = std::env::var("DYNASKIN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let packages = Command::new(&python)
        .args(["-c", "import onnx, onnxruntime, numpy"])
        .output();
    if !packages.is_ok_and(|output| output.status.success()) {
        println!(
            "skipped: onnx_checker_passes_and_onnxruntime_agrees needs Python with onnx, \
             onnxruntime and numpy"
        );
        return;
    }
    const SCRIPT: &str = r#"
import json, sys, onnx, onnxruntime, numpy
onnx.checker.check_model(onnx.load(sys.argv[1]), full_check=True)
session = onnxruntime.InferenceSession(sys.argv[1])
names = [i.name for i in session.get_inputs()]
rows = [numpy.array([row], dtype=numpy.float32) for row in json.loads(sys.argv[2])]
print(json.dumps([o.flatten().tolist() for o in session.run(None, dict(zip(names, rows)))]))
"#;
    for precision in [Precision::Single, Precision::Half] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lstm.onnx");
        let onnx_bytes = lstm_graph(precision).unwrap();
        std::fs::write(&path, &onnx_bytes).unwrap();
        let inputs = serde_json::to_string(&lstm_inputs()).unwrap();
        let output = Command::new(&python)
            .args(["-c", SCRIPT])
            .arg(&path)
            .arg(inputs)
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        let theirs: Vec<Vec<f32>> = serde_json::from_slice(&output.stdout).unwrap();
        let ours = run_tract(&onnx_bytes, &lstm_inputs()).unwrap();
        assert_eq!(theirs.len(), 3);
        for (a, b) in theirs.iter().zip(&ours) {
            assert_close(a, b);
        }
    }
}
