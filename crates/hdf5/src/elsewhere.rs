//! Links to other files. They are not followed, but told: what they lead to would be missing silently.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use hdf5_reader::error::Result;
use hdf5_reader::{ExternalLinkResolver, Hdf5File};

/// Names of the files to which links lead that were met so far.
#[derive(Clone, Default)]
pub(crate) struct Elsewhere(Arc<Mutex<BTreeSet<String>>>);

impl Elsewhere {
    pub fn files(&self) -> Vec<String> {
        let files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.iter().cloned().collect()
    }
}

impl ExternalLinkResolver for Elsewhere {
    fn resolve_external_link(&self, filename: &str) -> Result<Option<Hdf5File>> {
        let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.insert(filename.to_owned());
        Ok(None)
    }
}
