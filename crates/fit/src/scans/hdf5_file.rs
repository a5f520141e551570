//! HDF5 files with a data set for each sequence, as Dyna and D-FAUST come.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use dynaskin_body::BodyModel;
use dynaskin_hdf5::{Array, Hdf5, Hdf5Error, Kind, Listed};
use glam::Vec3;

use super::folder::check_faces;
use super::mesh::check_frame_count;
use crate::FitError;

/// What HDF5 files begin with, and where: MATLAB's have a block of text before it.
const MAGIC: [u8; 8] = *b"\x89HDF\r\n\x1a\n";
const MAGIC_AT: [u64; 4] = [0, 512, 1024, 2048];
/// Frames read at a time at most, however many a chunk holds.
const MAX_PIECE_FRAMES: usize = 1024;
/// Names that a list in a message has at most.
const MAX_NAMES: usize = 40;

/// A sequence of an HDF5 file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// Its data set.
    pub name: String,
    /// Lengths of the data set's axes.
    pub shape: Vec<usize>,
    /// Number of frames; none where it is of another mesh than the body's, or can be read in several ways.
    pub frame_count: Option<usize>,
    /// Whether it can be read in several ways.
    pub is_ambiguous: bool,
}

impl Sequence {
    fn new(listed: Listed, vertex_count: usize) -> Self {
        let frames = layout(&listed.shape, vertex_count);
        Self {
            is_ambiguous: frames == Err(Trouble::Ambiguous),
            frame_count: frames.ok().map(|layout| listed.shape[layout.frame]),
            name: listed.name,
            shape: listed.shape,
        }
    }
}

/// Whether a file is of HDF5, by its bytes or its name.
///
/// # Errors
/// [`FitError::Io`] where it cannot be opened.
pub fn is_hdf5(path: &Path) -> Result<bool, FitError> {
    let io = |source| FitError::Io {
        path: path.to_owned(),
        action: "opening",
        source,
    };
    let mut file = File::open(path).map_err(io)?;
    let mut begins = false;
    for at in MAGIC_AT {
        file.seek(SeekFrom::Start(at)).map_err(io)?;
        let mut bytes = Vec::new();
        let mut part = file.by_ref().take(MAGIC.len() as u64);
        part.read_to_end(&mut bytes).map_err(io)?;
        begins |= bytes == MAGIC;
    }
    let named = path.extension().is_some_and(|end| {
        ["h5", "hdf5", "hdf"]
            .iter()
            .any(|known| end.eq_ignore_ascii_case(known))
    });
    Ok(named || begins)
}

/// The sequences of an HDF5 file: data sets of floats with three axes, of which one is 3 long.
///
/// # Errors
/// [`FitError::Hdf5`], or [`FitError::NoSequences`] where there is none.
pub fn sequences(path: &Path, body: &BodyModel) -> Result<Vec<Sequence>, FitError> {
    let listed = Hdf5::open(path)?.list()?;
    let (found, others): (Vec<Listed>, Vec<Listed>) = listed.into_iter().partition(is_sequence);
    if found.is_empty() {
        let names = others
            .iter()
            .map(|one| format!("{} {:?} of {}", one.name, one.shape, one.elements));
        return Err(FitError::NoSequences {
            path: path.to_owned(),
            found: joined(names, others.len()),
        });
    }
    let vertices = body.vertex_count();
    Ok(found
        .into_iter()
        .map(|listed| Sequence::new(listed, vertices))
        .collect())
}

fn is_sequence(listed: &Listed) -> bool {
    matches!(listed.kind, Kind::Single | Kind::Double)
        && listed.shape.len() == 3
        && listed.shape.contains(&3)
}

fn joined(names: impl Iterator<Item = String>, count: usize) -> String {
    let mut text = names.take(MAX_NAMES).collect::<Vec<_>>().join(", ");
    if count > MAX_NAMES {
        text.push_str(&format!(" and {} more", count - MAX_NAMES));
    }
    if text.is_empty() {
        text.push_str("nothing");
    }
    text
}

/// A sequence that is open.
pub(super) struct Opened {
    /// The file and the data set, for messages.
    pub place: PathBuf,
    pub frames: Hdf5Frames,
    pub notes: Vec<String>,
    /// Meaning of the axes.
    pub axes: String,
    pub doubts: Vec<String>,
}

/// Opens the sequence of that name, or the only one.
pub(super) fn open(path: &Path, body: &BodyModel, name: Option<&str>) -> Result<Opened, FitError> {
    let file = Hdf5::open(path)?;
    let name = match name {
        Some(name) => name.to_owned(),
        None => only(path, body)?,
    };
    let array = file.array(&name).map_err(|error| match error {
        Hdf5Error::Missing { .. } => missing(path, body, &name),
        error => error.into(),
    })?;
    let place = PathBuf::from(format!("{}, data set `{name}`", path.display()));
    let vertices = body.vertex_count();
    let listed = array.listed();
    if listed.shape.len() == 3 && listed.shape.contains(&3) && !is_sequence(&listed) {
        return Err(FitError::Elements {
            path: place,
            elements: listed.elements,
        });
    }
    if !is_sequence(&listed) {
        return Err(FitError::NoLayout {
            path: place,
            shape: array.shape().to_vec(),
            vertices,
        });
    }
    let layout = layout(array.shape(), vertices).map_err(|trouble| match trouble {
        Trouble::Ambiguous => FitError::AmbiguousLayout {
            path: place.clone(),
            shape: array.shape().to_vec(),
        },
        Trouble::OtherMesh => FitError::NoLayout {
            path: place.clone(),
            shape: array.shape().to_vec(),
            vertices,
        },
    })?;
    let notes = vec![format!(
        "`{name}` is {:?}: {}",
        array.shape(),
        layout.words()
    )];
    check_frame_count(&place, array.shape()[layout.frame])?;
    let doubts = compare_faces(&file, path, &name, body)?;
    let frames = Hdf5Frames { array, layout };
    Ok(Opened {
        axes: layout.words(),
        place,
        frames,
        notes,
        doubts: doubts.into_iter().collect(),
    })
}

fn only(path: &Path, body: &BodyModel) -> Result<String, FitError> {
    let sequences = sequences(path, body)?;
    match sequences.as_slice() {
        [one] => Ok(one.name.clone()),
        several => Err(FitError::ChooseSequence {
            path: path.to_owned(),
            count: several.len(),
            names: names(several),
        }),
    }
}

fn names(sequences: &[Sequence]) -> String {
    joined(
        sequences.iter().map(|one| one.name.clone()),
        sequences.len(),
    )
}

fn missing(path: &Path, body: &BodyModel, name: &str) -> FitError {
    match sequences(path, body) {
        Ok(sequences) => FitError::MissingSequence {
            path: path.to_owned(),
            name: name.to_owned(),
            names: names(&sequences),
        },
        Err(error) => error,
    }
}

/// Which axis of a data set is which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    vertex: usize,
    xyz: usize,
    frame: usize,
}

impl Layout {
    fn words(self) -> String {
        let mut words = [""; 3];
        words[self.vertex] = "vertices";
        words[self.xyz] = "3";
        words[self.frame] = "frames";
        format!("[{}]", words.join(", "))
    }
}

#[derive(Debug, PartialEq, Eq)]
enum Trouble {
    Ambiguous,
    OtherMesh,
}

/// The only way in which a shape has the body's vertices and three coordinates.
fn layout(shape: &[usize], vertices: usize) -> Result<Layout, Trouble> {
    if shape.len() != 3 {
        return Err(Trouble::OtherMesh);
    }
    let mut found = Vec::new();
    for (vertex, xyz, frame) in [
        (0, 1, 2),
        (0, 2, 1),
        (1, 0, 2),
        (1, 2, 0),
        (2, 0, 1),
        (2, 1, 0),
    ] {
        if shape.get(vertex) == Some(&vertices) && shape.get(xyz) == Some(&3) {
            found.push(Layout { vertex, xyz, frame });
        }
    }
    match found.as_slice() {
        [one] => Ok(*one),
        [] => Err(Trouble::OtherMesh),
        _ => Err(Trouble::Ambiguous),
    }
}

/// Compares the data set `faces` beside a sequence with the body's, where there is one; gives a doubt where it
/// cannot be compared.
fn compare_faces(
    file: &Hdf5,
    path: &Path,
    sequence: &str,
    body: &BodyModel,
) -> Result<Option<String>, FitError> {
    let group = sequence.rsplit_once('/').map_or("", |(group, _)| group);
    let name = format!("{group}/faces");
    let name = name.trim_start_matches('/');
    let array = match file.array(name) {
        Ok(array) => array,
        Err(Hdf5Error::Missing { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let place = PathBuf::from(format!("{}, data set `{name}`", path.display()));
    let (across, count) = match *array.shape() {
        [count, 3] => (false, count),
        [3, count] => (true, count),
        _ => (false, 0),
    };
    // More than any mesh of these vertices has.
    if array.kind() != Kind::Integer || count == 0 || count > 8 * body.vertex_count() {
        return Ok(Some(format!(
            "`{name}` is no list of triangles of this mesh: the order of the vertices is not compared"
        )));
    }
    let all: Vec<Range<usize>> = array.shape().iter().map(|&length| 0..length).collect();
    let indices = array.integers(&all)?;
    let vertices = body.vertex_count() as i64;
    // MATLAB counts from 1.
    let is_from_1 = indices.iter().min() == Some(&1) && indices.iter().max() == Some(&vertices);
    let counted_from = i64::from(is_from_1);
    let is_vertex = |index: &i64| (counted_from..vertices + counted_from).contains(index);
    if let Some(index) = indices.iter().find(|index| !is_vertex(index)) {
        let problem = format!("a face names vertex {index}, the body has {vertices}");
        return Err(FitError::Faces {
            path: place,
            problem,
        });
    }
    let corner = |face: usize, corner: usize| {
        let at = if across {
            corner * count + face
        } else {
            3 * face + corner
        };
        let index = indices.get(at).copied().unwrap_or(-1);
        // One that is no vertex's has no edge of the body's.
        u32::try_from(index - counted_from).unwrap_or(u32::MAX)
    };
    let faces: Vec<Vec<u32>> = (0..count)
        .map(|face| (0..3).map(|at| corner(face, at)).collect())
        .collect();
    check_faces(&place, body, &faces)?;
    Ok(None)
}

/// The frames of a data set.
#[derive(Debug)]
pub(super) struct Hdf5Frames {
    array: Array,
    layout: Layout,
}

impl Hdf5Frames {
    pub fn frame_count(&self) -> usize {
        self.array.shape()[self.layout.frame]
    }

    /// Frames that a chunk of the file holds.
    pub fn piece_frames(&self) -> usize {
        let chunk = self.array.chunk();
        let frames = chunk.and_then(|chunk| chunk.get(self.layout.frame).copied());
        frames.unwrap_or(1).clamp(1, MAX_PIECE_FRAMES)
    }

    pub fn read(&self, frames: Range<usize>) -> Result<Vec<Vec3>, FitError> {
        let mut piece: Vec<Range<usize>> =
            self.array.shape().iter().map(|&length| 0..length).collect();
        piece[self.layout.frame] = frames.clone();
        let numbers = self.array.floats(&piece)?;
        let mut strides = [1; 3];
        for axis in (0..2).rev() {
            strides[axis] = strides[axis + 1] * piece[axis + 1].len();
        }
        let Layout { vertex, xyz, frame } = self.layout;
        let (vertices, step) = (piece[vertex].len(), strides[xyz]);
        let mut positions = Vec::with_capacity(frames.len() * vertices);
        for frame_index in 0..frames.len() {
            for vertex_index in 0..vertices {
                let at = frame_index * strides[frame] + vertex_index * strides[vertex];
                positions.push(Vec3::new(
                    numbers[at],
                    numbers[at + step],
                    numbers[at + 2 * step],
                ));
            }
        }
        Ok(positions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_told_apart_where_only_one_way_fits() {
        let axes = |shape: &[usize]| layout(shape, 100).map(Layout::words);
        assert_eq!(axes(&[100, 3, 7]).as_deref(), Ok("[vertices, 3, frames]"));
        assert_eq!(axes(&[7, 100, 3]).as_deref(), Ok("[frames, vertices, 3]"));
        assert_eq!(axes(&[3, 100, 7]).as_deref(), Ok("[3, vertices, frames]"));
        assert_eq!(axes(&[7, 3, 100]).as_deref(), Ok("[frames, 3, vertices]"));
        for shape in [[100, 3, 3], [3, 3, 100], [100, 3, 100]] {
            assert_eq!(axes(&shape), Err(Trouble::Ambiguous), "{shape:?}");
        }
        for shape in [&[99, 3, 7][..], &[100, 4, 7], &[100, 3], &[]] {
            assert_eq!(axes(shape), Err(Trouble::OtherMesh), "{shape:?}");
        }
    }
}
