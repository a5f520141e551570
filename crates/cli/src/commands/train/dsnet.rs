//! `dynaskin train --method dsnet` and `dsnet-rbf`.

use std::time::Instant;

use clap::Args;
use dynaskin_train::dsnet::{DsnetConfig, Progress, ShapeInput, Stage, StageEpoch, train_dsnet};
use dynaskin_train::{Method, Networks, TrainingInput};

use super::{TrainArgs, clip_bar};
use crate::commands::say;

/// Arguments of the two methods.
#[derive(Debug, Args)]
pub struct DsnetArgs {
    /// DSNet: the sizes and learning rates of the paper. Not made for two cores.
    #[arg(long)]
    dsnet_published: bool,
    /// DSNet: passes over the sequences.
    #[arg(long)]
    dsnet_epochs: Option<usize>,
    /// DSNet: learning rate of the predictor.
    #[arg(long)]
    dsnet_learning_rate: Option<f64>,
    /// DSNet: let padded frames count.
    #[arg(long)]
    dsnet_no_mask: bool,
    /// DSNet: frames that the autoencoder learns from.
    #[arg(long)]
    autoencoder_frames: Option<usize>,
    /// DSNet: passes over them.
    #[arg(long)]
    autoencoder_epochs: Option<usize>,
    /// DSNet: learning rate of the autoencoder.
    #[arg(long)]
    autoencoder_learning_rate: Option<f64>,
    /// DSNet: channels of the autoencoder, after the first and the second layer.
    #[arg(long, num_args = 2)]
    autoencoder_channels: Option<Vec<usize>>,
    /// DSNet: strides of its four convolutions.
    #[arg(long, num_args = 4)]
    autoencoder_strides: Option<Vec<usize>>,
}

impl DsnetArgs {
    fn config(&self, method: Method, seed: u64) -> DsnetConfig {
        let shape_input = match method {
            Method::DsnetRbf => ShapeInput::FirstState,
            _ => ShapeInput::EveryStep,
        };
        let mut config = if self.dsnet_published {
            DsnetConfig::published(shape_input)
        } else {
            DsnetConfig {
                shape_input,
                ..DsnetConfig::default()
            }
        };
        config.seed = seed;
        config.mask = !self.dsnet_no_mask;
        let set = |target: &mut usize, given: Option<usize>| *target = given.unwrap_or(*target);
        set(&mut config.epochs, self.dsnet_epochs);
        set(&mut config.autoencoder_frames, self.autoencoder_frames);
        set(&mut config.autoencoder_epochs, self.autoencoder_epochs);
        let set = |target: &mut f64, given: Option<f64>| *target = given.unwrap_or(*target);
        set(&mut config.learning_rate, self.dsnet_learning_rate);
        set(
            &mut config.autoencoder_learning_rate,
            self.autoencoder_learning_rate,
        );
        let sizes = &mut config.autoencoder;
        if let Some(channels) = self.autoencoder_channels.as_deref() {
            sizes.channels = channels.try_into().unwrap_or(sizes.channels);
        }
        if let Some(strides) = self.autoencoder_strides.as_deref() {
            sizes.strides = strides.try_into().unwrap_or(sizes.strides);
        }
        config
    }
}

/// Trains; gives the minutes it took, earlier runs of the checkpoint among them.
pub fn train(args: &TrainArgs, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
    let config = args.dsnet.config(args.method, input.seed);
    let folder = args.checkpoint_folder();
    args.refuse_to_overwrite(folder.join("autoencoder").exists())?;
    let bar = clip_bar("reading clips");
    let mut clock = Clock::default();
    let progress = &mut |progress: Progress<'_>| match progress {
        Progress::Reading(done, all) => {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        }
        Progress::Epoch(epoch) => say(&clock.line(epoch)),
    };
    let (networks, seconds) = train_dsnet(&input, &config, &folder, args.resume, progress)?;
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
