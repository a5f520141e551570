//! Networks of the contract, as small as they can be, with every operator that is read.

use dynaskin_onnx::{Graph, GruWeights, LstmWeights, Precision, Steps, Value, WriteError};

use crate::{made_up, stage};

/// Numbers of a predictor's features, state and latent.
const FEATURES: usize = 3;
const CELLS: usize = 2;
const LATENTS: usize = 2;

/// An LSTM, a GRU, one of every elementary operator, and the one of the made-up model, also lowered.
pub fn predictors() -> Vec<Vec<u8>> {
    let made = [lstm(), gru(), elementary()];
    let mut files: Vec<Vec<u8>> = made
        .into_iter()
        .map(|graph| graph.expect("a made-up predictor is a valid graph"))
        .collect();
    files.push(stage::networks().0.clone());
    files.push(stage::lowered().predictor.clone());
    files
}

/// A dense layer in half precision, one over rows and reordered vertices, convolutions, and the one of the made-up
/// model, lowered.
pub fn decoders() -> Vec<Vec<u8>> {
    let made = [dense(), reordered(), convolutions()];
    let mut files: Vec<Vec<u8>> = made
        .into_iter()
        .map(|graph| graph.expect("a made-up decoder is a valid graph"))
        .collect();
    files.push(stage::lowered().decoder.clone());
    files
}

fn weights(graph: &mut Graph, name: &str, shape: &[usize]) -> Result<Value, WriteError> {
    let list = made_up::numbers(name.len() + shape.len(), shape.iter().product());
    graph.weights(name, shape, &list, Precision::Single)
}

fn lstm() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("predictor");
    let x = graph.input("features", &[1, FEATURES])?;
    let hidden = graph.input("state_h", &[1, CELLS])?;
    let cell = graph.input("state_c", &[1, CELLS])?;
    let from_input = weights(&mut graph, "w", &[FEATURES, 4 * CELLS])?;
    let from_hidden = weights(&mut graph, "r", &[CELLS, 4 * CELLS])?;
    let bias = weights(&mut graph, "b", &[4 * CELLS])?;
    let gates = LstmWeights {
        from_input: &from_input,
        from_hidden: &from_hidden,
        bias: &bias,
    };
    let (hidden, cell) = graph.lstm_cell(&x, &hidden, &cell, gates)?;
    graph.output("latent", &hidden)?;
    graph.output("state_h_out", &hidden)?;
    graph.output("state_c_out", &cell)?;
    Ok(graph.into_bytes())
}

fn gru() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("predictor");
    let x = graph.input("features", &[1, FEATURES])?;
    let hidden = graph.input("state_h", &[1, CELLS])?;
    let from_input = weights(&mut graph, "w", &[FEATURES, 3 * CELLS])?;
    let from_hidden = weights(&mut graph, "r", &[CELLS, 3 * CELLS])?;
    let input_bias = weights(&mut graph, "b", &[3 * CELLS])?;
    let hidden_bias = weights(&mut graph, "bias", &[3 * CELLS])?;
    let gates = GruWeights {
        from_input: &from_input,
        from_hidden: &from_hidden,
        input_bias: &input_bias,
        hidden_bias: &hidden_bias,
    };
    let hidden = graph.gru_cell(&x, &hidden, gates)?;
    let dense = weights(&mut graph, "dense", &[CELLS, LATENTS])?;
    let latent = graph.matmul(&hidden, &dense)?;
    graph.output("latent", &latent)?;
    graph.output("state_h_out", &hidden)?;
    Ok(graph.into_bytes())
}

fn elementary() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("predictor");
    let x = graph.input("features", &[1, FEATURES])?;
    let state = graph.input("state_s", &[1, FEATURES])?;
    let scale = weights(&mut graph, "scale", &[FEATURES])?;
    let scaled = graph.mul(&x, &scale)?;
    let sum = graph.add(&scaled, &state)?;
    let squashed = graph.sigmoid(&sum);
    let logarithm = graph.log(&squashed);
    let grown = graph.exp(&logarithm);
    let cut = graph.relu(&grown);
    let difference = graph.sub(&cut, &state)?;
    let next = graph.tanh(&difference);
    let both = graph.concat(&[&next, &scaled], 1)?;
    let chosen = graph.gather(&both, 1, &[0, 4, 2, 5])?;
    let table = graph.reshape(&chosen, &[1, 2, 2])?;
    let turned = graph.transpose(&table, &[0, 2, 1])?;
    let flat = graph.reshape(&turned, &[1, 4])?;
    let parts = graph.split(&flat, 1, &[LATENTS, LATENTS])?;
    graph.output("latent", &parts[1])?;
    graph.output("state_s_out", &next)?;
    Ok(graph.into_bytes())
}

fn dense() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, LATENTS])?;
    let basis = made_up::numbers(7, LATENTS * 6);
    let basis = graph.weights("basis", &[LATENTS, 6], &basis, Precision::Half)?;
    let mean = weights(&mut graph, "mean", &[6])?;
    let flat = graph.dense(&latent, &basis, &mean)?;
    let offsets = graph.reshape(&flat, &[1, 2, 3])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

fn reordered() -> Result<Vec<u8>, WriteError> {
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, LATENTS])?;
    let parts = graph.split(&latent, 1, &[1, 1])?;
    let blocks: Vec<Value> = parts
        .iter()
        .enumerate()
        .map(|(idx, part)| {
            let basis = weights(&mut graph, ["first", "other"][idx], &[1, 3])?;
            graph.matmul(part, &basis)
        })
        .collect::<Result<_, _>>()?;
    let flat = graph.concat(&blocks.iter().collect::<Vec<_>>(), 1)?;
    let table = graph.reshape(&flat, &[1, 2, 3])?;
    let offsets = graph.gather(&table, 1, &[1, 0])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

fn convolutions() -> Result<Vec<u8>, WriteError> {
    let steps = |stride, padding, output_padding| Steps {
        stride,
        padding,
        output_padding,
    };
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, LATENTS])?;
    let row = graph.reshape(&latent, &[1, 1, LATENTS])?;
    let kernel = weights(&mut graph, "wider", &[1, 2, 3])?;
    let bias = weights(&mut graph, "b", &[2])?;
    let wide = graph.conv_transpose1d(&row, &kernel, &bias, steps(2, 1, 1))?;
    let kernel = weights(&mut graph, "narrow", &[3, 2, 3])?;
    let bias = weights(&mut graph, "bias", &[3])?;
    let narrow = graph.conv1d(&wide, &kernel, &bias, steps(2, 1, 0))?;
    let offsets = graph.transpose(&narrow, &[0, 2, 1])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}
