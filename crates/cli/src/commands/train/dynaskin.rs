//! `dynaskin train` without `--method`: our own networks.

use std::time::Instant;

use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::{
    Checkpoint, Networks, Precision, Predictor, Prepared, TissueMeasure, TrainConfig,
    TrainingInput, decoder_onnx, predictor_onnx, prepare, train as train_predictor,
};

use super::{TrainArgs, clip_bar, epoch_line};
use crate::commands::say;

/// Trains our networks; gives the minutes it took, earlier runs of the checkpoint among them.
pub fn train(args: &TrainArgs, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
    let config = args.config();
    config.check()?;
    let checkpoint =
        Checkpoint::new(&args.checkpoint_folder())?.for_data(input.data_set.fingerprint());
    args.refuse_to_overwrite(checkpoint.holds_run())?;

    let bar = clip_bar("reading clips");
    let prepared = prepare(input.data_set, input.body, &config, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    say(&tissue_line(&prepared.hearing.build.tissue));

    let start = Instant::now();
    let mut epochs_seen = 0;
    let (predictor, best) = train_predictor(
        &prepared.data,
        &config,
        input.compute,
        (&checkpoint, args.resume),
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
