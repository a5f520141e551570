//! `dynaskin train dsnet` and `dsnet-rbf`.

use std::time::Instant;

use clap::Args;
use dynaskin_baselines::dsnet::{
    DsnetConfig, Progress, ShapeInput, Stage, StageEpoch, train_dsnet,
};
use dynaskin_train::{Networks, TrainingInput};

use super::args::{CommonArgs, EpochArgs, PaperArgs};
use super::progress::clip_bar;
use crate::commands::say;

/// Options of the two methods.
#[derive(Debug, Args)]
pub struct DsnetArgs {
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(flatten)]
    pub epochs: EpochArgs,
    #[command(flatten)]
    paper: PaperArgs,
    /// Include padded frames in the loss.
    #[arg(long)]
    no_mask: bool,
    /// Channels of the autoencoder, after the first and the second layer.
    #[arg(long, num_args = 2, conflicts_with = "published_size")]
    channels: Option<Vec<usize>>,
    /// Strides of its four convolutions.
    #[arg(long, num_args = 4, conflicts_with = "published_size")]
    strides: Option<Vec<usize>>,
}

fn config(args: &DsnetArgs, shape_input: ShapeInput) -> DsnetConfig {
    let usual = if args.paper.published_size {
        DsnetConfig::published(shape_input)
    } else {
        DsnetConfig {
            shape_input,
            ..DsnetConfig::default()
        }
    };
    let (paper, epochs) = (&args.paper, &args.epochs);
    let rate = paper.autoencoder_learning_rate;
    let mut autoencoder = usual.autoencoder;
    if let Some(channels) = args.channels.as_deref() {
        autoencoder.channels = channels.try_into().unwrap_or(autoencoder.channels);
    }
    if let Some(strides) = args.strides.as_deref() {
        autoencoder.strides = strides.try_into().unwrap_or(autoencoder.strides);
    }
    DsnetConfig {
        seed: args.common.seed,
        mask: !args.no_mask,
        epochs: epochs.epochs.unwrap_or(usual.epochs),
        patience_epochs: epochs.patience.unwrap_or(usual.patience_epochs),
        learning_rate: epochs.learning_rate.unwrap_or(usual.learning_rate),
        autoencoder_frames: paper.autoencoder_frames.unwrap_or(usual.autoencoder_frames),
        autoencoder_epochs: paper.autoencoder_epochs.unwrap_or(usual.autoencoder_epochs),
        autoencoder_learning_rate: rate.unwrap_or(usual.autoencoder_learning_rate),
        autoencoder,
        ..usual
    }
}

/// Trains; gives the minutes it took, earlier runs of the checkpoint among them.
pub fn train(
    args: &DsnetArgs,
    shape_input: ShapeInput,
    input: TrainingInput<'_>,
) -> anyhow::Result<(Networks, f64)> {
    let config = config(args, shape_input);
    let folder = args.epochs.checkpoint_folder(&args.common.out);
    let holds_run = || folder.join("autoencoder").exists();
    let _lock = args.epochs.claim(&folder, holds_run)?;
    let bar = clip_bar("reading clips");
    let mut clock = Clock::default();
    let progress = &mut |progress: Progress<'_>| match progress {
        Progress::Reading(done, all) => {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        }
        Progress::Epoch(epoch) => say(&clock.line(epoch)),
    };
    let (networks, seconds) = train_dsnet(&input, &config, &folder, args.epochs.resume, progress)?;
    bar.finish_and_clear();
    Ok((networks, seconds / 60.0))
}

/// Tells how long it will take.
#[derive(Default)]
struct Clock {
    /// The stage, when its first epoch of this run ended, and which that was.
    since: Option<(Stage, Instant, usize)>,
}

impl Clock {
    fn line(&mut self, epoch: &StageEpoch) -> String {
        let now = Instant::now();
        let fresh = (epoch.stage, now, epoch.record.epoch);
        let since = self.since.filter(|since| since.0 == epoch.stage);
        let (_, start, first) = *self.since.insert(since.unwrap_or(fresh));
        let seen = (epoch.record.epoch - first) as f64;
        let each = if seen > 0.0 {
            start.elapsed().as_secs_f64() / seen
        } else {
            epoch.record.seconds
        };
        let (name, unit) = match epoch.stage {
            Stage::Autoencoder => ("autoencoder", " mm"),
            Stage::Predictor => ("predictor", ""),
        };
        format!(
            "{name} epoch {:3}/{}  loss {:.4}  validation {:.4}{unit}, {:.3} of static  {:.0} s, \
             {:.0} min left",
            epoch.record.epoch,
            epoch.epochs,
            epoch.record.training_loss,
            epoch.record.validation_loss,
            epoch.record.validation_ratio,
            epoch.record.seconds,
            each * (epoch.epochs - epoch.record.epoch) as f64 / 60.0
        )
    }
}
