//! DSNet's predictor (section 4.3, Figure 5 and section 5 of the paper): pose and shape to latents.
//!
//! Dense, linear; dense with tanh; LSTM; batch normalisation; dense. In the variant of
//! [`ShapeInput::FirstState`](super::config::ShapeInput) the shape is not among the inputs: a network of
//! radial basis functions (Broomhead and Lowe 1988) makes the LSTM's first hidden state and cells of it.

use burn::module::{Module, Param};
use burn::nn::{BatchNorm, BatchNormConfig, Initializer};
use burn::tensor::{Device, Int, Tensor, TensorData, activation};
use dynaskin_body::SHAPE_COUNT;

use super::autoencoder::Layer;
use super::config::DsnetConfig;

/// Frames are cut from a sequence in two stages of about this many, because the gradient of a cut is
/// as large as what it was cut from.
const BLOCK_FRAMES: usize = 17;
/// The weights from the basis functions start this small, so that training starts near a state of
/// zeros.
const FIRST_STATE_GAIN: f64 = 0.1;

/// Gaussian functions of the normalised shape, one for each shape that was trained on.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialBasis {
    /// Their centres.
    pub centres: Vec<[f32; SHAPE_COUNT]>,
    /// Their standard deviation: the mean distance of two centres, so that a shape in between is felt
    /// by several.
    pub width: f32,
}

impl RadialBasis {
    /// One function for each different shape.
    pub fn of_shapes(shapes: impl Iterator<Item = [f32; SHAPE_COUNT]>) -> Self {
        let mut centres: Vec<[f32; SHAPE_COUNT]> = Vec::new();
        for shape in shapes {
            if !centres.contains(&shape) {
                centres.push(shape);
            }
        }
        let pairs = (0..centres.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let distances: Vec<f32> = pairs
            .map(|(a, b)| square_distance(&centres[a], &centres[b]).sqrt())
            .collect();
        let mean = distances.iter().sum::<f32>() / distances.len().max(1) as f32;
        Self {
            width: if mean > 0.0 { mean } else { 1.0 },
            centres,
        }
    }

    /// `exp(-|shape - centre|² / (2 width²))` of each centre.
    pub fn values(&self, shape: &[f32]) -> Vec<f32> {
        let scale = -0.5 / (self.width * self.width);
        let value = |centre| (scale * square_distance(centre, shape)).exp();
        self.centres.iter().map(value).collect()
    }
}

fn square_distance(a: &[f32; SHAPE_COUNT], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// The trainable part; it works on normalised inputs and gives scaled latents.
#[derive(Module, Debug)]
pub struct DsnetPredictor {
    /// First dense layer.
    pub linear: Layer,
    /// Second dense layer.
    pub tanh: Layer,
    /// The LSTM's weights from its input: gates input, output, forget, then the cell candidate.
    pub from_input: Layer,
    /// Its weights from its last output, `[hidden, 4 · hidden]`.
    pub from_hidden: Param<Tensor<2>>,
    /// Of the LSTM's output.
    pub norm: BatchNorm,
    /// To the latents.
    pub latent: Layer,
    /// From the basis functions to hidden state and cells, `[functions, 2 · hidden]`.
    pub first_state: Option<Layer>,
}

/// Sequences side by side, time-major.
#[derive(Clone, Debug)]
pub struct Sequences {
    /// `[frames · lanes, inputs]`.
    pub inputs: Tensor<2>,
    /// Number of sequences.
    pub lanes: usize,
    /// Basis functions of their shapes, `[lanes, functions]`, where the network takes them.
    pub basis: Option<Tensor<2>>,
    /// Rows that count; all where there are none.
    pub counted: Option<Tensor<1, Int>>,
}

impl DsnetPredictor {
    /// Random weights for so many inputs a frame; seed the device first.
    pub fn new(
        config: &DsnetConfig,
        inputs: usize,
        functions: Option<usize>,
        device: &Device,
    ) -> Self {
        let hidden = config.hidden;
        let xavier = |rows, columns, fan_out, gain| {
            Initializer::XavierUniform { gain }.init_with(
                [rows, columns],
                Some(rows),
                Some(fan_out),
                device,
            )
        };
        let dense = |rows, columns, gain| Layer {
            weights: xavier(rows, columns, columns, gain),
            bias: Initializer::Zeros.init([columns], device),
        };
        // Forget gates start open, as is usual.
        let mut bias = vec![0.0f32; 4 * hidden];
        bias[2 * hidden..3 * hidden].fill(1.0);
        let first_state = functions.map(|functions| Layer {
            weights: xavier(functions, 2 * hidden, hidden, FIRST_STATE_GAIN),
            bias: Initializer::Zeros.init([2 * hidden], device),
        });
        Self {
            linear: dense(inputs, config.linear, 1.0),
            tanh: dense(config.linear, config.tanh, 1.0),
            from_input: Layer {
                // One gate's fan, not four: each gate is a layer of its own.
                weights: xavier(config.tanh, 4 * hidden, hidden, 1.0),
                bias: Param::from_data(TensorData::new(bias, [4 * hidden]), device),
            },
            from_hidden: xavier(hidden, 4 * hidden, hidden, 1.0),
            norm: BatchNormConfig::new(hidden).init(device),
            // A frame's latents are about 1 long all together.
            latent: dense(hidden, config.autoencoder.latents, 0.1),
            first_state,
        }
    }

    /// Number of trained weights.
    pub fn weight_count(&self) -> usize {
        let layer = |layer: &Layer| layer.num_params();
        let layers = [&self.linear, &self.tanh, &self.from_input, &self.latent];
        let [hidden, gates] = self.from_hidden.dims();
        layers.into_iter().map(layer).sum::<usize>()
            + self.first_state.as_ref().map_or(0, layer)
            + hidden * gates
            // Scale and shift of the normalisation; its statistics are not trained.
            + 2 * hidden
    }

    /// Scaled latents of the rows that count.
    pub fn forward(&self, sequences: &Sequences) -> Tensor<2> {
        let outputs = self.remember(sequences);
        let outputs = match &sequences.counted {
            Some(rows) => outputs.select(0, rows.clone()),
            None => outputs,
        };
        self.latent.rows(self.norm.forward(outputs))
    }

    /// The LSTM's outputs, `[frames · lanes, hidden]`.
    fn remember(&self, sequences: &Sequences) -> Tensor<2> {
        let lanes = sequences.lanes;
        let [hidden, _] = self.from_hidden.dims();
        let x = self.linear.rows(sequences.inputs.clone());
        let x = self.tanh.rows(x).tanh();
        let from_input = self.from_input.rows(x);
        let device = from_input.device();
        let (mut state, mut cells) = match (&self.first_state, &sequences.basis) {
            (Some(layer), Some(basis)) => {
                let first = layer.rows(basis.clone());
                let state = first.clone().narrow(1, 0, hidden);
                (state, first.narrow(1, hidden, hidden))
            }
            _ => {
                let zeros = Tensor::zeros([lanes, hidden], &device);
                (zeros.clone(), zeros)
            }
        };
        let from_hidden = self.from_hidden.val();
        let mut outputs = Vec::new();
        for block in from_input.split(BLOCK_FRAMES * lanes, 0) {
            for from_input in block.split(lanes, 0) {
                let sum = from_input + state.matmul(from_hidden.clone());
                let gates = activation::sigmoid(sum.clone().narrow(1, 0, 3 * hidden));
                let candidate = sum.narrow(1, 3 * hidden, hidden).tanh();
                let written = gates.clone().narrow(1, 0, hidden) * candidate;
                cells = gates.clone().narrow(1, 2 * hidden, hidden) * cells + written;
                state = gates.narrow(1, hidden, hidden) * cells.clone().tanh();
                outputs.push(state.clone());
            }
        }
        Tensor::cat(outputs, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_predictor_has_this_many_weights() {
        let config = DsnetConfig::default();
        let count = |inputs, functions| {
            DsnetPredictor::new(&config, inputs, functions, &Device::flex()).weight_count()
        };
        let rest = (64 * 128 + 128) + (128 * 240 + 60 * 240 + 240) + 2 * 60 + (60 * 100 + 100);
        assert_eq!(count(79, None), 79 * 64 + 64 + rest);
        // Seven shapes; the poses alone.
        assert_eq!(count(69, Some(7)), 69 * 64 + 64 + rest + 7 * 120 + 120);
    }

    #[test]
    fn basis_functions_are_one_at_their_centre_and_fall_with_distance() {
        let mut other = [0.0; SHAPE_COUNT];
        other[3] = 2.0;
        let shapes = [[0.0; SHAPE_COUNT], other, [0.0; SHAPE_COUNT]];
        let basis = RadialBasis::of_shapes(shapes.into_iter());
        assert_eq!((basis.centres.len(), basis.width), (2, 2.0));
        let values = basis.values(&other);
        assert_eq!(values[1], 1.0);
        assert!((values[0] - (-0.5f32).exp()).abs() < 1e-6);
        let one = RadialBasis::of_shapes([[1.0; SHAPE_COUNT]].into_iter());
        assert_eq!(one.width, 1.0);
    }
}
