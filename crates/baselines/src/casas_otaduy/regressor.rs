//! The regressor (section 3.4): one hidden layer of rectified linear units over three poses, β and
//! the two latents before.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor, TensorData, activation};

use super::window::KIND;

/// The trainable part; it works on normalised numbers.
#[derive(Module, Debug)]
pub(super) struct Regressor {
    pub hidden: Linear,
    pub output: Linear,
}

/// The two normalised latents before, newest first, each `[lanes, latent]`.
#[derive(Clone, Debug)]
pub(super) struct Past {
    pub newest: Tensor<2>,
    pub before: Tensor<2>,
}

/// Inputs for this many latents: features, the newest latents, and their change.
pub(super) const fn input_count(latents: usize) -> usize {
    KIND.count() + 2 * latents
}

/// The paper's number of neurons (section 3.5, after Masters 1993): the root of the number of inputs
/// times that of offset coordinates.
pub(super) fn masters_width(inputs: usize, coordinates: usize) -> usize {
    (inputs * coordinates).isqrt()
}

impl Regressor {
    /// Random weights; seed the device first.
    pub fn new(latents: usize, hidden: usize, device: &Device) -> Self {
        Self {
            hidden: LinearConfig::new(input_count(latents), hidden).init(device),
            output: LinearConfig::new(hidden, latents).init(device),
        }
    }

    /// Normalised latents of several ticks one after the other, time-major. `features` is
    /// `[ticks · lanes, features]`, normalised; `step_gain` `[1, latent]` normalises a change of
    /// latents.
    pub fn play(
        &self,
        features: Tensor<2>,
        mut past: Past,
        step_gain: &Tensor<2>,
    ) -> (Tensor<2>, Past) {
        let [lanes, latents] = past.newest.dims();
        let weight = self.hidden.weight.val();
        let rows = |first: usize, count: usize| weight.clone().narrow(0, first, count);
        let from_newest = rows(KIND.count(), latents);
        let from_change = rows(KIND.count() + latents, latents);
        let mut from_features = features.matmul(rows(0, KIND.count()));
        if let Some(bias) = &self.hidden.bias {
            from_features = from_features + bias.val().unsqueeze::<2>();
        }
        let mut ticks = Vec::new();
        for from_features in from_features.split(lanes, 0) {
            let change = (past.newest.clone() - past.before) * step_gain.clone();
            let hidden = from_features
                + past.newest.clone().matmul(from_newest.clone())
                + change.matmul(from_change.clone());
            let latents = self.output.forward(activation::relu(hidden));
            past = Past {
                newest: latents.clone(),
                before: past.newest,
            };
            ticks.push(latents);
        }
        (Tensor::cat(ticks, 0), past)
    }
}

/// A row of numbers as a tensor `[1, count]`.
pub(super) fn row(numbers: &[f32], device: &Device) -> Tensor<2> {
    Tensor::from_data(
        TensorData::new(numbers.to_vec(), [1, numbers.len()]),
        device,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_width_comes_from_the_published_sizes() {
        // The paper counts 350 inputs and 6890 vertices and comes to 2689 neurons.
        assert_eq!(masters_width(350, 3 * 6890), 2689);
    }
}
