//! Where frames come from.

use std::ops::Range;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use glam::Vec3;

use super::folder::{self, MeshKind};
use super::hdf5_file::Hdf5Frames;
use crate::FitError;

/// Where frames come from, in the numbers of the file.
#[derive(Debug)]
pub(super) enum Source<'b> {
    /// All frames, `[frame][vertex]`.
    Memory(Vec<Vec3>),
    /// A mesh file for each frame.
    Folder {
        paths: Vec<PathBuf>,
        kind: MeshKind,
        body: &'b BodyModel,
    },
    /// A data set.
    Hdf5(Box<Hdf5Frames>),
}

impl<'b> Source<'b> {
    /// The frames of a folder, and doubts about them.
    pub fn folder(path: &Path, body: &'b BodyModel) -> Result<(Self, Vec<String>), FitError> {
        let (paths, kind) = folder::list(path)?;
        let doubts = folder::missing_frames(&paths).into_iter().collect();
        Ok((Self::Folder { paths, kind, body }, doubts))
    }

    pub fn frame_count(&self, vertex_count: usize) -> usize {
        match self {
            Self::Memory(positions) => positions.len() / vertex_count.max(1),
            Self::Folder { paths, .. } => paths.len(),
            Self::Hdf5(frames) => frames.frame_count(),
        }
    }

    /// Frames of which a file keeps several together.
    pub fn piece_frames(&self) -> usize {
        match self {
            Self::Memory(_) | Self::Folder { .. } => 1,
            Self::Hdf5(frames) => frames.piece_frames(),
        }
    }

    /// The positions of some frames, `[frame][vertex]`.
    pub fn read(&self, frames: Range<usize>, vertex_count: usize) -> Result<Vec<Vec3>, FitError> {
        match self {
            Self::Memory(positions) => {
                Ok(positions[frames.start * vertex_count..frames.end * vertex_count].to_vec())
            }
            Self::Folder { paths, kind, body } => {
                let mut positions = Vec::with_capacity(frames.len() * vertex_count);
                for path in &paths[frames] {
                    positions.extend(kind.positions(path, &folder::bytes(path)?, body)?);
                }
                Ok(positions)
            }
            Self::Hdf5(source) => source.read(frames),
        }
    }
}
