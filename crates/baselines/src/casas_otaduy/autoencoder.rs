//! The fully connected autoencoder (section 3.3, Fig. 4).

use burn::module::{Module, Param};
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor, TensorData};

use super::config::AutoencoderWidths;

/// Units that start as principal components see them this far into the tanh: nearly linear.
const FIRST_DEVIATION: f32 = 0.3;
/// The random part of the first weights, against what a layer of its width usually starts with.
const FIRST_NOISE: f32 = 0.02;

/// coordinates → outer (linear) → inner (tanh) → latent (linear), and back the same way.
///
/// The paper calls the middle layer nonlinear without naming the function. tanh is nearly linear
/// for small offsets and holds a direction in one unit, where rectified units need two.
#[derive(Module, Debug)]
pub(super) struct Autoencoder {
    pub encoder_outer: Linear,
    pub encoder_inner: Linear,
    pub encoder_latent: Linear,
    pub decoder_inner: Linear,
    pub decoder_outer: Linear,
    pub decoder_field: Linear,
}

impl Autoencoder {
    /// Weights that let through the first coordinates, as many as there are latents, plus a little
    /// noise: with `deviations` of coordinates that are principal components, training starts where
    /// principal components end. Seed the device first.
    pub fn new(widths: AutoencoderWidths, deviations: &[f32], device: &Device) -> Self {
        let coordinates = deviations.len();
        let AutoencoderWidths {
            outer,
            inner,
            latent,
        } = widths;
        let gain = |unit: usize| FIRST_DEVIATION / deviations[unit].max(1e-3);
        let layer =
            |inputs: usize, outputs: usize, through: usize, diagonal: &dyn Fn(usize) -> f32| {
                let mut layer = LinearConfig::new(inputs, outputs).init(device);
                let noise = layer.weight.val().detach() * FIRST_NOISE;
                let mut numbers: Vec<f32> = noise.into_data().iter::<f32>().collect();
                for unit in 0..through.min(inputs).min(outputs) {
                    numbers[unit * outputs + unit] += diagonal(unit);
                }
                let weights = TensorData::new(numbers, [inputs, outputs]);
                layer.weight = Param::from_data(weights, device);
                layer.bias = Some(Param::from_data(
                    TensorData::new(vec![0.0f32; outputs], [outputs]),
                    device,
                ));
                layer
            };
        let kept = inner.min(outer).min(coordinates);
        let one = |_: usize| 1.0;
        Self {
            encoder_outer: layer(coordinates, outer, kept, &one),
            encoder_inner: layer(outer, inner, kept, &gain),
            encoder_latent: layer(inner, latent, latent, &one),
            decoder_inner: layer(latent, inner, latent, &one),
            decoder_outer: layer(inner, outer, latent.min(kept), &|unit| 1.0 / gain(unit)),
            decoder_field: layer(outer, coordinates, latent.min(kept), &one),
        }
    }

    /// Latents `[frames, latent]` of normalised fields `[frames, coordinates]`.
    pub fn encode(&self, fields: Tensor<2>) -> Tensor<2> {
        let inner = self
            .encoder_inner
            .forward(self.encoder_outer.forward(fields));
        self.encoder_latent.forward(inner.tanh())
    }

    /// Normalised fields of latents.
    pub fn decode(&self, latents: Tensor<2>) -> Tensor<2> {
        let inner = self.decoder_inner.forward(latents).tanh();
        self.decoder_field
            .forward(self.decoder_outer.forward(inner))
    }
}

/// Weights `[inputs][outputs]` and biases of a layer, flat.
pub(super) fn numbers_of(layer: &Linear) -> (Vec<f32>, Vec<f32>) {
    let weight = layer.weight.val().into_data().iter::<f32>().collect();
    let bias = layer.bias.as_ref();
    let bias = bias.map(|bias| bias.val().into_data().iter::<f32>().collect());
    (weight, bias.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_size_is_what_the_widths_tell() {
        let widths = AutoencoderWidths {
            outer: 12,
            inner: 7,
            latent: 3,
        };
        let network = Autoencoder::new(widths, &[1.0; 20], &Device::flex());
        assert_eq!(network.num_params(), widths.parameters(20));
    }

    #[test]
    fn the_published_network_has_the_published_number_of_parameters() {
        let deviations = vec![1.0; 3 * 6890];
        let network = Autoencoder::new(AutoencoderWidths::PUBLISHED, &deviations, &Device::flex());
        assert_eq!(network.num_params(), 284_678_770);
    }

    #[test]
    fn it_starts_near_the_first_principal_components() {
        let widths = AutoencoderWidths {
            outer: 40,
            inner: 20,
            latent: 10,
        };
        let device = Device::flex();
        device.seed(3);
        let deviations: Vec<f32> = (0..30).map(|k| 5.0 * 0.8f32.powi(k)).collect();
        let network = Autoencoder::new(widths, &deviations, &device);
        let field: Vec<f32> = deviations
            .iter()
            .enumerate()
            .map(|(k, d)| d * if k % 2 == 0 { 1.0 } else { -0.7 })
            .collect();
        let fields = Tensor::from_data(TensorData::new(field.clone(), [1, 30]), &device);
        let back = network.decode(network.encode(fields));
        let back: Vec<f32> = back.into_data().iter::<f32>().collect();
        let square = |from: usize, other: &[f32]| -> f32 {
            (from..30).map(|k| (field[k] - other[k]).powi(2)).sum()
        };
        // Ten of the thirty components are kept: the error is not far above that of the others.
        let (error, dropped) = (square(0, &back), square(10, &[0.0; 30]));
        let all = square(0, &[0.0; 30]);
        assert!(error < dropped + 0.1 * all, "{error} {dropped} {all}");
    }
}
