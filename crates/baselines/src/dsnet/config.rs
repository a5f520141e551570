//! Settings of DSNet.

use serde::{Deserialize, Serialize};

use dynaskin_train::{PATIENCE_EPOCHS, TrainError, within};

/// How the body's shape β enters the predictor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeInput {
    /// With the pose, at every step (the paper's section 4.3, what it found to work better).
    EveryStep,
    /// Once: a network of radial basis functions makes the LSTM's first state of it.
    FirstState,
}

/// Settings of a DSNet run; they are stored beside the weights.
///
/// The defaults train in an hour on two cores, with an autoencoder that leaves 0.4 of static; one with a third
/// of the channels and strides of 4 left 0.7. [`DsnetConfig::published`] has the paper's numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DsnetConfig {
    /// Seed of everything random.
    pub seed: u64,
    /// How β enters.
    pub shape_input: ShapeInput,
    /// The autoencoder's sizes.
    pub autoencoder: AutoencoderSizes,
    /// Frames that it learns from, drawn evenly from the training clips; a fifth as many of the
    /// validation clips decide which epoch is kept.
    pub autoencoder_frames: usize,
    /// Passes over them.
    pub autoencoder_epochs: usize,
    /// Frames of a batch.
    pub autoencoder_batch: usize,
    /// Adam's learning rate; it falls to nothing along a half cosine.
    pub autoencoder_learning_rate: f64,
    /// Width of the first dense layer, which is linear.
    pub linear: usize,
    /// Width of the second, which has tanh.
    pub tanh: usize,
    /// Cells of the LSTM.
    pub hidden: usize,
    /// Frames of a sequence: longer clips lose their tail, shorter ones are padded with zeros.
    pub frames: usize,
    /// Sequences of a batch.
    pub batch: usize,
    /// Passes over the training sequences.
    pub epochs: usize,
    /// Training of either network ends once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
    /// Adam's learning rate; it falls to nothing along a half cosine.
    pub learning_rate: f64,
    /// Whether padded frames are left out of the loss and of the batch normalisation. The paper does
    /// not say; it chose the sequence length so that there are few.
    pub mask: bool,
}

/// Sizes of the mesh autoencoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AutoencoderSizes {
    /// Channels after the two dense layers of each vertex; the convolutions keep the second number.
    pub channels: [usize; 2],
    /// Taps of a convolution, an odd number.
    pub kernel: usize,
    /// Strides of the four convolutions.
    pub strides: [usize; 4],
    /// Latents.
    pub latents: usize,
}

impl AutoencoderSizes {
    /// Those of the paper, as far as it tells.
    ///
    /// It gives 100 latents, the layers and 33,626,606 parameters for 6,890 vertices, but neither
    /// channels nor kernels nor strides. These here have 33,626,215, the nearest that was found with
    /// round numbers.
    pub const PUBLISHED: Self = Self {
        channels: [48, 96],
        kernel: 5,
        strides: [2, 2, 1, 1],
        latents: 100,
    };
}

impl Default for DsnetConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            shape_input: ShapeInput::EveryStep,
            autoencoder: AutoencoderSizes {
                channels: [12, 24],
                kernel: 5,
                strides: [2, 2, 2, 2],
                latents: 100,
            },
            autoencoder_frames: 3000,
            autoencoder_epochs: 30,
            autoencoder_batch: 32,
            autoencoder_learning_rate: 3e-3,
            linear: 64,
            tanh: 128,
            hidden: 60,
            frames: 300,
            batch: 16,
            epochs: 100,
            patience_epochs: PATIENCE_EPOCHS,
            learning_rate: 2e-3,
            mask: true,
        }
    }
}

impl DsnetConfig {
    /// The paper's sizes and learning rates (section 5); epochs, which it does not give, are chosen.
    pub fn published(shape_input: ShapeInput) -> Self {
        Self {
            shape_input,
            autoencoder: AutoencoderSizes::PUBLISHED,
            autoencoder_frames: 15_051,
            autoencoder_epochs: 200,
            autoencoder_batch: 64,
            autoencoder_learning_rate: 1e-4,
            epochs: 2000,
            // Small steps come to a better epoch less often.
            patience_epochs: 20 * PATIENCE_EPOCHS,
            learning_rate: 1e-4,
            ..Self::default()
        }
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`TrainError::Config`], naming the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let sizes = &self.autoencoder;
        let smallest_stride = sizes.strides.into_iter().min().unwrap_or(0);
        let largest_stride = sizes.strides.into_iter().max().unwrap_or(0);
        within([
            ("autoencoder.channels", sizes.channels[0], 1..=4096),
            ("autoencoder.channels", sizes.channels[1], 1..=4096),
            ("autoencoder.kernel", sizes.kernel, 1..=63),
            ("autoencoder.strides", smallest_stride, 1..=16),
            // A kernel shorter than its stride would not see every vertex.
            ("autoencoder.strides", largest_stride, 1..=sizes.kernel),
            ("autoencoder.latents", sizes.latents, 1..=4096),
            ("autoencoder_frames", self.autoencoder_frames, 1..=1_000_000),
            ("autoencoder_epochs", self.autoencoder_epochs, 1..=100_000),
            ("autoencoder_batch", self.autoencoder_batch, 1..=4096),
            ("linear", self.linear, 1..=4096),
            ("tanh", self.tanh, 1..=4096),
            ("hidden", self.hidden, 1..=4096),
            ("frames", self.frames, 1..=10_000),
            ("batch", self.batch, 1..=4096),
            ("epochs", self.epochs, 1..=100_000),
        ])?;
        if sizes.kernel.is_multiple_of(2) {
            return Err(TrainError::Config {
                setting: "autoencoder.kernel",
                got: sizes.kernel.to_string(),
                expected: "odd".into(),
            });
        }
        let rates = 1e-12..=1.0;
        within([
            (
                "autoencoder_learning_rate",
                self.autoencoder_learning_rate,
                rates.clone(),
            ),
            ("learning_rate", self.learning_rate, rates),
        ])
    }

    /// The networks and their training in words.
    pub fn description(&self, decoder_weights: usize, predictor_weights: usize) -> String {
        let sizes = &self.autoencoder;
        format!(
            "DSNet (Seo, Zou, Cordier 2021). Mesh autoencoder: two dense layers a vertex to \
             {channels:?} channels, four convolutions along the vertices with {kernel} taps and \
             strides {strides:?}, dense to {latents} latents, mirrored (the decoder has \
             {decoder_weights} weights); trained on {ae_frames} frames for {ae_epochs} epochs with \
             Adam, learning rate {ae_rate}, batch {ae_batch}. Predictor: {input}; dense {linear}, \
             dense {tanh} with tanh, LSTM {hidden}, batch normalisation, dense {latents} \
             ({predictor_weights} weights); L2 distance in latent space, Adam, learning rate {rate}, \
             batch {batch}, sequences of {frames} frames, {mask}, {epochs} epochs.",
            channels = sizes.channels,
            kernel = sizes.kernel,
            strides = sizes.strides,
            latents = sizes.latents,
            ae_frames = self.autoencoder_frames,
            ae_epochs = self.autoencoder_epochs,
            ae_rate = self.autoencoder_learning_rate,
            ae_batch = self.autoencoder_batch,
            input = match self.shape_input {
                ShapeInput::EveryStep => "pose and shape at every step",
                ShapeInput::FirstState =>
                    "pose at every step, the LSTM's first state from radial basis functions of the shape",
            },
            linear = self.linear,
            tanh = self.tanh,
            hidden = self.hidden,
            rate = self.learning_rate,
            batch = self.batch,
            frames = self.frames,
            mask = if self.mask {
                "padding masked"
            } else {
                "padding counted"
            },
            epochs = self.epochs,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_range_and_nonsense_is_not() {
        DsnetConfig::default().check().expect("defaults");
        let published = DsnetConfig::published(ShapeInput::FirstState);
        published.check().expect("the paper's settings");
        assert_eq!(published.shape_input, ShapeInput::FirstState);
        let nonsense: [fn(&mut DsnetConfig); 5] = [
            |config| config.autoencoder.kernel = 4,
            |config| config.autoencoder.strides = [2, 6, 1, 1],
            |config| config.autoencoder.strides = [2, 0, 1, 1],
            |config| config.learning_rate = f64::NAN,
            |config| config.batch = 0,
        ];
        for edit in nonsense {
            let mut config = DsnetConfig::default();
            edit(&mut config);
            assert!(config.check().is_err(), "{config:?}");
        }
    }
}
