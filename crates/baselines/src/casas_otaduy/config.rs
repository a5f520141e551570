//! Settings of Casas & Otaduy's method.

use serde::{Deserialize, Serialize};

use dynaskin_train::{PATIENCE_EPOCHS, TrainError, within};

/// Widths of the autoencoder (section 3.3): 6000, 3000 and 100 in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AutoencoderWidths {
    /// The first layer of the encoder and the second of the decoder, linear.
    pub outer: usize,
    /// The second layer of the encoder and the first of the decoder, with tanh.
    pub inner: usize,
    /// Latents, linear.
    pub latent: usize,
}

impl AutoencoderWidths {
    /// The paper's.
    pub const PUBLISHED: Self = Self {
        outer: 6000,
        inner: 3000,
        latent: 100,
    };

    /// Weights and biases of an autoencoder of these widths for fields of `coordinates` numbers.
    pub const fn parameters(&self, coordinates: usize) -> usize {
        dense(coordinates, self.outer)
            + dense(self.outer, self.inner)
            + dense(self.inner, self.latent)
            + dense(self.latent, self.inner)
            + dense(self.inner, self.outer)
            + dense(self.outer, coordinates)
    }
}

/// Weights and biases of a fully connected layer.
const fn dense(inputs: usize, outputs: usize) -> usize {
    (inputs + 1) * outputs
}

/// Settings of the autoencoder's training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AutoencoderConfig {
    /// Seed of everything random.
    pub seed: u64,
    /// Widths.
    pub widths: AutoencoderWidths,
    /// Principal components of the training offsets that the layers next to the offsets work on.
    pub span: usize,
    /// Frames that the principal components are fitted to, drawn from the training set.
    pub span_frames: usize,
    /// Frames of the training set learned from in each epoch.
    pub frames: usize,
    /// Passes.
    pub epochs: usize,
    /// Training ends once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
    /// Frames a step.
    pub batch: usize,
    /// Peak of Adam's learning rate.
    pub learning_rate: f64,
}

impl Default for AutoencoderConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            widths: AutoencoderWidths {
                outer: 360,
                inner: 180,
                latent: 100,
            },
            span: 400,
            span_frames: 2400,
            frames: 20_000,
            epochs: 40,
            patience_epochs: PATIENCE_EPOCHS,
            batch: 128,
            learning_rate: 3e-4,
        }
    }
}

/// Settings of the regressor's training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegressorConfig {
    /// Seed of everything random.
    pub seed: u64,
    /// Neurons of the hidden layer; the root of the number of inputs times that of offset
    /// coordinates where none is given (Masters 1993, section 3.5).
    pub hidden: Option<usize>,
    /// Whether the loss weighs vertices by their rigidity (Eqs. 6-7).
    pub weighted: bool,
    /// Ticks that the network goes on from its own latents before the next true ones: 1 is the
    /// paper's training, in which the latents before are always the true ones.
    pub rollout: usize,
    /// Deviation of the noise on the true latents, in deviations of the latents.
    pub latent_noise: f32,
    /// Passes over the training set.
    pub epochs: usize,
    /// Training ends once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
    /// Frames a step.
    pub batch: usize,
    /// Peak of Adam's learning rate.
    pub learning_rate: f64,
    /// Largest norm of a parameter's gradient.
    pub clip_norm: f32,
}

impl Default for RegressorConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            hidden: Some(1024),
            weighted: true,
            rollout: 16,
            latent_noise: 0.05,
            epochs: 20,
            patience_epochs: PATIENCE_EPOCHS,
            batch: 1024,
            learning_rate: 1e-3,
            clip_norm: 1.0,
        }
    }
}

/// Settings of the method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CasasOtaduyConfig {
    /// Of the autoencoder.
    pub autoencoder: AutoencoderConfig,
    /// Of the regressor.
    pub regressor: RegressorConfig,
}

impl CasasOtaduyConfig {
    /// The networks and their training in words; `hidden` neurons, offsets of `coordinates`
    /// numbers.
    pub(super) fn description(&self, hidden: usize, coordinates: usize) -> String {
        let (a, r) = (&self.autoencoder, &self.regressor);
        let AutoencoderWidths {
            outer,
            inner,
            latent,
        } = a.widths;
        let loss = if r.weighted {
            "vertices weighted by their rigidity (Eqs. 6-7)"
        } else {
            "all vertices alike"
        };
        format!(
            "Autoencoder {coordinates}-{outer}-{inner}-{latent} and back (the paper's has widths \
             6000, 3000, 100), of which the decoder is stored, its two linear layers as one; \
             trained on {frames} frames an epoch in the span of {span} principal components. \
             Regressor: {hidden} rectified linear units over three poses, β and two latents. Adam, \
             learning rate {rate}, {rollout} ticks on its own latents at a time; loss: squared \
             distance of offsets, {loss}.",
            frames = a.frames,
            span = a.span,
            rate = r.learning_rate,
            rollout = r.rollout,
        )
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`TrainError::Config`], naming the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let (a, r) = (&self.autoencoder, &self.regressor);
        within([
            ("outer width", a.widths.outer, 1..=100_000),
            ("inner width", a.widths.inner, 1..=100_000),
            ("latents", a.widths.latent, 1..=4096),
            ("span", a.span, a.widths.latent..=16_384),
            ("span frames", a.span_frames, 1..=50_000),
            ("autoencoder frames", a.frames, 1..=10_000_000),
            ("autoencoder epochs", a.epochs, 1..=100_000),
            ("autoencoder batch", a.batch, 1..=100_000),
            ("hidden", r.hidden.unwrap_or(1), 1..=100_000),
            ("rollout", r.rollout, 1..=1000),
            ("epochs", r.epochs, 1..=100_000),
            ("batch", r.batch, r.rollout..=1_000_000),
        ])?;
        within([
            ("autoencoder rate", a.learning_rate, 1e-12..=1.0),
            ("learning_rate", r.learning_rate, 1e-12..=1.0),
            ("latent_noise", f64::from(r.latent_noise), 0.0..=10.0),
            ("clip_norm", f64::from(r.clip_norm), 1e-6..=1e6),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_autoencoder_has_the_published_number_of_parameters() {
        assert_eq!(
            AutoencoderWidths::PUBLISHED.parameters(3 * 6890),
            284_678_770
        );
    }

    #[test]
    fn the_default_is_in_range_and_nonsense_is_not() {
        CasasOtaduyConfig::default().check().expect("defaults");
        let mut nonsense = CasasOtaduyConfig::default();
        nonsense.autoencoder.span = nonsense.autoencoder.widths.latent - 1;
        let error = nonsense.check().expect_err("too narrow a span");
        assert!(error.to_string().contains("span"), "{error}");
        let mut nonsense = CasasOtaduyConfig::default();
        nonsense.regressor.latent_noise = f32::NAN;
        assert!(nonsense.check().is_err());
    }
}
