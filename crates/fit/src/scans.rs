//! Mesh sequences of the body's topology: from an HDF5 or `.npz` file, or a folder of OBJ or PLY files.

mod folder;
mod found;
mod hdf5_file;
mod mesh;
mod npz_file;
mod obj_file;
mod ply_file;
mod source;

use std::ops::Range;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use dynaskin_motion::UpAxis;
use glam::{Quat, Vec3};

use crate::FitError;
pub use folder::MeshKind;
pub(crate) use folder::is_hidden;
pub use hdf5_file::{Sequence, is_hdf5, sequences};
use source::Source;

/// Diagonal of a bounding box that a crouching child or a reaching giant can have, in metres.
const SIZES_M: std::ops::RangeInclusive<f32> = 0.5..=4.0;
/// Frames that are read at a time where nothing is done with them but to check them.
const CHECKED_FRAMES: usize = 128;
/// Smaller than any error of a scan, in metres.
const COLLAPSED_M: f32 = 1e-6;
/// Farther from the body than any stray vertex that still says something, in metres.
const FAR_AWAY_M: f32 = 10.0;

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

    /// Name of the unit, such as `metres`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Centimetre => "centimetres",
            Self::Millimetre => "millimetres",
        }
    }
}

/// How to read the numbers of scans.
#[derive(Clone, Debug)]
pub struct ScanOptions {
    /// Unit of length; none detects the one in which the first frame is as large as a body.
    pub unit: Option<ScanUnit>,
    /// Up axis; none detects the one along which the trunk stands in the first frame.
    pub up: Option<UpAxis>,
    /// Frames per second, 1 to 1000.
    pub rate_hz: f64,
    /// Key of the vertices, `[frame][vertex][xyz]`, in an `.npz` file.
    pub key: String,
    /// Data set of the sequence in an HDF5 file; none takes the only one.
    pub sequence: Option<String>,
}

/// A sequence of meshes in metres, +Y up, with the vertices of a body. Frames of HDF5 files and of folders
/// are read when they are asked for; an `.npz` file is read as a whole.
#[derive(Debug)]
pub struct Scans<'b> {
    /// Where they come from, for messages: the file or folder, and its data set.
    pub path: PathBuf,
    /// Frames per second.
    pub rate_hz: f64,
    /// Vertices of each frame.
    pub vertex_count: usize,
    /// Unit of the numbers, as given or found.
    pub unit: ScanUnit,
    /// Axis of the numbers that points up, as given or found.
    pub up: UpAxis,
    /// Meaning of the axes of a data set of an HDF5 file, such as `[vertices, 3, frames]`; none for other files.
    pub axes: Option<String>,
    /// What was detected and not given, for people to check.
    pub notes: Vec<String>,
    /// What may be wrong without being refused, such as frames that are missing.
    pub doubts: Vec<String>,
    y_up_from_world: Quat,
    /// Read several times, and by whoever opens scans.
    first_m: Vec<Vec3>,
    source: Source<'b>,
}

impl<'b> Scans<'b> {
    /// Opens an HDF5 or `.npz` file, or a folder with one OBJ or PLY file a frame, sorted by name, and reads
    /// the first frame.
    ///
    /// # Errors
    /// [`FitError`] naming the file and place: unreadable, another topology than `body`'s, a
    /// position that is not finite, a size that no body has, nothing there, or too much; a unit or an axis
    /// that cannot be found, and an HDF5 file of several sequences of which none is named.
    pub fn open(path: &Path, body: &'b BodyModel, options: &ScanOptions) -> Result<Self, FitError> {
        check_rate(options.rate_hz)?;
        if !path.is_dir() && is_hdf5(path)? {
            let opened = hdf5_file::open(path, body, options.sequence.as_deref())?;
            let source = Source::Hdf5(Box::new(opened.frames));
            let mut scans = Self::from_source(opened.place, body, source, options, opened.notes)?;
            scans.doubts = opened.doubts;
            scans.axes = Some(opened.axes);
            return Ok(scans);
        }
        if let Some(sequence) = &options.sequence {
            return Err(FitError::Parameter {
                name: "--sequence",
                got: sequence.clone(),
                expected: "none: only HDF5 files have sequences to choose from",
            });
        }
        let (source, doubts) = if path.is_dir() {
            Source::folder(path, body)?
        } else {
            let positions = npz_file::read(path, body, &options.key)?;
            (Source::Memory(positions), Vec::new())
        };
        let mut scans = Self::from_source(path.to_owned(), body, source, options, Vec::new())?;
        scans.doubts = doubts;
        Ok(scans)
    }

    /// Scans from positions `[frame][vertex]` in the options' unit and axes. `path` only names them
    /// in messages.
    ///
    /// # Errors
    /// As [`Scans::open`] and [`Scans::check`].
    pub fn new(
        path: &Path,
        body: &'b BodyModel,
        positions: Vec<Vec3>,
        options: &ScanOptions,
    ) -> Result<Self, FitError> {
        check_rate(options.rate_hz)?;
        let vertex_count = body.vertex_count();
        if !positions.len().is_multiple_of(vertex_count) {
            return Err(FitError::Topology {
                path: path.to_owned(),
                what: "the number of vertices",
                expected: format!("{vertex_count} a frame"),
                got: format!("{} in all", positions.len()),
            });
        }
        let source = Source::Memory(positions);
        let scans = Self::from_source(path.to_owned(), body, source, options, Vec::new())?;
        scans.check(|_| ())?;
        Ok(scans)
    }

    fn from_source(
        path: PathBuf,
        body: &'b BodyModel,
        source: Source<'b>,
        options: &ScanOptions,
        mut notes: Vec<String>,
    ) -> Result<Self, FitError> {
        let vertex_count = body.vertex_count();
        if source.frame_count(vertex_count) == 0 {
            return Err(FitError::NoFrames { path });
        }
        let first = source.read(0..1, vertex_count)?;
        // Before the unit is looked for in what is no number.
        check_finite(&path, 0, &first)?;
        let unit = match options.unit {
            Some(unit) => unit,
            None => found::unit(&path, body, &first, &mut notes)?,
        };
        let up = match options.up {
            Some(up) => up,
            None => found::up(&path, body, &first, &mut notes)?,
        };
        let mut scans = Self {
            path,
            rate_hz: options.rate_hz,
            vertex_count,
            unit,
            up,
            axes: None,
            notes,
            doubts: Vec::new(),
            y_up_from_world: up.y_up_from_world().as_quat(),
            first_m: Vec::new(),
            source,
        };
        let mut first_m = first;
        scans.finish_frame(0, &mut first_m)?;
        found::not_mirrored(&scans.path, body, &first_m)?;
        scans.first_m = first_m;
        Ok(scans)
    }

    /// Number of frames, at least 1.
    pub fn frame_count(&self) -> usize {
        self.source.frame_count(self.vertex_count)
    }

    /// Frames that are read at once best, at least `least`: a file that is stored in pieces of several frames
    /// unpacks each piece as a whole.
    pub(crate) fn batch_frames(&self, least: usize) -> usize {
        least.max(self.source.piece_frames())
    }

    /// The vertices `[frame][vertex]` of some frames, in metres.
    ///
    /// # Errors
    /// [`FitError`] naming file, frame and vertex: unreadable, not finite, or of a size that no body has.
    ///
    /// # Panics
    /// If the frames are not within [`Self::frame_count`].
    pub fn frames_m(&self, frames: Range<usize>) -> Result<Vec<Vec3>, FitError> {
        if frames == (0..1) {
            return Ok(self.first_m.clone());
        }
        let mut positions = self.source.read(frames.clone(), self.vertex_count)?;
        for (frame, positions) in frames.zip(positions.chunks_exact_mut(self.vertex_count)) {
            self.finish_frame(frame, positions)?;
        }
        Ok(positions)
    }

    /// Every `stride`-th frame from the first, in metres, `[frame][vertex]`. A piece of the file is unpacked once.
    ///
    /// # Errors
    /// As [`Self::frames_m`].
    pub(crate) fn every_nth_m(&self, stride: usize) -> Result<Vec<Vec<Vec3>>, FitError> {
        let (count, piece) = (self.frame_count(), self.batch_frames(1));
        let mut found = Vec::with_capacity(count.div_ceil(stride));
        let mut next = 0;
        while next < count {
            let end = count.min((next / piece + 1) * piece);
            let last = next + (end - 1 - next) / stride * stride;
            let positions = self.frames_m(next..last + 1)?;
            let frames = positions.chunks_exact(self.vertex_count).step_by(stride);
            found.extend(frames.map(<[Vec3]>::to_vec));
            next = last + stride;
        }
        Ok(found)
    }

    /// Reads all frames once, so that an unusable frame is found before any is fitted. `done` is
    /// called with the number of frames read so far.
    ///
    /// # Errors
    /// As [`Self::frames_m`].
    pub fn check(&self, mut done: impl FnMut(usize)) -> Result<(), FitError> {
        let (count, batch) = (self.frame_count(), self.batch_frames(CHECKED_FRAMES));
        for first in (0..count).step_by(batch) {
            let end = count.min(first + batch);
            self.frames_m(first..end)?;
            done(end);
        }
        Ok(())
    }

    /// Positions of a frame from the file's numbers, checked.
    fn finish_frame(&self, frame: usize, positions: &mut [Vec3]) -> Result<(), FitError> {
        let metres = self.unit.metres();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        check_finite(&self.path, frame, positions)?;
        for position in positions.iter_mut() {
            *position = self.y_up_from_world * (*position * metres);
            (low, high) = (low.min(*position), high.max(*position));
        }
        let size_m = low.distance(high);
        if size_m < COLLAPSED_M {
            let path = self.path.clone();
            return Err(FitError::Collapsed { path, frame });
        }
        let middle_m = median(positions);
        let far = (positions.iter().enumerate())
            .map(|(vertex, position)| (vertex, position.distance(middle_m)))
            // Of numbers whose squares are beyond all bounds the distance is infinite.
            .find(|(_, distance_m)| *distance_m > FAR_AWAY_M);
        // Where most are far from the middle the unit is wrong, not a vertex.
        let extent_m = median_extent_m(positions, middle_m);
        if let Some((vertex, distance_m)) = far
            && extent_m <= *SIZES_M.end()
        {
            return Err(FitError::FarAway {
                path: self.path.clone(),
                frame,
                vertex,
                distance_m,
            });
        }
        // A few stray vertices may widen the box; the fit bears them.
        if size_m < *SIZES_M.start() || extent_m > *SIZES_M.end() {
            return Err(FitError::Size {
                path: self.path.clone(),
                frame,
                size_m,
            });
        }
        Ok(())
    }
}

/// The median vertex.
fn median(positions: &[Vec3]) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|axis| {
        median_of(positions.iter().map(|p| p[axis]).collect())
    }))
}

/// Twice the median distance from the median vertex: a size that stray vertices do not change.
fn median_extent_m(positions_m: &[Vec3], middle_m: Vec3) -> f32 {
    2.0 * median_of(positions_m.iter().map(|p| p.distance(middle_m)).collect())
}

fn median_of(mut values: Vec<f32>) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

fn check_finite(path: &Path, frame: usize, positions: &[Vec3]) -> Result<(), FitError> {
    for (vertex, position) in positions.iter().enumerate() {
        if let Some(value) = position.to_array().into_iter().find(|x| !x.is_finite()) {
            return Err(FitError::NotFinite {
                path: path.to_owned(),
                frame,
                vertex,
                value,
            });
        }
    }
    Ok(())
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
