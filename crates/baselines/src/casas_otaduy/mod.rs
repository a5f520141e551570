//! Learning Nonlinear Soft-Tissue Dynamics for Interactive Avatars (Casas & Otaduy 2018).
//!
//! A fully connected autoencoder maps an offset field to 100 latents. A network with one hidden
//! layer of rectified linear units predicts the next latents from three poses and the two latents
//! before. Its loss is the distance of offset fields, each vertex weighted by how little rigid it
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
mod run;
mod span;
mod subspace;
#[cfg(test)]
mod tests;
mod window;

use burn::module::Module;
use dynaskin_onnx::Precision;

use dynaskin_train::{Networks, TrainError, TrainingInput};
use export::Trained;
use fit_regressor::Lesson;
use head::{Head, LatentScale};
use run::autoencoder_folder;

pub use config::{AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, RegressorConfig};
pub use run::{CasasOtaduyProgress, RunFolder};
pub use subspace::{SubspaceErrors, compare_subspaces};

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
