//! `bundle.json`: the files of a model, and checks that they belong together.

use dynaskin_body::{SHAPE_COUNT, Trait};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use crate::RuntimeError;
use crate::features::{FeatureKind, GUEST_KINDS};

/// The only `format` there is.
pub const BUNDLE_FORMAT: &str = "dynaskin-bundle";

/// The `version` that is written. Version 1, which does not state the ranges of the training data, is read
/// as well.
pub const BUNDLE_VERSION: u32 = 2;

/// Stiffness and damping factors that networks of version 1 with materials among their features
/// learned from.
const LEARNED_IN_VERSION_1: [[f32; 2]; 2] = [[0.5, 2.0], [0.625, 1.6]];

/// A file beside `bundle.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BundleFile {
    /// File name without folders.
    pub file: String,
    /// SHA-256 of the file, 64 lower-case hexadecimal digits.
    pub sha256: String,
}

/// The networks of a bundle as lowered files, for cores without tract.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoweredFiles {
    /// The predictor.
    pub predictor: BundleFile,
    /// The decoder.
    pub decoder: BundleFile,
}

/// Ranges of the training data: least and greatest values in the clips. Beyond them networks
/// extrapolate, so the runtime clamps stiffness and damping to them before the networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Learned {
    /// Factor on the tissue's stiffness; 1 to 1 for networks without materials among their features.
    pub stiffness: [f32; 2],
    /// Factor on its damping ratio; likewise.
    pub damping: [f32; 2],
    /// Each shape coefficient, in standard deviations; none if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<[[f32; 2]; SHAPE_COUNT]>,
}

impl Learned {
    /// The usual tissue alone, and shapes that are not known.
    pub const USUAL: Self = Self {
        stiffness: [1.0, 1.0],
        damping: [1.0, 1.0],
        shape: None,
    };

    /// What a bundle of version 1 means.
    pub(crate) fn in_version_1(kind: FeatureKind) -> Self {
        if !kind.has_materials() {
            return Self::USUAL;
        }
        let [stiffness, damping] = LEARNED_IN_VERSION_1;
        Self {
            stiffness,
            damping,
            shape: None,
        }
    }

    fn check(&self, kind: FeatureKind) -> Result<(), RuntimeError> {
        let got = |range: &[f32; 2]| format!("{} to {}", range[0], range[1]);
        for (name, range) in [
            ("learned.stiffness", &self.stiffness),
            ("learned.damping", &self.damping),
        ] {
            // NaN is in no order.
            if !(range[0] > 0.0 && range[0] <= range[1] && range[1].is_finite()) {
                let expected = "factors above 0, the least first";
                return Err(field(name, expected, got(range)));
            }
            if !kind.has_materials() && *range != [1.0, 1.0] {
                let expected = "1 to 1, because the features have no materials";
                return Err(field(name, expected, got(range)));
            }
        }
        let ordered = |r: &&[f32; 2]| r[0].is_finite() && r[1].is_finite() && r[0] <= r[1];
        match self.shape.iter().flatten().find(|range| !ordered(range)) {
            Some(range) => Err(field(
                "learned.shape",
                "numbers, the least first",
                got(range),
            )),
            None => Ok(()),
        }
    }
}

/// The contents of `bundle.json` (docs/design/bundle.md).
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
    /// The same networks, lowered; none if `dynaskin slim` has not written them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lowered: Option<LoweredFiles>,
    /// What the predictor takes as input.
    pub feature_kind: FeatureKind,
    /// F: the predictor's number of features.
    pub feature_count: usize,
    /// L: the predictor's outputs and the decoder's inputs.
    pub latent_count: usize,
    /// What the networks learned from.
    #[serde(default = "unknown")]
    pub learned: Learned,
    /// The body's measures, for shapes given by measures ([`dynaskin_body::Figures`]); empty if
    /// unknown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traits: Vec<Trait>,
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
    /// Reads `bundle.json` and checks everything that can be checked without its files.
    ///
    /// # Errors
    /// [`RuntimeError::BundleJson`], [`RuntimeError::BundleVersion`], [`RuntimeError::BundleField`]
    /// for a rate other than 60 Hz, a feature count other than the kind's, file names with folders
    /// in them, invalid ranges, and vertices that are not ascending; [`RuntimeError::LeftOut`]
    /// for features of a compared method in a build without the feature `guests`.
    pub fn from_json(json: &[u8]) -> Result<Self, RuntimeError> {
        let version = check_version(json)?;
        let mut bundle: Self = parse(json)?;
        if version == 1 {
            bundle.learned = Learned::in_version_1(bundle.feature_kind);
            bundle.version = BUNDLE_VERSION;
        }
        bundle.check()?;
        Ok(bundle)
    }

    /// As JSON, for writing.
    ///
    /// # Errors
    /// [`RuntimeError::BundleJson`] if a number is not finite.
    pub fn to_json(&self) -> Result<String, RuntimeError> {
        serde_json::to_string_pretty(self).map_err(|error| RuntimeError::BundleJson {
            reason: error.to_string(),
        })
    }

    /// Whether the fields fit each other.
    pub(crate) fn check(&self) -> Result<(), RuntimeError> {
        if (self.rate_hz - dynaskin_skeleton::MODEL_RATE_HZ).abs() > 1e-9 {
            return Err(field("rate_hz", "60", self.rate_hz));
        }
        let features = self.feature_kind.count();
        if self.feature_count != features {
            return Err(field("feature_count", features, self.feature_count));
        }
        self.learned.check(self.feature_kind)?;
        if let Some(odd) = self.traits.iter().find(|known| !known.is_sound()) {
            let expected = "finite numbers, and ranges with the least value first";
            return Err(field(
                "traits",
                expected,
                format!("others in {:?}", odd.name),
            ));
        }
        let lowered = self
            .lowered
            .iter()
            .flat_map(|files| [&files.predictor, &files.decoder]);
        for file in [&self.body, &self.predictor, &self.decoder]
            .into_iter()
            .chain(lowered)
        {
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

    /// Checks that `contents` have the file's hash.
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
/// version and not for the first field that changed. Gives the version.
fn check_version(json: &[u8]) -> Result<u32, RuntimeError> {
    #[derive(Deserialize)]
    struct Header {
        format: String,
        version: u32,
        #[serde(default)]
        feature_kind: String,
        learned: Option<IgnoredAny>,
    }
    let header: Header = parse(json)?;
    let refused = |field, expected: &str, got: String| {
        Err(RuntimeError::BundleVersion {
            field,
            expected: expected.to_owned(),
            got,
        })
    };
    if header.format != BUNDLE_FORMAT {
        return refused("format", BUNDLE_FORMAT, header.format);
    }
    if !(1..=BUNDLE_VERSION).contains(&header.version) {
        return refused("version", "1 or 2", header.version.to_string());
    }
    if header.version > 1 && header.learned.is_none() {
        return Err(RuntimeError::BundleJson {
            reason: "missing field `learned`".to_owned(),
        });
    }
    if !cfg!(feature = "guests") && GUEST_KINDS.contains(&header.feature_kind.as_str()) {
        return Err(RuntimeError::LeftOut {
            place: "bundle.json".to_owned(),
            needs: format!("features of the kind `{}`", header.feature_kind),
        });
    }
    Ok(header.version)
}

/// Replaced, or refused, right after parsing.
const fn unknown() -> Learned {
    Learned::USUAL
}

fn parse<'a, T: Deserialize<'a>>(json: &'a [u8]) -> Result<T, RuntimeError> {
    serde_json::from_slice(json).map_err(|error| RuntimeError::BundleJson {
        reason: match json.trim_ascii_start().first() {
            None => "it is empty".to_owned(),
            // What many servers answer where no file is.
            Some(b'<') => "it is a web page".to_owned(),
            Some(b'{') => error.to_string(),
            Some(_) => "it is another kind of file".to_owned(),
        },
    })
}

fn sha256_hex(contents: &[u8]) -> String {
    hex(Sha256::digest(contents).as_slice())
}

/// As lower-case hexadecimal digits.
pub(crate) fn hex(hash: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digits = hash.iter().flat_map(|byte| {
        [
            DIGITS[usize::from(byte >> 4)],
            DIGITS[usize::from(byte & 15)],
        ]
    });
    digits.map(char::from).collect()
}
