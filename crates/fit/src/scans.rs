//! Mesh sequences of the body's topology: from an `.npz` file or a folder of OBJ or PLY files.

mod folder;
mod mesh;
mod obj_file;
mod ply_file;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use dynaskin_motion::UpAxis;
use dynaskin_npz::Archive;
use glam::Vec3;

use crate::FitError;
use mesh::{MAX_NUMBERS, check_frames, vertex_count};

/// An unpacked array of double precision numbers of that count.
const MAX_ARRAY_BYTES: u64 = (MAX_NUMBERS as u64 * 8) + 4096;
/// Diagonal of a bounding box that a crouching child or a reaching giant can have, in metres.
const SIZES_M: std::ops::RangeInclusive<f32> = 0.5..=4.0;

/// Unit of a scan's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanUnit {
    /// Metres.
    Metre,
    /// Centimetres.
    Centimetre,
    /// Millimetres.
    Millimetre,
}

impl ScanUnit {
    /// Metres per unit.
    pub const fn metres(self) -> f32 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
        }
    }
}

/// How the numbers of scans are to be read.
#[derive(Clone, Debug)]
pub struct ScanOptions {
    /// Unit of length.
    pub unit: ScanUnit,
    /// Axis that points up; the body then faces +Z for [`UpAxis::Y`], -Y for [`UpAxis::Z`].
    pub up: UpAxis,
    /// Frames per second, 1 to 1000.
    pub rate_hz: f64,
    /// Key of the vertices, `[frame][vertex][xyz]`, in an `.npz` file.
    pub key: String,
}

/// A sequence of meshes in metres, +Y up, with the vertices of a body.
#[derive(Clone, Debug)]
pub struct Scans {
    /// Where they come from, for messages.
    pub path: PathBuf,
    /// Frames per second.
    pub rate_hz: f64,
    /// Vertices of each frame.
    pub vertex_count: usize,
    /// `[frame][vertex]` in metres.
    positions_m: Vec<Vec3>,
}

impl Scans {
    /// Reads an `.npz` file, or a folder with one OBJ or PLY file a frame, sorted by name.
    ///
    /// # Errors
    /// [`FitError`] naming the file and place: unreadable, another topology than `body`'s, a
    /// position that is not finite, a size that no body has, nothing there, or too much.
    pub fn read(path: &Path, body: &BodyModel, options: &ScanOptions) -> Result<Self, FitError> {
        check_rate(options.rate_hz)?;
        let positions = if path.is_dir() {
            folder::read(path, body)?
        } else {
            read_npz(path, body, &options.key)?
        };
        Self::new(path, body, positions, options)
    }

    /// Scans from positions `[frame][vertex]` in the options' unit and axes. `path` only names them
    /// in messages.
    ///
    /// # Errors
    /// As [`Scans::read`].
    pub fn new(
        path: &Path,
        body: &BodyModel,
        mut positions: Vec<Vec3>,
        options: &ScanOptions,
    ) -> Result<Self, FitError> {
        check_rate(options.rate_hz)?;
        let vertex_count = body.vertex_count();
        if positions.is_empty() {
            return Err(FitError::NoFrames);
        }
        if !positions.len().is_multiple_of(vertex_count) {
            return Err(FitError::Topology {
                path: path.to_owned(),
                what: "the number of vertices",
                expected: format!("{vertex_count} a frame"),
                got: format!("{} in all", positions.len()),
            });
        }
        let turn = options.up.y_up_from_world().as_quat();
        let metres = options.unit.metres();
        for (frame, positions) in positions.chunks_exact_mut(vertex_count).enumerate() {
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for (vertex, position) in positions.iter_mut().enumerate() {
                if let Some(value) = position.to_array().into_iter().find(|x| !x.is_finite()) {
                    return Err(FitError::NotFinite {
                        path: path.to_owned(),
                        frame,
                        vertex,
                        value,
                    });
                }
                *position = turn * (*position * metres);
                (low, high) = (low.min(*position), high.max(*position));
            }
            let size_m = low.distance(high);
            // A few stray vertices may widen the box; the fit bears them.
            if size_m < *SIZES_M.start() || median_extent_m(positions) > *SIZES_M.end() {
                return Err(FitError::Size {
                    path: path.to_owned(),
                    frame,
                    size_m,
                });
            }
        }
        Ok(Self {
            path: path.to_owned(),
            rate_hz: options.rate_hz,
            vertex_count,
            positions_m: positions,
        })
    }

    /// Number of frames, at least 1.
    pub fn frame_count(&self) -> usize {
        self.positions_m.len() / self.vertex_count
    }

    /// The vertices of a frame in metres.
    ///
    /// # Panics
    /// If `frame` is not below [`Self::frame_count`].
    pub fn frame_m(&self, frame: usize) -> &[Vec3] {
        &self.positions_m[frame * self.vertex_count..(frame + 1) * self.vertex_count]
    }
}

/// Twice the median distance from the median vertex: a size that stray vertices do not change.
fn median_extent_m(positions_m: &[Vec3]) -> f32 {
    let median = |values: &mut Vec<f32>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f32::total_cmp).1
    };
    let middle_m = Vec3::from_array(std::array::from_fn(|axis| {
        median(&mut positions_m.iter().map(|p| p[axis]).collect())
    }));
    2.0 * median(&mut positions_m.iter().map(|p| p.distance(middle_m)).collect())
}

fn check_rate(rate_hz: f64) -> Result<(), FitError> {
    if (1.0..=1000.0).contains(&rate_hz) {
        Ok(())
    } else {
        Err(FitError::Parameter {
            name: "the frame rate",
            got: format!("{rate_hz} Hz"),
            expected: "1 to 1000 Hz",
        })
    }
}

fn read_npz(path: &Path, body: &BodyModel, key: &str) -> Result<Vec<Vec3>, FitError> {
    let failed = |source| FitError::Npz {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(|source| FitError::Io {
        path: path.to_owned(),
        action: "opening",
        source,
    })?;
    let mut archive = Archive::open(BufReader::new(file), MAX_ARRAY_BYTES).map_err(failed)?;
    if !archive.has(key) {
        let found = archive.keys().join(", ");
        return Err(failed(dynaskin_npz::NpzError::array(
            key,
            "the vertices, [frames, vertices, 3] (name their key with --key)",
            format!("only {found}"),
        )));
    }
    // Before anything is unpacked.
    if let [frames, vertices, 3] = archive.shape(key).map_err(failed)?[..] {
        if vertices != body.vertex_count() {
            return Err(vertex_count(path, body, vertices));
        }
        check_frames(path, frames, vertices)?;
    }
    let shape = [None, Some(body.vertex_count()), Some(3)];
    let array = archive.floats_single(key, &shape).map_err(failed)?;
    Ok(array
        .into_c_order()
        .chunks_exact(3)
        .map(Vec3::from_slice)
        .collect())
}
