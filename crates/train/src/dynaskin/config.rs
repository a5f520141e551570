//! Settings of a training run; they are stored beside the weights.

use serde::{Deserialize, Serialize};

use crate::TrainError;
use crate::epochs::PATIENCE_EPOCHS;
use crate::settings::within;

/// Settings of a training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainConfig {
    /// Seed of everything random. The same seed and data give the same weights on one machine.
    pub seed: u64,
    /// Passes over the training set.
    pub epochs: usize,
    /// Training ends once so many epochs in a row were no better than one before; 0: never.
    pub patience_epochs: usize,
    /// Width of the encoding, and of the LSTM's input.
    pub encoding: usize,
    /// Damped springs.
    pub springs: usize,
    /// Cells of the LSTM.
    pub hidden: usize,
    /// Principal components of all blocks together: latents.
    pub components: usize,
    /// Frames that the principal components are fitted to, drawn from the training set.
    pub pca_frames: usize,
    /// Frames a window of back-propagation through time.
    pub window: usize,
    /// Sequences that run side by side: the batch.
    pub lanes: usize,
    /// Peak of the learning rate.
    pub learning_rate: f64,
    /// AdamW's decoupled weight decay.
    pub weight_decay: f32,
    /// Largest norm of a parameter's gradient.
    pub clip_norm: f32,
    /// How much the error's change from tick to tick counts beside the error itself.
    pub velocity_weight: f32,
    /// Standard deviation of the shape coefficients as inputs; the other numbers about the body have 1.
    #[serde(alias = "shape_loudness")]
    pub shape_scale: f32,
    /// Whether each block of the body has springs and cells of its own, connected to its joints only.
    pub local: bool,
    /// Whether left and right are tied: a mirrored motion gives mirrored offsets. The body must be symmetric.
    pub mirror: bool,
    /// Share of the training clips that are learned from once more as a page would have been given them:
    /// held, jittered or noisy, through the runtime's conditioning.
    #[serde(default)]
    pub source_share: f64,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            epochs: 56,
            patience_epochs: PATIENCE_EPOCHS,
            encoding: 224,
            springs: 240,
            hidden: 192,
            components: 272,
            pca_frames: 4000,
            window: 80,
            lanes: 8,
            learning_rate: 3e-3,
            weight_decay: 0.03,
            clip_norm: 1.0,
            velocity_weight: 1.5,
            shape_scale: 0.3,
            local: true,
            mirror: true,
            source_share: 0.35,
        }
    }
}

impl TrainConfig {
    /// The networks and their training in words.
    pub fn description(&self) -> String {
        format!(
            "Decoder: {components} principal components about zero, each of one block of the body. Predictor: dense {encoding} with \
             tanh; {springs} damped springs whose stiffness and damping depend on shape and \
             material{local}; LSTM {hidden}{cells}; dense to {components}. No bias between motion and \
             latents, so that rest is a fixed point. AdamW, learning rate {rate}, weight decay \
             {decay}, cosine decay over {epochs} epochs, windows of {window} frames in {lanes} \
             lanes{mirrored}{sources}; loss: mean over the blocks of the root mean square offset error in \
             the subspace, in millimetres, averaged over frames, and {velocity} times the same of its \
             change from tick to tick.",
            components = self.components,
            encoding = self.encoding,
            springs = self.springs,
            hidden = self.hidden,
            rate = self.learning_rate,
            decay = self.weight_decay,
            velocity = self.velocity_weight,
            epochs = self.epochs,
            window = self.window,
            lanes = self.lanes,
            local = if self.local {
                ", each driven by the joints of one block and read out for it"
            } else {
                ""
            },
            cells = if self.local {
                " whose cells are connected to one block and its neighbours"
            } else {
                ""
            },
            sources = if self.source_share > 0.0 {
                format!(
                    ", {:.0} % of the clips once more from held, jittered and noisy sources",
                    100.0 * self.source_share
                )
            } else {
                String::new()
            },
            mirrored = if self.mirror {
                ", left and right tied"
            } else {
                ""
            },
        )
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`TrainError::Config`], naming the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        within([
            ("epochs", self.epochs, 1..=100_000),
            ("encoding", self.encoding, 1..=4096),
            ("springs", self.springs, 1..=4096),
            ("hidden", self.hidden, 1..=4096),
            ("components", self.components, 1..=4096),
            ("pca_frames", self.pca_frames, 1..=50_000),
            // Velocities are told by two frames.
            ("window", self.window, 2..=10_000),
            ("lanes", self.lanes, 1..=4096),
        ])?;
        within([
            ("learning_rate", self.learning_rate, 1e-12..=1.0),
            ("weight_decay", f64::from(self.weight_decay), 0.0..=10.0),
            ("clip_norm", f64::from(self.clip_norm), 1e-6..=1e6),
            (
                "velocity_weight",
                f64::from(self.velocity_weight),
                0.0..=100.0,
            ),
            ("shape_scale", f64::from(self.shape_scale), 0.0..=100.0),
            ("source_share", self.source_share, 0.0..=1.0),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_in_range_and_nonsense_is_not() {
        TrainConfig::default().check().expect("defaults");
        let nonsense = TrainConfig {
            learning_rate: f64::NAN,
            ..TrainConfig::default()
        };
        let error = nonsense.check().expect_err("NaN");
        assert!(error.to_string().contains("learning_rate"), "{error}");
        let nonsense = TrainConfig {
            hidden: 0,
            ..TrainConfig::default()
        };
        assert!(nonsense.check().is_err());
    }
}
