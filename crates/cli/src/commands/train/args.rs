//! Options that several methods share.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use dynaskin_files::FolderLock;
use dynaskin_train::{Compute, TrainConfig};

/// What every method needs.
#[derive(Debug, Args)]
pub struct CommonArgs {
    /// Folder of clips made by `dynaskin simulate`, or the folder `clips` of `dynaskin fit-all`.
    #[arg(long)]
    pub data: PathBuf,
    /// The body GLB that the clips were simulated on or fitted with.
    #[arg(long)]
    pub body: PathBuf,
    /// Folder to write the bundle into.
    #[arg(long)]
    pub out: PathBuf,
    /// What is held out, as JSON; the project's own split unless given.
    #[arg(long, conflicts_with_all = ["hold_out", "validate_on"])]
    pub split: Option<PathBuf>,
    /// Do not learn from this motion or person, but measure on it, instead of on what the project's own split
    /// holds out. Clips are named MOTION__PERSON. May be given several times.
    #[arg(long, value_name = "MOTION|PERSON", requires = "validate_on")]
    pub hold_out: Vec<String>,
    /// Motion that decides when to stop. May be given several times.
    #[arg(long, value_name = "MOTION", requires = "hold_out")]
    pub validate_on: Vec<String>,
    /// Seed of everything random.
    #[arg(long, default_value_t = TrainConfig::default().seed)]
    pub seed: u64,
    /// The body is in another folder already: do not write it.
    #[arg(long)]
    pub without_body: bool,
}

/// What methods have that are trained by epochs.
#[derive(Debug, Args)]
pub struct EpochArgs {
    /// Folder of the training state; `checkpoint` in the output folder unless given.
    #[arg(long)]
    checkpoint: Option<PathBuf>,
    /// Go on with the run whose state is in the checkpoint folder.
    #[arg(long)]
    pub resume: bool,
    /// Forget the run whose state is in the checkpoint folder, and begin anew.
    #[arg(long, conflicts_with = "resume")]
    restart: bool,
    /// What to train on: cpu, cuda or vulkan; the latter two need the cargo feature of that name.
    #[arg(long, value_parser = compute, default_value = "cpu")]
    pub device: Compute,
    /// Passes over the training set; as many as the method usually takes unless given.
    #[arg(long)]
    pub epochs: Option<usize>,
    /// End the training of a network once so many epochs in a row were no better than one before on
    /// the validation clips; 0 goes through all epochs. What the method usually has unless given.
    #[arg(long, value_name = "EPOCHS")]
    pub patience: Option<usize>,
    /// Peak of the learning rate; what the method usually has unless given.
    #[arg(long)]
    pub learning_rate: Option<f64>,
}

impl EpochArgs {
    /// Folder of the training state of a bundle in `out`.
    pub fn checkpoint_folder(&self, out: &Path) -> PathBuf {
        let folder = self.checkpoint.clone();
        folder.unwrap_or_else(|| out.join("checkpoint"))
    }

    /// Takes the folder of the training state for this run. Refuses to begin anew where it holds a
    /// run, unless told so, and where another process trains in it.
    pub fn claim(
        &self,
        folder: &Path,
        holds_run: impl FnOnce() -> bool,
    ) -> anyhow::Result<FolderLock> {
        let lock = FolderLock::take(folder)?;
        if holds_run() && !self.resume && !self.restart {
            bail!(
                "{} holds an earlier run: --resume goes on with it, --restart forgets it",
                folder.display()
            );
        }
        dynaskin_files::remove_leftovers(folder)?;
        Ok(lock)
    }
}

/// What the networks of the papers have in common.
#[derive(Debug, Args)]
pub struct PaperArgs {
    /// The sizes of the paper, which are not made for two cores.
    #[arg(long)]
    pub published_size: bool,
    /// Passes of the autoencoder's training.
    #[arg(long)]
    pub autoencoder_epochs: Option<usize>,
    /// Frames of each of these passes, drawn from the training set.
    #[arg(long)]
    pub autoencoder_frames: Option<usize>,
    /// Peak of the autoencoder's learning rate.
    #[arg(long)]
    pub autoencoder_learning_rate: Option<f64>,
}

fn compute(name: &str) -> Result<Compute, String> {
    Compute::from_name(name).ok_or_else(|| {
        let names = Compute::ALL.map(Compute::name);
        format!("no such device; there are {}", names.join(", "))
    })
}
