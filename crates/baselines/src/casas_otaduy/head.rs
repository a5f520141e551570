//! The decoder behind the regressor: normalised latents to offset fields, ready multiplied.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use super::autoencoder::{Autoencoder, numbers_of};
use super::data::{ClipFields, Prepared};
use super::fit_autoencoder::encode;

/// How latents are normalised (section 3.5). Latents are counted from that of no offset at all, so
/// that the runtime's first state, zeros, is a body whose tissue is at rest.
#[derive(Clone, Debug)]
pub(super) struct LatentScale {
    /// The encoder's latent of no offset.
    pub rest: Vec<f32>,
    /// Mean of the latents over the training set, counted from `rest`.
    pub mean: Vec<f32>,
    /// Their deviations.
    pub deviation: Vec<f32>,
    /// Deviations of their change in a tick.
    pub step_deviation: Vec<f32>,
}

/// Below this a latent counts as constant.
const SMALLEST_DEVIATION: f64 = 1e-6;

impl LatentScale {
    /// From the training clips; gives the normalised latents of training and validation clips, too.
    pub fn fit(model: &Autoencoder, data: &Prepared) -> (Self, Vec<Vec<f32>>) {
        let width = data.span.width();
        let zero = ClipFields {
            features: Vec::new(),
            fields: data.span.zero(),
            frames: 1,
        };
        let rest = encode(model, &zero, width);
        let count = rest.len();
        let mut clips: Vec<Vec<f32>> = data
            .training
            .iter()
            .map(|clip| encode(model, clip, width))
            .collect();
        for latents in clips
            .iter_mut()
            .flat_map(|clip| clip.chunks_exact_mut(count))
        {
            latents
                .iter_mut()
                .zip(&rest)
                .for_each(|(x, rest)| *x -= rest);
        }
        let frames = clips.iter().flat_map(|clip| clip.chunks_exact(count));
        let (mean, deviation) = moments(frames, count);
        let steps = clips.iter().flat_map(|clip| {
            let pairs = clip
                .chunks_exact(count)
                .zip(clip.chunks_exact(count).skip(1));
            pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| b - a).collect::<Vec<f32>>())
        });
        let (_, step_deviation) = moments(steps, count);
        for latents in clips
            .iter_mut()
            .flat_map(|clip| clip.chunks_exact_mut(count))
        {
            for (k, x) in latents.iter_mut().enumerate() {
                *x = (*x - mean[k]) / deviation[k];
            }
        }
        let scale = Self {
            rest,
            mean,
            deviation,
            step_deviation,
        };
        (scale, clips)
    }

    /// Number of latents.
    pub fn count(&self) -> usize {
        self.rest.len()
    }

    /// Normalised latents of a body at rest.
    pub fn at_rest(&self) -> Vec<f32> {
        let both = self.mean.iter().zip(&self.deviation);
        both.map(|(mean, deviation)| -mean / deviation).collect()
    }

    /// What a change of normalised latents is multiplied with to be normalised itself.
    pub fn step_gain(&self) -> Vec<f32> {
        let both = self.deviation.iter().zip(&self.step_deviation);
        both.map(|(deviation, step)| deviation / step).collect()
    }
}

/// Means and deviations of rows of `count` numbers.
fn moments<R: AsRef<[f32]>>(rows: impl Iterator<Item = R>, count: usize) -> (Vec<f32>, Vec<f32>) {
    let (mut sums, mut squares, mut frames) = (vec![0.0f64; count], vec![0.0f64; count], 0usize);
    for row in rows {
        for (k, x) in row.as_ref().iter().enumerate() {
            sums[k] += f64::from(*x);
            squares[k] += f64::from(*x).powi(2);
        }
        frames += 1;
    }
    let frames = frames.max(1) as f64;
    let deviation = (0..count).map(|k| {
        let variance = squares[k] / frames - (sums[k] / frames).powi(2);
        variance.max(0.0).sqrt().max(SMALLEST_DEVIATION) as f32
    });
    let deviation = deviation.collect();
    (
        sums.iter().map(|sum| (sum / frames) as f32).collect(),
        deviation,
    )
}

/// `tanh(n · inner + inner_bias) · field + field_bias`: the decoder on normalised latents n. Its two
/// last layers are linear, and so are one.
#[derive(Clone, Debug)]
pub(super) struct Head {
    /// `[latent, inner]`.
    pub inner: Tensor<2>,
    /// `[1, inner]`.
    pub inner_bias: Tensor<2>,
    /// `[inner, span]`.
    pub field: Tensor<2>,
    /// `[1, span]`.
    pub field_bias: Tensor<2>,
}

impl Head {
    /// Of a trained autoencoder, on the plain device.
    pub fn new(model: &Autoencoder, scale: &LatentScale) -> Self {
        let device = Device::flex();
        let model = model.valid();
        let row = |numbers: Vec<f32>| {
            let count = numbers.len();
            Tensor::<2>::from_data(TensorData::new(numbers, [1, count]), &device)
        };
        let bias = |layer| row(numbers_of(layer).1);
        let inner = model.decoder_inner.weight.val();
        let origin = row(scale.rest.clone()) + row(scale.mean.clone());
        let outer = model.decoder_outer.weight.val();
        let field = model.decoder_field.weight.val();
        Self {
            inner_bias: bias(&model.decoder_inner) + origin.matmul(inner.clone()),
            inner: inner * row(scale.deviation.clone()).transpose(),
            field_bias: bias(&model.decoder_outer).matmul(field.clone())
                + bias(&model.decoder_field),
            field: outer.matmul(field),
        }
    }

    /// The same followed by the matrix `root`, `[span][span]` row-major: fields become `root · field`.
    #[must_use]
    pub fn weighted(&self, root: &[f32]) -> Self {
        let width = self.field.dims()[1];
        let data = TensorData::new(root.to_vec(), [width, width]);
        let turn = Tensor::<2>::from_data(data, &Device::flex()).transpose();
        Self {
            field: self.field.clone().matmul(turn.clone()),
            field_bias: self.field_bias.clone().matmul(turn),
            ..self.clone()
        }
    }

    /// The same on another device, as constants.
    pub fn on(&self, device: &Device) -> Self {
        let there = |x: &Tensor<2>| Tensor::from_data(x.clone().into_data(), device);
        Self {
            inner: there(&self.inner),
            inner_bias: there(&self.inner_bias),
            field: there(&self.field),
            field_bias: there(&self.field_bias),
        }
    }

    /// Fields `[frames, span]` of normalised latents `[frames, latent]`.
    pub fn fields(&self, latents: Tensor<2>) -> Tensor<2> {
        let inner = (latents.matmul(self.inner.clone()) + self.inner_bias.clone()).tanh();
        inner.matmul(self.field.clone()) + self.field_bias.clone()
    }
}
