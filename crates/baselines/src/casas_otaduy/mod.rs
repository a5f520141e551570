//! Learning Nonlinear Soft-Tissue Dynamics for Interactive Avatars (Casas & Otaduy 2018).
//!
//! A fully connected autoencoder makes 100 latents of an offset field; a network with one hidden
//! layer of rectified linear units predicts the next latents from three poses and the two latents
//! before; its loss is the distance of offset fields, each vertex weighted by how little rigid it
//! is. What differs from the paper:
//!
//! - one network serves all body shapes, so β is an input;
//! - poses and latents enter as newest value, change and change of that (see `window`);
//! - the regressor gives latents, and the decoder turns them into offsets: by the paper's text its
//!   output is the whole field, which the encoder makes latents of again in every tick (8 ms);
//! - the autoencoder's nonlinearity, which the paper leaves open, is tanh, its training starts from
//!   principal components, and its outermost layers are trained in the span of the data (see
//!   `span`);
//! - training goes on from the network's own latents for some ticks
//!   ([`RegressorConfig::rollout`]); the paper's way, always from the true ones, is a rollout of 1.

mod autoencoder;
mod config;
mod data;
mod export;
mod fit_autoencoder;
mod fit_regressor;
mod head;
mod regressor;
mod rigidity;
mod span;
mod subspace;
#[cfg(test)]
mod tests;
mod window;

use std::fs;
use std::path::Path;

use burn::module::Module;
use dynaskin_onnx::Precision;

use dynaskin_train::{Checkpoint, EpochRecord, Networks, TrainError, TrainingInput};
use export::Trained;
use fit_regressor::Lesson;
use head::{Head, LatentScale};

pub use config::{AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, RegressorConfig};
pub use subspace::{SubspaceErrors, compare_subspaces};

/// What training tells while it runs.
#[derive(Clone, Copy, Debug)]
pub enum CasasOtaduyProgress<'a> {
    /// Clips read so far, and in all.
    Clips {
        /// So far.
        done: usize,
        /// In all.
        all: usize,
    },
    /// An epoch of one of the networks.
    Epoch {
        /// `autoencoder` or `regressor`.
        network: &'static str,
        /// Epochs in all.
        epochs: usize,
        /// What it came to.
        record: &'a EpochRecord,
    },
}

/// Where a run keeps its state, and whether to take up what is there.
#[derive(Clone, Copy, Debug)]
pub struct RunFolder<'a> {
    /// The folder; each network has its own in it.
    pub path: &'a Path,
    /// Fingerprint of the data ([`dynaskin_train::DataSet::fingerprint`]).
    pub data: &'a str,
    /// Whether to go on with what the folder holds.
    pub resume: bool,
}

impl RunFolder<'_> {
    /// Whether one of the networks has been trained here, wholly or in part.
    pub fn holds_run(&self) -> bool {
        let Ok(entries) = fs::read_dir(self.path) else {
            return false;
        };
        let networks = entries.flatten().map(|entry| entry.path());
        let mut networks = networks.filter(|path| path.is_dir());
        networks.any(|path| Checkpoint::new(&path).is_ok_and(|checkpoint| checkpoint.holds_run()))
    }

    fn checkpoint(&self, network: &str) -> Result<(Checkpoint, bool), TrainError> {
        let checkpoint = Checkpoint::new(&self.path.join(network))?.for_data(self.data.to_owned());
        let resume = self.resume && checkpoint.holds_run();
        Ok((checkpoint, resume))
    }
}

/// Name of the folder of an autoencoder with so many latents.
fn autoencoder_folder(latents: usize) -> String {
    format!("autoencoder-{latents}")
}

/// Trains autoencoder and regressor; gives the networks and the minutes that it took, those of the
/// runs that were resumed among them. The autoencoder does not depend on the weights of the loss:
/// with its folder copied, a run with other [`RegressorConfig`] starts with it.
///
/// # Errors
/// [`TrainError::Config`], [`TrainError::EmptySplit`], [`TrainError::NotFinite`],
/// [`TrainError::Diverged`], [`TrainError::Checkpoint`], and whatever reading a clip can give.
pub fn train_casas_otaduy(
    input: TrainingInput<'_>,
    config: &CasasOtaduyConfig,
    folder: RunFolder<'_>,
    progress: &mut dyn FnMut(CasasOtaduyProgress<'_>),
) -> Result<(Networks, f64), TrainError> {
    config.check()?;
    let data = data::prepare(input, &config.autoencoder, |done, all| {
        progress(CasasOtaduyProgress::Clips { done, all });
    })?;
    let widths = config.autoencoder.widths;
    let (checkpoint, resume) = folder.checkpoint(&autoencoder_folder(widths.latent))?;
    let (autoencoder, _) = fit_autoencoder::fit_autoencoder(
        &data,
        &config.autoencoder,
        input.compute,
        (&checkpoint, resume),
        |record| {
            progress(CasasOtaduyProgress::Epoch {
                network: "autoencoder",
                epochs: config.autoencoder.epochs,
                record,
            });
        },
    )?;
    let mut seconds = checkpoint.seconds()?;

    let (scale, latents) = LatentScale::fit(&autoencoder, &data);
    let head = Head::new(&autoencoder, &scale);
    let lesson = Lesson {
        data: &data,
        scale: &scale,
        latents,
        head: &head,
    };
    let (checkpoint, resume) = folder.checkpoint("regressor")?;
    let (regressor, best) = fit_regressor::fit_regressor(
        &lesson,
        &config.regressor,
        input.compute,
        (&checkpoint, resume),
        |record| {
            progress(CasasOtaduyProgress::Epoch {
                network: "regressor",
                epochs: config.regressor.epochs,
                record,
            });
        },
    )?;
    seconds += checkpoint.seconds()?;

    let trained = Trained {
        span: &data.span,
        normaliser: &data.normaliser,
        scale: &scale,
        regressor: &regressor,
        head: &head,
    };
    let coordinates = data.span.basis.coordinates();
    let hidden = regressor.hidden.weight.val().dims()[1];
    let networks = Networks {
        feature_kind: window::KIND,
        predictor_onnx: export::predictor_onnx(trained, Precision::Half)?,
        decoder_onnx: export::decoder_onnx(trained, Precision::Half)?,
        latent_count: widths.latent,
        parameters: regressor.num_params() + widths.parameters(coordinates),
        description: config.description(hidden, coordinates),
        config: serde_json::to_value(config).map_err(|error| TrainError::Config {
            setting: "config",
            got: error.to_string(),
            expected: "finite numbers".into(),
        })?,
        best_epoch: best.epoch,
    };
    Ok((networks, seconds / 60.0))
}
