//! The trained networks as ONNX files of the project's contract (ARCHITECTURE.md, "ONNX").

use burn::tensor::Tensor;
use dynaskin_body::SHAPE_COUNT;
use dynaskin_onnx::{Graph, LstmWeights, Precision, Steps, Value, WriteError};

use super::autoencoder::{Layer, walks};
use super::compress::Compressor;
use super::config::ShapeInput;
use super::predictor::{DsnetPredictor, RadialBasis};
use dynaskin_train::{Normaliser, TrainError};

/// What the predictor's file is made from.
#[derive(Debug)]
pub struct PredictorParts<'a> {
    /// The network.
    pub model: &'a DsnetPredictor,
    /// Scaling of its inputs.
    pub normaliser: &'a Normaliser,
    /// Where β enters.
    pub shape_input: ShapeInput,
    /// The functions of β, where the first state comes from them.
    pub basis: Option<&'a RadialBasis>,
    /// Latents of the autoencoder that are 1 for the network.
    pub latent_unit: f32,
}

/// `predictor.onnx`: `features` [1,79] (`pose-shape`) and the LSTM's `state_h`, `state_c` in; `latent`
/// and the next states out. Scaling of features and latents is folded into the weights, and so is the
/// batch normalisation into the last layer.
///
/// The contract starts every state at zero, and the network whose first state depends on the shape has
/// to know whether it has started: it has one more state, `state_started` [1,1], which is 0 at first and
/// 1 afterwards. Its complement multiplies what the basis functions give, which is added to `state_h`
/// and `state_c` (zero at that tick).
///
/// # Errors
/// [`TrainError::Onnx`], such as for weights that are not finite.
pub fn predictor_onnx(parts: &PredictorParts<'_>) -> Result<Vec<u8>, TrainError> {
    let mut writer = Writer {
        graph: Graph::new("predictor"),
        precision: Precision::Single,
    };
    let model = parts.model;
    let count = parts.normaliser.origin.len();
    let pose_count = count - SHAPE_COUNT;
    let [hidden, _] = model.from_hidden.val().dims();
    let features = writer.graph.input("features", &[1, count])?;
    let mut state = writer.graph.input("state_h", &[1, hidden])?;
    let mut cells = writer.graph.input("state_c", &[1, hidden])?;
    let origin = writer.vector("origin", &parts.normaliser.origin)?;
    let centred = writer.graph.sub(&features, &origin)?;
    let split = writer
        .graph
        .split(&centred, 1, &[pose_count, SHAPE_COUNT])?;
    let (pose_scale, shape_scale) = parts.normaliser.scale.split_at(pose_count);
    let (inputs, scale) = match parts.shape_input {
        ShapeInput::EveryStep => (&centred, &parts.normaliser.scale[..]),
        ShapeInput::FirstState => (&split[0], pose_scale),
    };
    let mut started = None;
    if let (Some(layer), Some(basis)) = (&model.first_state, parts.basis) {
        let first = writer.first_state(layer, basis, &split[1], shape_scale)?;
        let not_yet = writer.graph.input("state_started", &[1, 1])?;
        let (waits, now) = writer.started(&not_yet, hidden)?;
        let first = writer.graph.split(&first, 1, &[hidden, hidden])?;
        let set_state = writer.graph.mul(&first[0], &waits)?;
        let set_cells = writer.graph.mul(&first[1], &waits)?;
        state = writer.graph.add(&state, &set_state)?;
        cells = writer.graph.add(&cells, &set_cells)?;
        started = Some(now);
    }
    let x = writer.layer("linear", &scaled_rows(&model.linear, scale), inputs)?;
    let x = writer.layer("tanh", &Flat::of(&model.tanh), &x)?;
    let x = writer.graph.tanh(&x);
    let from_input = Flat::of(&model.from_input);
    let weights = LstmWeights {
        from_input: &writer.matrix("from_input", &from_input.weights, from_input.bias.len())?,
        from_hidden: &writer.matrix("from_hidden", &flat(model.from_hidden.val()), 4 * hidden)?,
        bias: &writer.vector("bias", &from_input.bias)?,
    };
    let (state, cells) = writer.graph.lstm_cell(&x, &state, &cells, weights)?;
    let last = normalised_latents(model, parts.latent_unit);
    let latent = writer.layer("latent_layer", &last, &state)?;
    writer.graph.output("latent", &latent)?;
    writer.graph.output("state_h_out", &state)?;
    writer.graph.output("state_c_out", &cells)?;
    if let Some(started) = started {
        writer.graph.output("state_started_out", &started)?;
    }
    Ok(writer.graph.into_bytes())
}

/// `decoder.onnx`: `latent` [1,L] to `offsets` [1,V,3] in metres. Weights are stored in `precision`.
///
/// # Errors
/// [`TrainError::Onnx`].
pub fn decoder_onnx(compressor: &Compressor, precision: Precision) -> Result<Vec<u8>, TrainError> {
    let mut writer = Writer {
        graph: Graph::new("decoder"),
        precision,
    };
    let (model, sizes) = (&compressor.model, &compressor.sizes);
    let walks = walks(sizes, compressor.vertices);
    let (channels, cells) = (sizes.channels[1], walks[3].short());
    let latent = writer.graph.input("latent", &[1, sizes.latents])?;
    let dense = Flat::of(&model.decode).with_columns(channels * cells, |column| {
        // From `[cell][channel]` to ONNX's `[channel][cell]`.
        let (channel, cell) = (column / cells, column % cells);
        cell * channels + channel
    });
    let x = writer.layer("dense", &dense, &latent)?;
    let x = writer.graph.tanh(&x);
    let mut x = writer.graph.reshape(&x, &[1, channels, cells])?;
    for (index, (layer, walk)) in model
        .transposed
        .iter()
        .zip(walks.into_iter().rev())
        .enumerate()
    {
        // From `[input][tap][output]` to ONNX's `[input][output][tap]`.
        let turned = Flat::of(layer).with_columns(channels * sizes.kernel, |column| {
            let (output, tap) = (column / sizes.kernel, column % sizes.kernel);
            tap * channels + output
        });
        let name = format!("transposed {index}");
        let shape = [channels, channels, sizes.kernel];
        let weights = writer.weights(&name, &shape, &turned.weights)?;
        let bias = writer.vector(&format!("{name} bias"), &flat(layer.bias.val()))?;
        let steps = Steps {
            stride: walk.stride,
            padding: walk.padding(),
            output_padding: (walk.long - 1) % walk.stride,
        };
        x = writer.graph.conv_transpose1d(&x, &weights, &bias, steps)?;
        x = writer.graph.tanh(&x);
    }
    let x = writer.vertex_layer("vertex 0", &model.vertex_back[0], &x, 1.0)?;
    let x = writer.graph.tanh(&x);
    let x = writer.vertex_layer("vertex 1", &model.vertex_back[1], &x, compressor.largest_m)?;
    let offsets = writer.graph.transpose(&x, &[0, 2, 1])?;
    writer.graph.output("offsets", &offsets)?;
    Ok(writer.graph.into_bytes())
}

/// The last layer after the batch normalisation `γ (h - mean) / √(variance + ε) + β`, in the
/// autoencoder's latents.
fn normalised_latents(model: &DsnetPredictor, latent_unit: f32) -> Flat {
    let norm = &model.norm;
    let last = Flat::of(&model.latent);
    let (gamma, beta) = (flat(norm.gamma.val()), flat(norm.beta.val()));
    let mean = flat(norm.running_mean.value());
    let variance = flat(norm.running_var.value());
    let mut folded = Flat {
        weights: Vec::with_capacity(last.weights.len()),
        bias: last.bias.clone(),
    };
    for (cell, row) in last.weights.chunks_exact(last.bias.len()).enumerate() {
        let scale = gamma[cell] / (variance[cell] + norm.epsilon as f32).sqrt();
        let shift = beta[cell] - mean[cell] * scale;
        for (bias, weight) in folded.bias.iter_mut().zip(row) {
            *bias += shift * weight;
        }
        folded
            .weights
            .extend(row.iter().map(|weight| weight * scale));
    }
    let numbers = folded.weights.iter_mut().chain(&mut folded.bias);
    numbers.for_each(|number| *number *= latent_unit);
    folded
}

/// A layer whose inputs are multiplied with `scale` first.
fn scaled_rows(layer: &Layer, scale: &[f32]) -> Flat {
    let mut layer = Flat::of(layer);
    let columns = layer.bias.len();
    for (row, scale) in layer.weights.chunks_exact_mut(columns).zip(scale) {
        row.iter_mut().for_each(|weight| *weight *= scale);
    }
    layer
}

/// A layer's numbers, row-major.
struct Flat {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Flat {
    fn of(layer: &Layer) -> Self {
        Self {
            weights: flat(layer.weights.val()),
            bias: flat(layer.bias.val()),
        }
    }

    /// Columns in another order: column `c` comes from column `source(c)`. Biases follow where there is
    /// one for each.
    fn with_columns(self, columns: usize, source: impl Fn(usize) -> usize) -> Self {
        let pick = |row: &[f32]| (0..columns).map(|c| row[source(c)]).collect::<Vec<f32>>();
        let rows = self.weights.chunks_exact(columns);
        Self {
            weights: rows.flat_map(&pick).collect(),
            bias: if self.bias.len() == columns {
                pick(&self.bias)
            } else {
                self.bias
            },
        }
    }
}

/// A graph being filled with layers.
struct Writer {
    graph: Graph,
    precision: Precision,
}

impl Writer {
    fn weights(
        &mut self,
        name: &str,
        shape: &[usize],
        numbers: &[f32],
    ) -> Result<Value, WriteError> {
        self.graph.weights(name, shape, numbers, self.precision)
    }

    fn matrix(&mut self, name: &str, numbers: &[f32], columns: usize) -> Result<Value, WriteError> {
        let rows = numbers.len() / columns.max(1);
        self.weights(name, &[rows, columns], numbers)
    }

    fn vector(&mut self, name: &str, numbers: &[f32]) -> Result<Value, WriteError> {
        self.graph
            .weights(name, &[numbers.len()], numbers, Precision::Single)
    }

    fn layer(&mut self, name: &str, layer: &Flat, x: &Value) -> Result<Value, WriteError> {
        let weights = self.matrix(name, &layer.weights, layer.bias.len())?;
        let bias = self.vector(&format!("{name} bias"), &layer.bias)?;
        self.graph.dense(x, &weights, &bias)
    }

    /// A dense layer of every vertex, as a convolution of one tap; its results times `scale`.
    fn vertex_layer(
        &mut self,
        name: &str,
        layer: &Layer,
        x: &Value,
        scale: f32,
    ) -> Result<Value, WriteError> {
        let layer = Flat::of(layer);
        let outputs = layer.bias.len();
        let inputs = layer.weights.len() / outputs;
        let turned = (0..outputs).flat_map(|o| (0..inputs).map(move |i| i * outputs + o));
        let turned: Vec<f32> = turned.map(|index| layer.weights[index] * scale).collect();
        let bias: Vec<f32> = layer.bias.iter().map(|b| b * scale).collect();
        let weights = self.weights(name, &[outputs, inputs, 1], &turned)?;
        let bias = self.vector(&format!("{name} bias"), &bias)?;
        let steps = Steps {
            stride: 1,
            padding: 0,
            output_padding: 0,
        };
        self.graph.conv1d(x, &weights, &bias, steps)
    }

    /// The first state of the centred shape: `-|scale·shape - centre|² / (2 width²)` is linear in the
    /// shape and its squares.
    fn first_state(
        &mut self,
        layer: &Layer,
        basis: &RadialBasis,
        shape: &Value,
        scale: &[f32],
    ) -> Result<Value, WriteError> {
        let inverse = 1.0 / (basis.width * basis.width);
        let functions = basis.centres.len();
        let mut weights = Vec::with_capacity(2 * SHAPE_COUNT * functions);
        for scale in scale {
            weights.extend(basis.centres.iter().map(|_| -0.5 * inverse * scale * scale));
        }
        for (index, scale) in scale.iter().enumerate() {
            weights.extend(
                basis
                    .centres
                    .iter()
                    .map(|centre| inverse * scale * centre[index]),
            );
        }
        let square = |centre: &[f32; SHAPE_COUNT]| centre.iter().map(|x| x * x).sum::<f32>();
        let exponent = Flat {
            weights,
            bias: basis
                .centres
                .iter()
                .map(|c| -0.5 * inverse * square(c))
                .collect(),
        };
        let squares = self.graph.mul(shape, shape)?;
        let both = self.graph.concat(&[&squares, shape], 1)?;
        let exponent = self.layer("radial", &exponent, &both)?;
        let values = self.graph.exp(&exponent);
        self.layer("first_state", &Flat::of(layer), &values)
    }

    /// From `state_started`: its complement, once for each cell, and 1 for the next tick.
    fn started(&mut self, started: &Value, cells: usize) -> Result<(Value, Value), WriteError> {
        let complement = Flat {
            weights: vec![-1.0; cells],
            bias: vec![1.0; cells],
        };
        let waits = self.layer("waits", &complement, started)?;
        let always = Flat {
            weights: vec![0.0],
            bias: vec![1.0],
        };
        Ok((waits, self.layer("always", &always, started)?))
    }
}

fn flat<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}
