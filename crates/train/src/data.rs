//! A folder of simulated (or fitted) clips, and what training makes of it.

use std::fs;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use dynaskin_runtime::Learned;
use dynaskin_runtime::features::{FeatureKind, Materials, clip_features};
use dynaskin_sim::{ClipData, ClipHeader, ComplianceTable};
use sha2::{Digest as _, Sha256};

use crate::TrainError;
use crate::split::{ClipName, Set, Split};

/// A clip of a data set, not read yet.
#[derive(Clone, Debug)]
pub struct ClipEntry {
    /// Its file.
    pub path: PathBuf,
    /// Its name taken apart.
    pub name: ClipName,
    /// The set it belongs to.
    pub set: Set,
    /// Number of frames.
    pub frames: usize,
    /// Whether its tissue is the usual one everywhere.
    pub usual_tissue: bool,
}

/// Clips of which tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tissue {
    /// The usual one only: what networks without materials among their features can learn.
    Usual,
    /// Tissue with material multipliers only.
    Varied,
    /// Both.
    Any,
}

impl Tissue {
    /// The clips that networks with features of `kind` learn from.
    pub const fn known_to(kind: FeatureKind) -> Self {
        if kind.has_materials() {
            Self::Any
        } else {
            Self::Usual
        }
    }
}

/// A folder of clips of one body.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// The folder.
    pub dir: PathBuf,
    /// The clips, by file name.
    pub clips: Vec<ClipEntry>,
    /// Body vertices that have offsets, ascending.
    pub vertices: Vec<u32>,
    /// Simulator settings of the first clip, as JSON.
    pub sim_json: String,
    /// How far the tissue of some hundred shapes gives way, where the folder tells.
    pub compliance: Option<ComplianceTable>,
}

impl DataSet {
    /// Lists the clips of the folder `dir`, simulated on the body of SHA-256 `body_sha256`.
    ///
    /// # Errors
    /// [`TrainError::EmptyData`], [`TrainError::OtherBody`], [`TrainError::MixedVertices`],
    /// [`TrainError::ClipRate`], [`TrainError::ClipName`], [`TrainError::Clip`] and
    /// [`TrainError::Compliance`] for a damaged file, [`TrainError::Io`].
    pub fn open(dir: &Path, body_sha256: &str, split: &Split) -> Result<Self, TrainError> {
        let mut paths = Vec::new();
        for entry in fs::read_dir(dir).map_err(TrainError::io(dir, "listing"))? {
            let path = entry.map_err(TrainError::io(dir, "listing"))?.path();
            if path.extension().is_some_and(|e| e == "safetensors") {
                paths.push(path);
            }
        }
        paths.sort();
        let Some(first_path) = paths.first().cloned() else {
            return Err(TrainError::EmptyData {
                path: dir.to_owned(),
            });
        };
        let first = ClipData::read(&first_path)?;
        let mut clips = Vec::new();
        for path in paths {
            let header = ClipHeader::read(&path)?;
            if header.body_sha256 != body_sha256 {
                return Err(TrainError::OtherBody {
                    path,
                    expected: body_sha256.to_owned(),
                    got: header.body_sha256,
                });
            }
            if header.vertices != first.vertices {
                return Err(TrainError::MixedVertices {
                    path,
                    first: first_path,
                    expected: first.vertices.len(),
                    got: header.vertices.len(),
                });
            }
            clips.push(entry(path, &header, split)?);
        }
        Ok(Self {
            dir: dir.to_owned(),
            clips,
            vertices: first.vertices,
            sim_json: first.sim_json,
            compliance: ComplianceTable::read(dir, body_sha256)?,
        })
    }

    /// Puts every clip into its set by another split.
    pub fn split_by(&mut self, split: &Split) {
        for clip in &mut self.clips {
            clip.set = split.set_of(&clip.name);
        }
    }

    /// Whether the clips were simulated, and not fitted to captures.
    pub fn is_simulated(&self) -> bool {
        let settings: serde_json::Value = serde_json::from_str(&self.sim_json).unwrap_or_default();
        settings.as_object().is_some_and(|all| !all.is_empty())
    }

    /// What training depends on, in a few characters: clips, their lengths and sets, and vertices. A
    /// run goes on only with the data that it began with, or what is held out now may be known to it.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        for clip in &self.clips {
            let file = clip.path.file_name().unwrap_or_default().to_string_lossy();
            let tissue = if clip.usual_tissue { "usual" } else { "varied" };
            let set = clip.set.name();
            hash.update(format!("{file} {} {set} {tissue}\n", clip.frames));
        }
        for vertex in &self.vertices {
            hash.update(vertex.to_le_bytes());
        }
        let digest = hash.finalize();
        digest[..8]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// The clips of one set and some tissue.
    pub fn of_set(&self, set: Set, tissue: Tissue) -> impl Iterator<Item = &ClipEntry> {
        let fits = move |clip: &ClipEntry| match tissue {
            Tissue::Usual => clip.usual_tissue,
            Tissue::Varied => !clip.usual_tissue,
            Tissue::Any => true,
        };
        let of_set = self.clips.iter().filter(move |clip| clip.set == set);
        of_set.filter(move |clip| fits(clip))
    }

    /// Reads a clip and checks that it fits the others.
    ///
    /// # Errors
    /// [`TrainError::Clip`], [`TrainError::MixedVertices`].
    pub fn read(&self, entry: &ClipEntry) -> Result<ClipData, TrainError> {
        let clip = ClipData::read(&entry.path)?;
        if clip.vertices != self.vertices {
            return Err(TrainError::MixedVertices {
                path: entry.path.clone(),
                first: self.clips[0].path.clone(),
                expected: self.vertices.len(),
                got: clip.vertices.len(),
            });
        }
        Ok(clip)
    }

    /// The ranges of material and shape in the clips that networks with features of `kind` learn from.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn learned(&self, kind: FeatureKind) -> Result<Learned, TrainError> {
        let tissue = Tissue::known_to(kind);
        let mut learned = Learned::USUAL;
        for entry in self.of_set(Set::Training, tissue) {
            let clip = self.read(entry)?;
            for (range, factors) in [
                (&mut learned.stiffness, clip.materials.stiffness),
                (&mut learned.damping, clip.materials.damping),
            ] {
                factors.into_iter().for_each(|factor| widen(range, factor));
            }
            let ranges = learned
                .shape
                .get_or_insert(clip.shape.map(|beta| [beta; 2]));
            for (range, beta) in ranges.iter_mut().zip(clip.shape) {
                widen(range, beta);
            }
        }
        Ok(learned)
    }
}

/// Makes a range hold `value`.
fn widen([least, most]: &mut [f32; 2], value: f32) {
    (*least, *most) = (least.min(value), most.max(value));
}

fn entry(path: PathBuf, header: &ClipHeader, split: &Split) -> Result<ClipEntry, TrainError> {
    if (header.rate_hz - MODEL_RATE_HZ).abs() > 1e-6 * MODEL_RATE_HZ {
        return Err(TrainError::ClipRate {
            path,
            got_hz: header.rate_hz,
        });
    }
    let Some(name) = ClipName::parse(&header.name) else {
        return Err(TrainError::ClipName {
            path,
            name: header.name.clone(),
        });
    };
    Ok(ClipEntry {
        path,
        set: split.set_of(&name),
        name,
        frames: header.frame_count,
        usual_tissue: header.materials.is_nominal(),
    })
}

/// The poses of a clip as a motion.
pub fn motion_of(clip: &ClipData) -> Clip {
    Clip {
        name: clip.name.clone(),
        rate_hz: clip.rate_hz,
        frames: clip.poses.clone(),
    }
}

/// Features of a motion on the body `model` with shape and materials of `clip`, as the runtime
/// computes them.
///
/// # Errors
/// [`TrainError::Runtime`].
pub fn features_of(
    kind: FeatureKind,
    model: &BodyModel,
    motion: &Clip,
    clip: &ClipData,
) -> Result<Vec<f32>, TrainError> {
    let joints_rest_m = model.shaped(&clip.shape).joints_m;
    let materials = Materials {
        stiffness: clip.materials.stiffness,
        damping: clip.materials.damping,
    };
    Ok(clip_features(
        kind,
        &motion.frames,
        motion.rate_hz,
        &joints_rest_m,
        &clip.shape,
        &materials,
    )?)
}

/// Features of a clip's own poses, shape and materials on the body `model`.
///
/// # Errors
/// [`TrainError::Runtime`].
pub fn motion_features(
    kind: FeatureKind,
    model: &BodyModel,
    clip: &ClipData,
) -> Result<Vec<f32>, TrainError> {
    features_of(kind, model, &motion_of(clip), clip)
}

/// Offsets of a clip in single precision, `[frame][slot][xyz]` flat, in metres.
pub fn offsets_of(clip: &ClipData) -> Vec<f32> {
    clip.offsets_rest_m.iter().map(|x| x.to_f32()).collect()
}
