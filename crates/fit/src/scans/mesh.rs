//! What a mesh file holds, and what a sequence of them may.

use std::path::Path;

use dynaskin_body::BodyModel;
use dynaskin_motion::MAX_CLIP_FRAMES;
use glam::Vec3;

use crate::FitError;

/// Most numbers of a sequence held in memory: 4 GB in single precision, 50,000 frames of SMPL.
pub(super) const MAX_NUMBERS: usize = 1 << 30;

/// Positions and faces of one file.
pub(super) struct Mesh {
    pub positions: Vec<Vec3>,
    /// Vertex indices of each face, of any number of corners; empty for bare points.
    pub faces: Vec<Vec<u32>>,
}

/// Refuses more frames than a motion may have.
pub(super) fn check_frame_count(path: &Path, frames: usize) -> Result<(), FitError> {
    if frames <= MAX_CLIP_FRAMES {
        return Ok(());
    }
    Err(FitError::TooLarge {
        path: path.to_owned(),
        got: format!("{frames} frames"),
        limit: format!("{MAX_CLIP_FRAMES} frames"),
    })
}

/// Refuses more frames than are held in memory.
pub(super) fn check_frames(path: &Path, frames: usize, vertices: usize) -> Result<(), FitError> {
    let limit = (MAX_NUMBERS / (3 * vertices.max(1))).min(MAX_CLIP_FRAMES);
    if frames <= limit {
        return Ok(());
    }
    Err(FitError::TooLarge {
        path: path.to_owned(),
        got: format!("{frames} frames"),
        limit: format!("{limit} frames"),
    })
}

/// The error for a mesh of `got` vertices.
pub(super) fn vertex_count(path: &Path, body: &BodyModel, got: usize) -> FitError {
    FitError::Topology {
        path: path.to_owned(),
        what: "the number of vertices",
        expected: body.vertex_count().to_string(),
        got: got.to_string(),
    }
}
