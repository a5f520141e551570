//! A run: what it tells, and where it keeps its state.

use std::fs;
use std::path::Path;

use dynaskin_train::{Checkpoint, EpochRecord, TrainError};

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

    pub(super) fn checkpoint(&self, network: &str) -> Result<(Checkpoint, bool), TrainError> {
        let checkpoint = Checkpoint::new(&self.path.join(network))?.for_data(self.data.to_owned());
        let resume = self.resume && checkpoint.holds_run();
        Ok((checkpoint, resume))
    }
}

/// Name of the folder of an autoencoder with so many latents.
pub(super) fn autoencoder_folder(latents: usize) -> String {
    format!("autoencoder-{latents}")
}
