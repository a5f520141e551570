//! What is reported on.

use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use dynaskin_evaluate::study::Contestant;
use dynaskin_train::DataSet;

/// Index of the soft vertices among [`dynaskin_evaluate::study::group_names`].
pub(super) const SOFT: usize = 1;

/// What is reported on.
pub struct Subject<'a> {
    pub data_set: &'a DataSet,
    pub body: &'a BodyModel,
    /// Of continuous motion.
    pub minutes: usize,
    /// Whether to simulate other bodies and materials.
    pub simulate: bool,
    pub wasm_times: Option<&'a Path>,
    /// What subspaces can hold.
    pub subspaces: Option<&'a Path>,
    /// Folder of the bundle whose model card is to tell the summary.
    pub card: Option<&'a Path>,
}

/// The methods of a report: the static one first.
pub struct Methods {
    pub contestants: Vec<Contestant>,
    /// Names in files.
    pub names: Vec<String>,
    /// Files of their decoders; none for the static one.
    pub decoders: Vec<Option<PathBuf>>,
}

impl Methods {
    /// Names for people.
    pub fn labels(&self) -> impl Iterator<Item = &str> {
        self.contestants.iter().map(|c| c.label.as_str())
    }
}

/// `1,234,567`.
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
