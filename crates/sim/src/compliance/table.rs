//! The compliance of many shapes as a file: `compliance.json` beside the clips.

use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_body::{BodyModel, SHAPE_COUNT};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{COMPLIANCE_COUNT, ComplianceError, compliance_m};
use crate::run::even_shape;
use crate::settings::SimSettings;

/// Changes when the numbers of a shape change, so that tables made before are made anew.
const VERSION: u32 = 2;
/// Shapes reach this much farther from the middle than the training shapes do.
const REACH: f32 = 1.5;
/// Shapes that are worked out between two writes of the file.
const CHUNK: usize = 32;

/// One shape and its compliance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComplianceRow {
    /// β in standard deviations.
    pub shape: [f32; SHAPE_COUNT],
    /// [`compliance_m`] in metres; none where the tissue of the shape finds no rest.
    pub metres: Option<Vec<f32>>,
}

/// The compliance of many shapes of one body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComplianceTable {
    version: u32,
    /// SHA-256 of the body GLB, lower-case hex.
    pub body_sha256: String,
    /// What it was worked out with.
    pub settings: SimSettings,
    /// The shapes.
    pub rows: Vec<ComplianceRow>,
}

/// Why a table could not be made or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file system refused.
    #[error("{path}: {action} failed: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The cause.
        source: std::io::Error,
    },
    /// Not such a file, or one that contradicts itself.
    #[error("{path} is no table of compliances ({reason}); delete it and simulate again")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// It was made for another body.
    #[error("{path} was made with another body; give each body a folder of its own")]
    OtherBody {
        /// The file.
        path: PathBuf,
    },
    /// A shape's compliance is not known.
    #[error(transparent)]
    Compliance(#[from] ComplianceError),
}

impl ComplianceTable {
    /// Name of the file in a folder of clips.
    pub const FILE_NAME: &str = "compliance.json";

    /// A table of these rows.
    pub fn new(body_sha256: &str, settings: SimSettings, rows: Vec<ComplianceRow>) -> Self {
        Self {
            version: VERSION,
            body_sha256: body_sha256.to_owned(),
            settings,
            rows,
        }
    }

    /// The shape of row `index`: each coefficient by itself and evenly over 1.5 times the range of the
    /// training shapes. Depends on nothing but `index`.
    pub fn shape(index: usize) -> [f32; SHAPE_COUNT] {
        even_shape("compliance shape", index, REACH)
    }

    /// Works out the compliance of `count` shapes on rayon's current pool and writes the table into
    /// `folder`, again and again as it grows; rows that a table there has already are kept. `done` is told
    /// the number of rows that are there so far.
    ///
    /// # Errors
    /// [`TableError`]; what was written before stays.
    pub fn make(
        body: &BodyModel,
        body_sha256: &str,
        settings: &SimSettings,
        folder: &Path,
        count: usize,
        done: impl Fn(usize),
    ) -> Result<Self, TableError> {
        let mut table = match Self::read(folder, body_sha256) {
            Ok(Some(table)) if table.settings == *settings => table,
            Ok(_) => Self::new(body_sha256, settings.clone(), Vec::new()),
            Err(error) => return Err(error),
        };
        let path = folder.join(Self::FILE_NAME);
        fs::create_dir_all(folder).map_err(io(&path, "making its folder"))?;
        done(table.rows.len());
        while table.rows.len() < count {
            let first = table.rows.len();
            let rows = (first..count.min(first + CHUNK)).into_par_iter();
            let rows = rows.map(|index| {
                let shape = Self::shape(index);
                match compliance_m(body, &shape, settings) {
                    Ok(metres) => Ok(Some(metres)),
                    Err(ComplianceError::NoRest { .. }) => Ok(None),
                    Err(error) => Err(error),
                }
                .map(|metres| ComplianceRow { shape, metres })
            });
            table.rows.extend(rows.collect::<Result<Vec<_>, _>>()?);
            table.write(&path)?;
            done(table.rows.len());
        }
        Ok(table)
    }

    /// The table in a folder of clips of the body with this SHA-256; none if there is none, or one of
    /// another version.
    ///
    /// # Errors
    /// [`TableError::Io`], [`TableError::Malformed`], [`TableError::OtherBody`].
    pub fn read(folder: &Path, body_sha256: &str) -> Result<Option<Self>, TableError> {
        let path = folder.join(Self::FILE_NAME);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io(&path, "reading")(error)),
        };
        let malformed = |reason: String| TableError::Malformed {
            path: path.clone(),
            reason,
        };
        let table: Self = serde_json::from_str(&text).map_err(|e| malformed(e.to_string()))?;
        if table.version != VERSION {
            return Ok(None);
        }
        if table.body_sha256 != body_sha256 {
            return Err(TableError::OtherBody { path });
        }
        for (index, row) in table.rows.iter().enumerate() {
            let Some(metres) = &row.metres else { continue };
            let good = metres.iter().all(|m| m.is_finite() && *m >= 0.0);
            if metres.len() != COMPLIANCE_COUNT || !good {
                return Err(malformed(format!(
                    "row {index} should have {COMPLIANCE_COUNT} lengths"
                )));
            }
        }
        Ok(Some(table))
    }

    /// Writes the file whole or not at all.
    fn write(&self, path: &Path) -> Result<(), TableError> {
        let text = serde_json::to_string(self).map_err(|error| TableError::Malformed {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
        dynaskin_files::replace(path, text.as_bytes()).map_err(|error| TableError::Io {
            path: error.path,
            action: error.action,
            source: error.source,
        })
    }
}

fn io<'a>(path: &'a Path, action: &'static str) -> impl Fn(std::io::Error) -> TableError + 'a {
    move |source| TableError::Io {
        path: path.to_owned(),
        action,
        source,
    }
}
