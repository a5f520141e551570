//! What a finished data set holds: its size and the largest offset of each region.

use std::fs;
use std::path::Path;

use dynaskin_body::{BodyModel, REGION_COUNT, Region};

use crate::dataset::{ClipData, ClipHeader, DatasetError};

/// The largest offset of a region in a data set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LargestOffset {
    /// Its length in metres.
    pub metres: f32,
    /// Clip in which it occurs.
    pub clip: String,
    /// Frame in that clip.
    pub frame: usize,
    /// Body vertex.
    pub vertex: u32,
}

/// Size and extremes of a data set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Number of clips.
    pub clips: usize,
    /// Number of clips whose materials are not the usual ones.
    pub varied_clips: usize,
    /// Number of frames.
    pub frames: usize,
    /// The largest offset among the vertices that are mostly of each region.
    pub largest: [LargestOffset; REGION_COUNT],
}

impl Survey {
    /// Reads all clips of a folder; `done` is called after each.
    ///
    /// # Errors
    /// [`DatasetError`] if the folder or a clip cannot be read.
    pub fn of_folder(
        body: &BodyModel,
        folder: &Path,
        done: impl Fn(usize, usize),
    ) -> Result<Self, DatasetError> {
        let io = |source| DatasetError::Io {
            path: folder.to_owned(),
            action: "listing",
            source,
        };
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            if path.extension().is_some_and(|end| end == "safetensors") {
                paths.push(path);
            }
        }
        paths.sort();
        let mut survey = Self::default();
        for (index, path) in paths.iter().enumerate() {
            survey.clips += 1;
            survey.varied_clips += usize::from(!ClipHeader::read(path)?.materials.is_nominal());
            survey.add(body, &ClipData::read(path)?);
            done(index + 1, paths.len());
        }
        Ok(survey)
    }

    fn add(&mut self, body: &BodyModel, clip: &ClipData) {
        self.frames += clip.frame_count();
        for (most, found) in self.largest.iter_mut().zip(largest_offsets(body, clip)) {
            if found.metres > most.metres {
                *most = found;
            }
        }
    }
}

/// The largest offset of each region in a clip, among the vertices that are mostly of the region.
pub fn largest_offsets(body: &BodyModel, clip: &ClipData) -> [LargestOffset; REGION_COUNT] {
    let mut largest: [LargestOffset; REGION_COUNT] = Default::default();
    for (slot, vertex) in clip.vertices.iter().enumerate() {
        let weight = |region: Region| body.region_weights[region as usize][*vertex as usize];
        let Some(region) = Region::ALL.into_iter().find(|region| weight(*region) > 0.5) else {
            continue;
        };
        let most = &mut largest[region as usize];
        for frame in 0..clip.frame_count() {
            let metres = clip.offset_rest_m(frame, slot).length();
            if metres > most.metres {
                *most = LargestOffset {
                    metres,
                    clip: clip.name.clone(),
                    frame,
                    vertex: *vertex,
                };
            }
        }
    }
    largest
}
