//! Writing a clip file: under a temporary name, then renamed, so that a kill leaves no half file.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use dynaskin_body::REGION_COUNT;
use serde_json::{Value, json};

use super::{ClipData, DatasetError, FORMAT, VERSION};
use crate::materials::can_be_simulated;

impl ClipData {
    /// Writes the clip to `path`; the same clip gives the same bytes.
    ///
    /// # Errors
    /// [`DatasetError::Inconsistent`] if lengths contradict each other or a number is not finite,
    /// [`DatasetError::Io`] if the file cannot be written; `path` is then as it was before.
    pub fn write(&self, path: &Path) -> Result<(), DatasetError> {
        self.check()?;
        let temporary = temporary_path(path);
        let io = |action| {
            let path = temporary.clone();
            move |source| DatasetError::Io {
                path,
                action,
                source,
            }
        };
        let bytes = self.to_bytes();
        let result = fs::File::create(&temporary)
            .map_err(io("creating"))
            .and_then(|mut file| {
                file.write_all(&bytes).map_err(io("writing"))?;
                file.sync_all().map_err(io("writing"))
            })
            .and_then(|()| fs::rename(&temporary, path).map_err(io("renaming")));
        if result.is_err() {
            // Nothing more can be done if even this fails; the first error is the one to tell.
            let _ = fs::remove_file(&temporary);
        }
        result
    }

    fn check(&self) -> Result<(), DatasetError> {
        let fail = |reason: String| {
            Err(DatasetError::Inconsistent {
                name: self.name.clone(),
                reason,
            })
        };
        if self.poses.is_empty() {
            return fail("it has no frames".to_owned());
        }
        if !self.vertices.is_sorted_by(|a, b| a < b) || self.vertices.is_empty() {
            return fail("its vertices must be ascending and at least one".to_owned());
        }
        let expected = self.poses.len() * self.vertices.len() * 3;
        if self.offsets_rest_m.len() != expected {
            return fail(format!(
                "{} offset numbers for {} frames of {} vertices, expected {expected}",
                self.offsets_rest_m.len(),
                self.poses.len(),
                self.vertices.len()
            ));
        }
        if !self.offsets_rest_m.iter().all(|x| x.is_finite()) {
            return fail("an offset is not finite".to_owned());
        }
        if !self.poses.iter().all(|pose| pose.is_valid()) {
            return fail("a pose is not finite or has no unit quaternions".to_owned());
        }
        if !can_be_simulated(&self.materials) {
            return fail(format!(
                "a material multiplier lies outside {:?}",
                crate::MULTIPLIERS
            ));
        }
        if !self.shape.iter().all(|beta| beta.is_finite()) {
            return fail("a shape coefficient is not finite".to_owned());
        }
        Ok(())
    }

    /// The file's bytes. The header is written here and not by the safetensors library, whose
    /// metadata come out in random order: the same clip would give different bytes each run.
    fn to_bytes(&self) -> Vec<u8> {
        let (frames, vertices) = (self.poses.len(), self.vertices.len());
        let mut data = Vec::new();
        let mut header = BTreeMap::new();
        // Largest type first: every tensor then starts at a multiple of its number's size.
        let mut push = |name: &str, dtype: &str, shape: Value, bytes: Vec<u8>| {
            let begin = data.len();
            data.extend_from_slice(&bytes);
            let entry =
                json!({"dtype": dtype, "shape": shape, "data_offsets": [begin, data.len()]});
            header.insert(name.to_owned(), entry);
        };
        let translations = self
            .poses
            .iter()
            .flat_map(|p| p.root_translation_m.to_array());
        push(
            "root_translation_m",
            "F64",
            json!([frames, 3]),
            f64_bytes(translations),
        );
        let rotations = self
            .poses
            .iter()
            .flat_map(|pose| pose.parent_from_joint.iter().flat_map(|q| q.to_array()));
        push(
            "parent_from_joint",
            "F64",
            json!([frames, 24, 4]),
            f64_bytes(rotations),
        );
        let shape = self.shape.iter().flat_map(|x| x.to_le_bytes()).collect();
        push("shape", "F32", json!([self.shape.len()]), shape);
        let materials = self
            .materials
            .stiffness
            .iter()
            .chain(&self.materials.damping);
        push(
            "materials",
            "F32",
            json!([2, REGION_COUNT]),
            materials.flat_map(|x| x.to_le_bytes()).collect(),
        );
        let indices = self.vertices.iter().flat_map(|x| x.to_le_bytes()).collect();
        push("vertices", "U32", json!([vertices]), indices);
        let offsets = self
            .offsets_rest_m
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        push("offsets_m", "F16", json!([frames, vertices, 3]), offsets);
        header.insert("__metadata__".to_owned(), self.metadata());

        let mut text = json!(header).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(8), b' ');
        let mut bytes = Vec::with_capacity(8 + text.len() + data.len());
        bytes.extend_from_slice(&(text.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&text);
        bytes.extend_from_slice(&data);
        bytes
    }

    fn metadata(&self) -> Value {
        json!({
            "format": FORMAT,
            "version": VERSION,
            "name": self.name,
            "body_sha256": self.body_sha256,
            "rate_hz": self.rate_hz.to_string(),
            "seed": self.seed.to_string(),
            "sim": self.sim_json,
        })
    }
}

/// A sibling of `path`, so that the rename stays within one file system.
fn temporary_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

fn f64_bytes(numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    numbers.flat_map(f64::to_le_bytes).collect()
}
