//! `bundle.json`: what belongs together, and whether it does.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use crate::RuntimeError;
use crate::features::FeatureKind;

/// The only `format` there is.
pub const BUNDLE_FORMAT: &str = "dynaskin-bundle";

/// The `version` that is written and read.
pub const BUNDLE_VERSION: u32 = 1;

/// A file beside `bundle.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BundleFile {
    /// File name without folders.
    pub file: String,
    /// SHA-256 of the file, 64 lower-case hexadecimal digits.
    pub sha256: String,
}

/// The contents of `bundle.json` (ARCHITECTURE.md, "Bundle").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bundle {
    /// [`BUNDLE_FORMAT`].
    pub format: String,
    /// [`BUNDLE_VERSION`].
    pub version: u32,
    /// Name for people, such as `female`.
    pub name: String,
    /// Ticks per second of the predictor: 60.
    pub rate_hz: f64,
    /// The body the offsets belong to.
    pub body: BundleFile,
    /// The predictor's graph.
    pub predictor: BundleFile,
    /// The decoder's graph.
    pub decoder: BundleFile,
    /// What the predictor takes as input.
    pub feature_kind: FeatureKind,
    /// F: the predictor's number of features.
    pub feature_count: usize,
    /// L: the predictor's outputs and the decoder's inputs.
    pub latent_count: usize,
    /// Indices of the body's vertices that the decoder moves, ascending.
    pub vertices: Vec<u32>,
    /// What the networks were trained on.
    #[serde(default)]
    pub training: Map<String, Value>,
    /// How well they did.
    #[serde(default)]
    pub measured: Map<String, Value>,
    /// Licence of the networks.
    pub licence: String,
}

impl Bundle {
    /// Reads `bundle.json` and checks it as far as it can be checked alone.
    ///
    /// # Errors
    /// [`RuntimeError::BundleJson`], [`RuntimeError::BundleVersion`], [`RuntimeError::BundleField`]
    /// for a rate other than 60 Hz, a feature count other than the kind's, file names with folders
    /// in them, and vertices that are not ascending.
    pub fn from_json(json: &[u8]) -> Result<Self, RuntimeError> {
        check_version(json)?;
        let bundle: Self = parse(json)?;
        bundle.check()?;
        Ok(bundle)
    }

    /// As JSON, for writing.
    ///
    /// # Errors
    /// [`RuntimeError::BundleJson`] where a number is not finite.
    pub fn to_json(&self) -> Result<String, RuntimeError> {
        serde_json::to_string_pretty(self).map_err(|error| RuntimeError::BundleJson {
            reason: error.to_string(),
        })
    }

    fn check(&self) -> Result<(), RuntimeError> {
        if (self.rate_hz - dynaskin_skeleton::MODEL_RATE_HZ).abs() > 1e-9 {
            return Err(field("rate_hz", "60", self.rate_hz));
        }
        let features = self.feature_kind.count();
        if self.feature_count != features {
            return Err(field("feature_count", features, self.feature_count));
        }
        for file in [&self.body, &self.predictor, &self.decoder] {
            let plain = !file.file.is_empty()
                && !file.file.starts_with('.')
                && !file.file.contains(['/', '\\', ':', '\0']);
            if !plain {
                return Err(field("file", "a file name without folders", &file.file));
            }
        }
        if let Some(pair) = self.vertices.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(field(
                "vertices",
                "ascending indices",
                format!("{} before {}", pair[0], pair[1]),
            ));
        }
        Ok(())
    }
}

impl BundleFile {
    /// Describes a file of the given contents.
    pub fn of(file: &str, contents: &[u8]) -> Self {
        Self {
            file: file.to_owned(),
            sha256: sha256_hex(contents),
        }
    }

    /// Whether `contents` are the file's.
    ///
    /// # Errors
    /// [`RuntimeError::HashMismatch`].
    pub fn verify(&self, contents: &[u8]) -> Result<(), RuntimeError> {
        let got = sha256_hex(contents);
        if got == self.sha256 {
            return Ok(());
        }
        Err(RuntimeError::HashMismatch {
            file: self.file.clone(),
            expected: self.sha256.clone(),
            got,
        })
    }
}

/// The error for a field that contradicts something else.
pub(crate) fn field(
    name: &'static str,
    expected: impl ToString,
    got: impl ToString,
) -> RuntimeError {
    RuntimeError::BundleField {
        field: name,
        expected: expected.to_string(),
        got: got.to_string(),
    }
}

/// Looks at `format` and `version` alone, so that a file of a later version is refused for its
/// version and not for the first field that changed.
fn check_version(json: &[u8]) -> Result<(), RuntimeError> {
    #[derive(Deserialize)]
    struct Header {
        format: String,
        version: u32,
    }
    let header: Header = parse(json)?;
    let checks = [
        ("format", BUNDLE_FORMAT.to_owned(), header.format),
        (
            "version",
            BUNDLE_VERSION.to_string(),
            header.version.to_string(),
        ),
    ];
    for (field, expected, got) in checks {
        if expected != got {
            return Err(RuntimeError::BundleVersion {
                field,
                expected,
                got,
            });
        }
    }
    Ok(())
}

fn parse<'a, T: Deserialize<'a>>(json: &'a [u8]) -> Result<T, RuntimeError> {
    serde_json::from_slice(json).map_err(|error| RuntimeError::BundleJson {
        reason: error.to_string(),
    })
}

fn sha256_hex(contents: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let hash = Sha256::digest(contents);
    let digits = hash.iter().flat_map(|byte| {
        [
            DIGITS[usize::from(byte >> 4)],
            DIGITS[usize::from(byte & 15)],
        ]
    });
    digits.map(char::from).collect()
}
