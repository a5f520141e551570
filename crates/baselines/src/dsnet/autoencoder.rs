//! The mesh autoencoder (section 4.1 and Figure 3 of the paper).
//!
//! Offsets of all vertices, scaled to -1..1 as in the paper's section 5, go through two dense layers
//! that every vertex has in common, then through four convolutions along the vertices in their order,
//! which make the list shorter and keep the channels, then through one dense layer to the latents. The
//! decoder is the mirror image, with transposed convolutions. The paper does not name an activation;
//! here it is tanh after every layer but the last of each half: most offsets are far below the largest,
//! where tanh is nearly linear. (On the fields of `tests/dsnet.rs` thirty epochs came to 0.57 of static
//! with ReLU and Kaiming's first weights, and to less than 0.25 so.)
//!
//! Fields are `[frame, vertex, channel]`, and a convolution is one matrix product: neighbours are laid
//! side by side first. So forward and backward are matrix products, which burn's CPU backend is good at.

use burn::module::{Module, Param};
use burn::nn::Initializer;
use burn::tensor::{Device, Tensor};

use super::config::AutoencoderSizes;

/// A matrix product and a bias: a dense layer, or a convolution whose neighbours lie side by side.
#[derive(Module, Debug)]
pub struct Layer {
    /// `[inputs, outputs]`. For a convolution with K taps inputs are `[tap][channel]`, for a
    /// transposed one outputs are.
    pub weights: Param<Tensor<2>>,
    /// One number a channel that comes out.
    pub bias: Param<Tensor<1>>,
}

impl Layer {
    /// Random weights that keep variances as they are where `fan` inputs add up to an output; `biases`
    /// is the number of channels that come out.
    fn new([inputs, outputs]: [usize; 2], fan: usize, biases: usize, device: &Device) -> Self {
        let initializer = Initializer::XavierUniform { gain: 1.0 };
        Self {
            weights: initializer.init_with([inputs, outputs], Some(fan), Some(fan), device),
            bias: Initializer::Zeros.init([biases], device),
        }
    }

    /// `x · weights + bias`, row by row.
    pub(super) fn rows(&self, x: Tensor<2>) -> Tensor<2> {
        x.matmul(self.weights.val()) + self.bias.val().unsqueeze::<2>()
    }

    /// The same for the last axis of a field.
    fn cells(&self, x: Tensor<3>) -> Tensor<3> {
        let [frames, cells, channels] = x.dims();
        let rows = self.rows(x.reshape([frames * cells, channels]));
        let [_, outputs] = rows.dims();
        rows.reshape([frames, cells, outputs])
    }
}

/// How a convolution walks along a list of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub kernel: usize,
    pub stride: usize,
    /// Cells of the longer list.
    pub long: usize,
}

impl Walk {
    /// Zeros before the longer list, so that the kernel's middle stands on its first cell.
    pub fn padding(self) -> usize {
        self.kernel / 2
    }

    /// Cells of the shorter list: every `stride`-th cell has one.
    pub fn short(self) -> usize {
        self.long.div_ceil(self.stride)
    }

    /// Groups of `stride` cells that a kernel lies on.
    fn groups(self) -> usize {
        self.kernel.div_ceil(self.stride)
    }

    /// `[frames, long, channels]` to `[frames, short, kernel · channels]`: what each place of the
    /// kernel sees.
    fn spread(self, x: Tensor<3>) -> Tensor<3> {
        let [frames, _, channels] = x.dims();
        let groups = self.short() + self.groups() - 1;
        let behind = (groups * self.stride).saturating_sub(self.padding() + self.long);
        let zeros = |cells: usize| Tensor::zeros([frames, cells, channels], &x.device());
        let mut parts = vec![zeros(self.padding()), x.clone()];
        if behind > 0 {
            parts.push(zeros(behind));
        }
        let padded = Tensor::cat(parts, 1).narrow(1, 0, groups * self.stride);
        let grouped = padded.reshape([frames, groups, self.stride * channels]);
        let shifted = (0..self.groups()).map(|m| grouped.clone().narrow(1, m, self.short()));
        let wide = Tensor::cat(shifted.collect(), 2);
        wide.narrow(2, 0, self.kernel * channels)
    }

    /// The adjoint of [`Self::spread`]: what each place of the kernel lays down is summed up.
    fn gather(self, x: Tensor<3>) -> Tensor<3> {
        let [frames, short, width] = x.dims();
        let channels = width / self.kernel;
        let device = x.device();
        let group = self.stride * channels;
        let missing = self.groups() * group - width;
        let x = if missing > 0 {
            Tensor::cat(vec![x, Tensor::zeros([frames, short, missing], &device)], 2)
        } else {
            x
        };
        let last = self.groups() - 1;
        let shifted = (0..=last).map(|m| {
            let part = x.clone().narrow(2, m * group, group);
            let mut parts = Vec::new();
            if m > 0 {
                parts.push(Tensor::zeros([frames, m, group], &device));
            }
            parts.push(part);
            if m < last {
                parts.push(Tensor::zeros([frames, last - m, group], &device));
            }
            Tensor::cat(parts, 1)
        });
        let sum = shifted.reduce(|a, b| a + b);
        let sum = sum.unwrap_or_else(|| Tensor::zeros([frames, short, group], &device));
        let cells = (short + last) * self.stride;
        let sum = sum.reshape([frames, cells, channels]);
        let wanted = self.padding() + self.long;
        let sum = if cells < wanted {
            let zeros = Tensor::zeros([frames, wanted - cells, channels], &device);
            Tensor::cat(vec![sum, zeros], 1)
        } else {
            sum
        };
        sum.narrow(1, self.padding(), self.long)
    }
}

/// Encoder and decoder.
#[derive(Module, Debug)]
pub struct Autoencoder {
    /// Dense layers of each vertex.
    pub vertex: Vec<Layer>,
    /// Convolutions, longest list first.
    pub convolutions: Vec<Layer>,
    /// To the latents.
    pub encode: Layer,
    /// From the latents.
    pub decode: Layer,
    /// Transposed convolutions, shortest list first.
    pub transposed: Vec<Layer>,
    /// Dense layers of each vertex, back to three coordinates.
    pub vertex_back: Vec<Layer>,
}

/// The walks of the four convolutions, longest list first.
pub(super) fn walks(sizes: &AutoencoderSizes, vertices: usize) -> [Walk; 4] {
    let mut long = vertices;
    sizes.strides.map(|stride| {
        let walk = Walk {
            kernel: sizes.kernel,
            stride,
            long,
        };
        long = walk.short();
        walk
    })
}

/// Number of weights and biases of an autoencoder over `vertices` vertices.
pub fn parameter_count(sizes: &AutoencoderSizes, vertices: usize) -> usize {
    encoder_parameter_count(sizes, vertices) + decoder_parameter_count(sizes, vertices)
}

/// Those of the encoder alone.
fn encoder_parameter_count(sizes: &AutoencoderSizes, vertices: usize) -> usize {
    let [a, b] = sizes.channels;
    let flat = b * walks(sizes, vertices)[3].short();
    let dense = |inputs: usize, outputs: usize| inputs * outputs + outputs;
    dense(3, a) + dense(a, b) + 4 * dense(sizes.kernel * b, b) + dense(flat, sizes.latents)
}

/// Those of the decoder alone: what a bundle holds.
pub fn decoder_parameter_count(sizes: &AutoencoderSizes, vertices: usize) -> usize {
    let [a, b] = sizes.channels;
    let flat = b * walks(sizes, vertices)[3].short();
    let dense = |inputs: usize, outputs: usize| inputs * outputs + outputs;
    dense(sizes.latents, flat) + 4 * dense(sizes.kernel * b, b) + dense(b, a) + dense(a, 3)
}

impl Autoencoder {
    /// Random weights; seed the device first.
    pub fn new(sizes: &AutoencoderSizes, vertices: usize, device: &Device) -> Self {
        let [a, b] = sizes.channels;
        let flat = b * walks(sizes, vertices)[3].short();
        let dense = |inputs, outputs| Layer::new([inputs, outputs], inputs, outputs, device);
        let taps = sizes.kernel;
        Self {
            vertex: vec![dense(3, a), dense(a, b)],
            convolutions: sizes.strides.map(|_| dense(taps * b, b)).into(),
            encode: dense(flat, sizes.latents),
            decode: dense(sizes.latents, flat),
            transposed: {
                // Of the kernels that lie on a cell, one in `stride` has a tap there.
                let strides = sizes.strides.into_iter().rev();
                let layer =
                    |stride| Layer::new([b, taps * b], b * taps.div_ceil(stride), b, device);
                strides.map(layer).collect()
            },
            vertex_back: vec![dense(b, a), dense(a, 3)],
        }
    }

    /// Latents `[frames, latents]` of scaled offsets `[frames, vertices, 3]`.
    pub fn encode(&self, sizes: &AutoencoderSizes, offsets: Tensor<3>) -> Tensor<2> {
        let [frames, vertices, _] = offsets.dims();
        let mut x = offsets;
        for layer in &self.vertex {
            x = layer.cells(x).tanh();
        }
        for (layer, walk) in self.convolutions.iter().zip(walks(sizes, vertices)) {
            x = layer.cells(walk.spread(x)).tanh();
        }
        let [_, cells, channels] = x.dims();
        self.encode.rows(x.reshape([frames, cells * channels]))
    }

    /// Scaled offsets `[frames, vertices, 3]` of latents `[frames, latents]`.
    pub fn decode(
        &self,
        sizes: &AutoencoderSizes,
        latents: Tensor<2>,
        vertices: usize,
    ) -> Tensor<3> {
        let [frames, _] = latents.dims();
        let walks = walks(sizes, vertices);
        let x = self.decode.rows(latents).tanh();
        let mut x = x.reshape([frames, walks[3].short(), sizes.channels[1]]);
        for (layer, walk) in self.transposed.iter().zip(walks.into_iter().rev()) {
            let [_, cells, channels] = x.dims();
            let laid = x
                .reshape([frames * cells, channels])
                .matmul(layer.weights.val());
            let [_, width] = laid.dims();
            let sum = walk.gather(laid.reshape([frames, cells, width]));
            x = (sum + layer.bias.val().unsqueeze::<3>()).tanh();
        }
        let x = self.vertex_back[0].cells(x).tanh();
        self.vertex_back[1].cells(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::TensorData;

    const SMALL: AutoencoderSizes = AutoencoderSizes {
        channels: [4, 6],
        kernel: 5,
        strides: [2, 1, 3, 2],
        latents: 7,
    };

    #[test]
    fn the_published_size_is_the_papers_but_for_391_parameters() {
        // 33,626,606 in the paper's section 5.
        let count = parameter_count(&AutoencoderSizes::PUBLISHED, 6890);
        assert_eq!(count, 33_626_606 - 391);
    }

    #[test]
    fn the_counts_are_those_of_the_module() {
        for vertices in [23, 24, 25, 26] {
            let model = Autoencoder::new(&SMALL, vertices, &Device::flex());
            assert_eq!(model.num_params(), parameter_count(&SMALL, vertices));
        }
    }

    #[test]
    fn every_number_of_vertices_comes_back() {
        for vertices in 13..31 {
            let model = Autoencoder::new(&SMALL, vertices, &Device::flex());
            let offsets = Tensor::zeros([2, vertices, 3], &Device::flex());
            let latents = model.encode(&SMALL, offsets);
            assert_eq!(latents.dims(), [2, 7]);
            assert_eq!(
                model.decode(&SMALL, latents, vertices).dims(),
                [2, vertices, 3]
            );
        }
    }

    /// `x` tells cell and channel; its spread is compared with what the definition says.
    #[test]
    fn a_walk_sees_its_neighbours_and_its_adjoint_sums_them() {
        for (kernel, stride, long) in [(5, 2, 9), (5, 2, 10), (3, 3, 8), (5, 1, 4), (1, 1, 3)] {
            let walk = Walk {
                kernel,
                stride,
                long,
            };
            let numbers: Vec<f32> = (0..2 * long).map(|i| 1.0 + i as f32).collect();
            let x = |cell: isize, channel: usize| {
                let inside = (0..long as isize).contains(&cell);
                if inside {
                    numbers[2 * cell as usize + channel]
                } else {
                    0.0
                }
            };
            let device = Device::flex();
            let field =
                Tensor::<3>::from_data(TensorData::new(numbers.clone(), [1, long, 2]), &device);
            let spread = walk.spread(field.clone());
            assert_eq!(spread.dims(), [1, walk.short(), 2 * kernel]);
            let got: Vec<f32> = spread.clone().into_data().iter::<f32>().collect();
            for place in 0..walk.short() {
                for tap in 0..kernel {
                    for channel in 0..2 {
                        let cell = (place * stride + tap) as isize - (kernel / 2) as isize;
                        let index = (place * kernel + tap) * 2 + channel;
                        assert_eq!(got[index], x(cell, channel), "{walk:?} {place} {tap}");
                    }
                }
            }
            // <spread(x), y> = <x, gather(y)> for any y.
            let y: Vec<f32> = (0..got.len()).map(|i| (i as f32 * 0.7).sin()).collect();
            let one: f32 = got.iter().zip(&y).map(|(a, b)| a * b).sum();
            let back = walk.gather(Tensor::from_data(
                TensorData::new(y, spread.dims()),
                &device,
            ));
            assert_eq!(back.dims(), [1, long, 2]);
            let other = (back * field).sum().into_scalar::<f32>();
            assert!(
                (one - other).abs() < 1e-3 * one.abs().max(1.0),
                "{walk:?}: {one} {other}"
            );
        }
    }
}
