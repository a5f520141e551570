//! Frames as meshes: one OBJ file each.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use glam::Vec3;

/// A folder of meshes with the same triangles.
pub struct Meshes {
    folder: PathBuf,
    /// The lines of the triangles. OBJ counts from 1.
    faces: String,
}

impl Meshes {
    /// Makes the folder.
    pub fn new(folder: &Path, faces: &[[u32; 3]]) -> anyhow::Result<Self> {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let mut lines = String::new();
        for [a, b, c] in faces {
            // Writing to a string cannot fail.
            let _ = writeln!(lines, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        Ok(Self {
            folder: folder.to_owned(),
            faces: lines,
        })
    }

    /// Writes a frame of vertex positions in metres.
    pub fn write(&self, frame: usize, positions_m: &[Vec3]) -> anyhow::Result<()> {
        let mut text = String::with_capacity(positions_m.len() * 32 + self.faces.len());
        for Vec3 { x, y, z } in positions_m {
            let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
        }
        text.push_str(&self.faces);
        let path = self.folder.join(format!("frame-{frame:05}.obj"));
        Ok(dynaskin_files::replace(&path, text.as_bytes())?)
    }
}
