//! `dynaskin train dynaskin`, or without a method: our own networks.

use std::time::Instant;

use clap::Args;
use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::{
    Checkpoint, Networks, Precision, Predictor, Prepared, TissueMeasure, TrainConfig,
    TrainingInput, decoder_onnx, predictor_onnx, prepare, train as train_predictor,
};

use super::args::{CommonArgs, EpochArgs};
use super::progress::{clip_bar, epoch_line};
use crate::commands::say;

/// Options of our own method.
#[derive(Debug, Args)]
pub struct DynaskinArgs {
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(flatten)]
    pub epochs: EpochArgs,
    /// Width of the encoding.
    #[arg(long, default_value_t = TrainConfig::default().encoding)]
    encoding: usize,
    /// Damped springs.
    #[arg(long, default_value_t = TrainConfig::default().springs)]
    springs: usize,
    /// Cells of the LSTM.
    #[arg(long, default_value_t = TrainConfig::default().hidden)]
    hidden: usize,
    /// Principal components.
    #[arg(long, default_value_t = TrainConfig::default().components)]
    components: usize,
    /// Frames per window of back-propagation through time.
    #[arg(long, default_value_t = TrainConfig::default().window)]
    window: usize,
    /// Sequences side by side in a batch.
    #[arg(long, default_value_t = TrainConfig::default().lanes)]
    lanes: usize,
    /// AdamW's weight decay.
    #[arg(long, default_value_t = TrainConfig::default().weight_decay)]
    weight_decay: f32,
    /// Weight of the change of the error from tick to tick, relative to the error.
    #[arg(long, default_value_t = TrainConfig::default().velocity_weight)]
    velocity_weight: f32,
    /// Share of the training clips that are used a second time in the form in which a page would receive
    /// them: held, jittered or noisy, through the runtime's conditioning.
    #[arg(long, default_value_t = TrainConfig::default().source_share)]
    source_share: f64,
    /// Standard deviation of the shape coefficients as inputs, beside that of the thickness of the tissue, 1.
    #[arg(long, alias = "shape-loudness", default_value_t = TrainConfig::default().shape_scale)]
    shape_scale: f32,
    /// Connect every spring to every joint.
    #[arg(long)]
    global: bool,
    /// Do not tie left and right: for a body that is not symmetric.
    #[arg(long)]
    no_mirror: bool,
}

impl DynaskinArgs {
    fn config(&self) -> TrainConfig {
        let usual = TrainConfig::default();
        let epochs = &self.epochs;
        TrainConfig {
            seed: self.common.seed,
            epochs: epochs.epochs.unwrap_or(usual.epochs),
            patience_epochs: epochs.patience.unwrap_or(usual.patience_epochs),
            encoding: self.encoding,
            springs: self.springs,
            hidden: self.hidden,
            components: self.components,
            window: self.window,
            lanes: self.lanes,
            learning_rate: epochs.learning_rate.unwrap_or(usual.learning_rate),
            weight_decay: self.weight_decay,
            velocity_weight: self.velocity_weight,
            source_share: self.source_share,
            shape_scale: self.shape_scale,
            local: !self.global,
            mirror: !self.no_mirror,
            ..usual
        }
    }
}

/// Trains our networks; gives the minutes it took, earlier runs of the checkpoint among them.
pub fn train(args: &DynaskinArgs, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
    let config = args.config();
    config.check()?;
    let folder = args.epochs.checkpoint_folder(&args.common.out);
    let checkpoint = Checkpoint::new(&folder)?.for_data(input.data_set.fingerprint());
    let _lock = args.epochs.claim(&folder, || checkpoint.holds_run())?;

    let bar = clip_bar("reading clips");
    let prepared = prepare(input.data_set, input.body, &config, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    say(&tissue_line(&prepared.inputs.build.tissue));

    let start = Instant::now();
    let mut epochs_seen = 0;
    let (predictor, best) = train_predictor(
        &prepared.data,
        &config,
        input.compute,
        (&checkpoint, args.epochs.resume),
        |epoch| {
            epochs_seen += 1;
            say(&epoch_line(
                epoch,
                config.epochs,
                epochs_seen,
                start.elapsed(),
            ));
        },
    )?;
    let networks = dynaskin_networks(&prepared, &predictor, &config, best.epoch)?;
    Ok((networks, checkpoint.seconds()? / 60.0))
}

/// What the predictor is told about the tissue of a body, and what to do if it could be more.
fn tissue_line(tissue: &TissueMeasure) -> String {
    match tissue {
        TissueMeasure::Compliance(compliance) => format!(
            "bodies are told by the compliance of their tissue; the formula leaves {:.0} % of it on \
             shapes that it was not fitted to",
            100.0 * compliance.unexplained.exp_m1()
        ),
        TissueMeasure::Thickness(_) => "bodies are told by the thickness of their tissue, which \
             misleads for far shapes; `dynaskin simulate --compliance 512 --out DATA` gives better numbers"
            .to_owned(),
        TissueMeasure::Unknown => "the body knows no tissue: bodies are told by β alone".to_owned(),
    }
}

/// The trained parts as files of the contract.
fn dynaskin_networks(
    prepared: &Prepared,
    predictor: &Predictor,
    config: &TrainConfig,
    best_epoch: usize,
) -> anyhow::Result<Networks> {
    Ok(Networks {
        feature_kind: FeatureKind::InertialMaterials,
        predictor_onnx: predictor_onnx(
            predictor,
            &prepared.inputs,
            &prepared.data.deviation_m,
            // 8 bits would save an eighth of the predictor's bytes, which fit as they are.
            Precision::Half,
        )?,
        decoder_onnx: decoder_onnx(&prepared.basis, Precision::ShortHalf)?,
        latent_count: prepared.basis.components(),
        parameters: predictor.weight_count() + prepared.basis.weight_count(),
        description: config.description(),
        config: serde_json::to_value(config)?,
        best_epoch,
    })
}
