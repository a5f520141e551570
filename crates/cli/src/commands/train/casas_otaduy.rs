//! `dynaskin train casas-otaduy` and its sibling without weights.

use std::time::Instant;

use anyhow::bail;
use clap::Args;
use dynaskin_baselines::{
    AutoencoderConfig, AutoencoderWidths, CasasOtaduyConfig, CasasOtaduyProgress, RegressorConfig,
    RunFolder, compare_subspaces, train_casas_otaduy,
};
use dynaskin_train::{ClipEntry, DataSet, Networks, Set, TrainingInput};

use super::args::{CommonArgs, EpochArgs, PaperArgs};
use super::progress::{clip_bar, epoch_line};
use super::subspaces::SubspaceRow;
use crate::commands::say;

/// Options of Casas & Otaduy's method.
#[derive(Debug, Args)]
pub struct CasasOtaduyArgs {
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(flatten)]
    pub epochs: EpochArgs,
    #[command(flatten)]
    paper: PaperArgs,
    /// Widths of the autoencoder: two layers, then the latents.
    #[arg(
        long,
        value_name = "OUTER,INNER,LATENTS",
        value_parser = widths,
        conflicts_with = "published_size"
    )]
    autoencoder_widths: Option<AutoencoderWidths>,
    /// Neurons of the regressor's hidden layer.
    #[arg(long, conflicts_with = "published_size")]
    neurons: Option<usize>,
    /// Ticks for which the regressor continues from its own latents in training; 1 in the paper.
    #[arg(long, default_value_t = RegressorConfig::default().rollout)]
    rollout: usize,
    /// Noise on the true latents in training, in standard deviations of the latents.
    #[arg(long, default_value_t = RegressorConfig::default().latent_noise)]
    latent_noise: f32,
    /// Compare autoencoders of 50 and 100 latents with principal components on this held-out clip,
    /// print the mean errors, and write them frame by frame to `subspaces.csv`.
    #[arg(long, value_name = "CLIP")]
    compare_subspaces: Option<String>,
}

fn widths(text: &str) -> Result<AutoencoderWidths, String> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[outer, inner, latent]) => Ok(AutoencoderWidths {
            outer,
            inner,
            latent,
        }),
        _ => Err("expected three numbers, such as 6000,3000,100".into()),
    }
}

impl CasasOtaduyArgs {
    fn config(&self, weighted: bool) -> CasasOtaduyConfig {
        let (seed, paper, epochs) = (self.common.seed, &self.paper, &self.epochs);
        let mut autoencoder = AutoencoderConfig {
            seed,
            ..AutoencoderConfig::default()
        };
        autoencoder.epochs = paper.autoencoder_epochs.unwrap_or(autoencoder.epochs);
        autoencoder.frames = paper.autoencoder_frames.unwrap_or(autoencoder.frames);
        let rate = paper.autoencoder_learning_rate;
        autoencoder.learning_rate = rate.unwrap_or(autoencoder.learning_rate);
        let mut regressor = RegressorConfig {
            seed,
            weighted,
            rollout: self.rollout,
            latent_noise: self.latent_noise,
            ..RegressorConfig::default()
        };
        autoencoder.widths = self.autoencoder_widths.unwrap_or(autoencoder.widths);
        regressor.epochs = epochs.epochs.unwrap_or(regressor.epochs);
        regressor.learning_rate = epochs.learning_rate.unwrap_or(regressor.learning_rate);
        regressor.hidden = self.neurons.or(regressor.hidden);
        let patience = epochs.patience;
        autoencoder.patience_epochs = patience.unwrap_or(autoencoder.patience_epochs);
        regressor.patience_epochs = patience.unwrap_or(regressor.patience_epochs);
        if paper.published_size {
            autoencoder.widths = AutoencoderWidths::PUBLISHED;
            // All that the sample spans, where layers are this wide.
            autoencoder.span = autoencoder.span_frames;
            regressor.hidden = None;
        }
        CasasOtaduyConfig {
            autoencoder,
            regressor,
        }
    }
}

/// Refuses a clip for --compare-subspaces before the hours of training that come first.
fn check_held_out(data_set: &DataSet, clip: &str) -> anyhow::Result<()> {
    let held_out = data_set
        .clips
        .iter()
        .filter(|entry| Set::TEST.contains(&entry.set));
    let stem = |entry: &ClipEntry| {
        entry
            .path
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
    };
    let mut names: Vec<String> = held_out.filter_map(stem).collect();
    names.sort();
    if names.iter().any(|name| name == clip) {
        return Ok(());
    }
    let some = match names.first() {
        Some(first) => format!("there are {}, among them {first}", names.len()),
        None => "there are none".to_owned(),
    };
    bail!(
        "--compare-subspaces {clip}: expected a clip that is held out, without its ending; {some}"
    )
}

/// Trains the method, with or without the weights of the loss; gives the minutes it took, too.
pub fn train(
    args: &CasasOtaduyArgs,
    weighted: bool,
    input: TrainingInput<'_>,
) -> anyhow::Result<(Networks, f64)> {
    if let Some(clip) = &args.compare_subspaces {
        check_held_out(input.data_set, clip)?;
    }
    let config = args.config(weighted);
    let path = args.epochs.checkpoint_folder(&args.common.out);
    let folder = RunFolder {
        path: &path,
        data: &input.data_set.fingerprint(),
        resume: args.epochs.resume,
    };
    let _lock = args.epochs.claim(&path, || folder.holds_run())?;
    let (mut bar, mut start, mut seen) = (None, Instant::now(), ("", 0));
    let mut progress = |progress: CasasOtaduyProgress<'_>| match progress {
        CasasOtaduyProgress::Clips { done, all } => {
            let shown = bar.get_or_insert_with(|| clip_bar("reading clips"));
            shown.set_length(all as u64);
            shown.set_position(done as u64);
            if done == all {
                shown.finish_and_clear();
                bar = None;
            }
        }
        CasasOtaduyProgress::Epoch {
            network,
            epochs,
            record,
        } => {
            if seen.0 != network {
                seen = (network, 0);
                start = Instant::now() - std::time::Duration::from_secs_f64(record.seconds);
            }
            seen.1 += 1;
            let line = epoch_line(record, epochs, seen.1, start.elapsed());
            say(&format!("{network} {line}"));
        }
    };
    let trained = train_casas_otaduy(input, &config, folder, &mut progress)?;
    if let Some(clip) = &args.compare_subspaces {
        let folder = RunFolder {
            resume: true,
            ..folder
        };
        let sizes = [50, config.autoencoder.widths.latent];
        let autoencoder = &config.autoencoder;
        let compared = compare_subspaces(input, autoencoder, &sizes, clip, folder, &mut progress)?;
        let mean = |curve: &[f64]| curve.iter().sum::<f64>() / curve.len().max(1) as f64;
        let mut csv = format!("{}\n", SubspaceRow::HEAD);
        for errors in &compared {
            say(&format!(
                "{clip}: {} latents: autoencoder {:.3} mm, principal components {:.3} mm",
                errors.latents,
                mean(&errors.autoencoder_mm),
                mean(&errors.pca_mm)
            ));
            let curves = errors.autoencoder_mm.iter().zip(&errors.pca_mm).enumerate();
            for (frame, (autoencoder, pca)) in curves {
                let row = SubspaceRow {
                    clip: clip.clone(),
                    latents: errors.latents,
                    frame,
                    autoencoder_mm: *autoencoder,
                    pca_mm: *pca,
                };
                csv.push_str(&format!("{row}\n"));
            }
        }
        std::fs::create_dir_all(&args.common.out)?;
        dynaskin_files::replace(&args.common.out.join("subspaces.csv"), csv.as_bytes())?;
    }
    Ok(trained)
}
