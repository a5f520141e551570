//! The bytes of a written file, held to those of the writer's first version.

use dynaskin_onnx::{Graph, GruWeights, LstmWeights, Precision, Steps, Value, WriteError};
use sha2::{Digest, Sha256};

/// Of [`network`] without the field that carries this crate's version.
const SHA256: &str = "98681c4376c31a9caf767d84440899ec62ebfcb00cd861619603c6cd30afbed5";

/// Of the same.
const LENGTH_BYTES: usize = 5196;

/// Made-up weights with exact bits: multiples of 1/64 in -4..4.
fn weights(graph: &mut Graph, name: &str, shape: &[usize]) -> Result<Value, WriteError> {
    let count: usize = shape.iter().product();
    let number = |index: usize| ((index * 37 + name.len() * 101) % 512) as f32 / 64.0 - 4.0;
    let numbers: Vec<f32> = (0..count).map(number).collect();
    let precision = if name.ends_with("half") {
        Precision::Half
    } else {
        Precision::Single
    };
    graph.weights(name, shape, &numbers, precision)
}

/// A network with every operation of the writer.
fn network() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("every operation");
    let features = graph.input("features", &[1, 6])?;
    let hidden = graph.input("state_h", &[1, 4])?;
    let cell = graph.input("state_c", &[1, 4])?;
    let mean = weights(&mut graph, "mean", &[6])?;
    let scale = weights(&mut graph, "scale half", &[6])?;
    let x = graph.sub(&features, &mean)?;
    let x = graph.mul(&x, &scale)?;
    let lstm = LstmWeights {
        from_input: &weights(&mut graph, "lstm w half", &[6, 16])?,
        from_hidden: &weights(&mut graph, "lstm r", &[4, 16])?,
        bias: &weights(&mut graph, "lstm b", &[16])?,
    };
    let (next_hidden, next_cell) = graph.lstm_cell(&x, &hidden, &cell, lstm)?;
    let gru = GruWeights {
        from_input: &weights(&mut graph, "gru w", &[6, 12])?,
        from_hidden: &weights(&mut graph, "gru r half", &[4, 12])?,
        input_bias: &weights(&mut graph, "gru bw", &[12])?,
        hidden_bias: &weights(&mut graph, "gru br half", &[12])?,
    };
    let other = graph.gru_cell(&x, &next_hidden, gru)?;
    let squashed = graph.sigmoid(&other);
    let squashed = graph.tanh(&squashed);
    let squashed = graph.relu(&squashed);
    let squashed = graph.exp(&squashed);
    let squashed = graph.log(&squashed);
    let joined = graph.concat(&[&next_hidden, &squashed], 1)?;
    // Along axis 0, whose number a file leaves out.
    let stacked = graph.concat(&[&joined, &joined], 0)?;
    let halves = graph.split(&stacked, 0, &[1, 1])?;
    let sum = graph.add(&halves[0], &halves[1])?;
    let matrix = weights(&mut graph, "matrix", &[8, 12])?;
    let bias = weights(&mut graph, "bias", &[12])?;
    let dense = graph.dense(&sum, &matrix, &bias)?;
    let channels = graph.reshape(&dense, &[1, 3, 4])?;
    let kernel = weights(&mut graph, "kernel", &[2, 3, 3])?;
    let kernel_bias = weights(&mut graph, "kernel bias", &[2])?;
    let steps = Steps {
        stride: 1,
        padding: 1,
        output_padding: 0,
    };
    let down = graph.conv1d(&channels, &kernel, &kernel_bias, steps)?;
    let kernel = weights(&mut graph, "up half", &[2, 3, 5])?;
    let kernel_bias = weights(&mut graph, "up bias", &[3])?;
    let steps = Steps {
        stride: 2,
        padding: 2,
        output_padding: 1,
    };
    let up = graph.conv_transpose1d(&down, &kernel, &kernel_bias, steps)?;
    let turned = graph.transpose(&up, &[0, 2, 1])?;
    let picked = graph.gather(&turned, 1, &[7, 0, 3])?;
    let square = weights(&mut graph, "square", &[4, 4])?;
    let square = graph.matmul(&next_hidden, &square)?;
    graph.output("offsets", &picked)?;
    graph.output("latent", &square)?;
    graph.output("state_h_out", &next_hidden)?;
    graph.output("state_c_out", &next_cell)?;
    Ok(graph.into_bytes())
}

#[test]
fn a_fixed_network_gives_the_bytes_it_always_gave() {
    let onnx_bytes = network().expect("a graph");
    // `producer_version`, field 3 of the file's message.
    let version = env!("CARGO_PKG_VERSION");
    let field = [&[0x1a, version.len() as u8], version.as_bytes()].concat();
    let at = onnx_bytes
        .windows(field.len())
        .position(|window| window == field)
        .expect("the version");
    let rest = [&onnx_bytes[..at], &onnx_bytes[at + field.len()..]].concat();
    let hash: String = Sha256::digest(&rest)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    assert_eq!((rest.len(), hash.as_str()), (LENGTH_BYTES, SHA256));
}
