//! `dynaskin train` without `--method`: our own networks.

use std::time::Instant;

use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::{
    Checkpoint, Networks, Precision, Predictor, Prepared, TrainConfig, TrainingInput, decoder_onnx,
    predictor_onnx, prepare, train as train_predictor,
};

use super::{TrainArgs, clip_bar, epoch_line};
use crate::commands::say;

/// Trains our networks; gives the minutes it took, earlier runs of the checkpoint among them.
pub fn train(args: &TrainArgs, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
    let config = args.config();
    config.check()?;
    let checkpoint = Checkpoint::new(&args.checkpoint_folder())?;
    args.refuse_to_overwrite(checkpoint.holds_run())?;

    let bar = clip_bar("reading clips");
    let prepared = prepare(input.data_set, input.body, &config, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();

    let start = Instant::now();
    let mut epochs_seen = 0;
    let (predictor, best) =
        train_predictor(&prepared.data, &config, &checkpoint, args.resume, |epoch| {
            epochs_seen += 1;
            say(&epoch_line(
                epoch,
                config.epochs,
                epochs_seen,
                start.elapsed(),
            ));
        })?;
    let networks = dynaskin_networks(&prepared, &predictor, &config, best.epoch)?;
    Ok((networks, checkpoint.seconds()? / 60.0))
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
            &prepared.hearing,
            &prepared.data.deviation_m,
            Precision::Half,
        )?,
        decoder_onnx: decoder_onnx(&prepared.basis, Precision::Half)?,
        latent_count: prepared.basis.components(),
        parameters: predictor.weight_count() + prepared.basis.weight_count(),
        description: config.description(),
        config: serde_json::to_value(config)?,
        best_epoch,
    })
}
