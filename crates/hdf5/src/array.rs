//! One data set.

use std::ops::Range;
use std::path::{Path, PathBuf};

use hdf5_reader::datatype_api::H5Type;
use hdf5_reader::{Dataset, Datatype, SliceInfo, SliceInfoElem};

use crate::error::told;
use crate::{Hdf5Error, Listed};

/// What the elements of a data set are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Floats of 32 bits.
    Single,
    /// Floats of 64 bits.
    Double,
    /// Integers of 8 to 64 bits.
    Integer,
    /// Something that this crate does not read: text, records, other floats.
    Other,
}

/// A data set of numbers.
#[derive(Clone)]
pub struct Array {
    path: PathBuf,
    name: String,
    shape: Vec<usize>,
    dataset: Dataset,
}

impl Array {
    pub(crate) fn new(path: &Path, name: &str, dataset: Dataset) -> Result<Self, Hdf5Error> {
        let shape: Result<Vec<usize>, _> = dataset
            .shape()
            .iter()
            .map(|&length| usize::try_from(length))
            .collect();
        let broken = |reason: String| Hdf5Error::Data {
            path: path.to_owned(),
            name: name.to_owned(),
            reason,
        };
        let shape = shape.map_err(|error| broken(format!("its shape: {error}")))?;
        let elements = shape.iter().try_fold(1_usize, |product, &length| {
            product.checked_mul(length.max(1))
        });
        if elements.is_none() {
            return Err(broken(format!("its shape {shape:?} is of no array")));
        }
        Ok(Self {
            path: path.to_owned(),
            name: name.to_owned(),
            shape,
            dataset,
        })
    }

    /// Its path in the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Length of each axis, the slowest first.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// What its elements are.
    pub fn kind(&self) -> Kind {
        match self.dataset.dtype() {
            Datatype::FloatingPoint { size: 4, .. } => Kind::Single,
            Datatype::FloatingPoint { size: 8, .. } => Kind::Double,
            Datatype::FixedPoint {
                size: 1 | 2 | 4 | 8,
                ..
            } => Kind::Integer,
            _ => Kind::Other,
        }
    }

    /// Length of a chunk along each axis, where the data set is stored in chunks. A chunk is unpacked as a
    /// whole, so pieces of whole chunks are read fastest.
    pub fn chunk(&self) -> Option<Vec<usize>> {
        let chunk = self.dataset.chunks()?;
        Some(chunk.iter().map(|&length| length as usize).collect())
    }

    /// The data set as [`Hdf5::list`](crate::Hdf5::list) lists it.
    pub fn listed(&self) -> Listed {
        Listed {
            name: self.name.clone(),
            shape: self.shape.clone(),
            kind: self.kind(),
            elements: kind_name(self.dataset.dtype()),
        }
    }

    /// The floats of a piece, one range for each axis, in single precision, the last axis fastest. NaN and
    /// infinity pass, for callers that can name the place.
    ///
    /// # Errors
    /// [`Hdf5Error::Data`] for another kind of elements, a range outside the shape, and data that cannot be
    /// read.
    pub fn floats(&self, piece: &[Range<usize>]) -> Result<Vec<f32>, Hdf5Error> {
        match self.kind() {
            Kind::Single => self.read::<f32>(piece),
            Kind::Double => {
                let numbers = self.read::<f64>(piece)?;
                Ok(numbers.into_iter().map(|number| number as f32).collect())
            }
            _ => Err(self.other_kind("floats of 32 or 64 bits")),
        }
    }

    /// The integers of a piece, as [`Self::floats`].
    ///
    /// # Errors
    /// As [`Self::floats`]; also for numbers beyond `i64`.
    pub fn integers(&self, piece: &[Range<usize>]) -> Result<Vec<i64>, Hdf5Error> {
        match *self.dataset.dtype() {
            Datatype::FixedPoint { size, signed, .. } => match (size, signed) {
                (1, true) => self.read_integers::<i8>(piece),
                (1, false) => self.read_integers::<u8>(piece),
                (2, true) => self.read_integers::<i16>(piece),
                (2, false) => self.read_integers::<u16>(piece),
                (4, true) => self.read_integers::<i32>(piece),
                (4, false) => self.read_integers::<u32>(piece),
                (8, true) => self.read_integers::<i64>(piece),
                (8, false) => self.read_integers::<u64>(piece),
                _ => Err(self.other_kind("integers of 8 to 64 bits")),
            },
            _ => Err(self.other_kind("integers of 8 to 64 bits")),
        }
    }

    fn read_integers<T: H5Type + TryInto<i64>>(
        &self,
        piece: &[Range<usize>],
    ) -> Result<Vec<i64>, Hdf5Error> {
        let numbers = self.read::<T>(piece)?.into_iter().map(TryInto::try_into);
        let numbers: Option<Vec<i64>> = numbers.map(Result::ok).collect();
        numbers.ok_or_else(|| self.broken("a number is above what 63 bits hold".to_owned()))
    }

    fn read<T: H5Type>(&self, piece: &[Range<usize>]) -> Result<Vec<T>, Hdf5Error> {
        let inside = piece.len() == self.shape.len()
            && piece
                .iter()
                .zip(&self.shape)
                .all(|(range, &length)| range.start <= range.end && range.end <= length);
        if !inside {
            return Err(self.broken(format!(
                "the piece {piece:?} is not within its shape {:?}",
                self.shape
            )));
        }
        let expected: usize = piece.iter().map(ExactSizeIterator::len).product();
        let selection = SliceInfo {
            selections: piece
                .iter()
                .map(|range| SliceInfoElem::Slice {
                    start: range.start as u64,
                    end: range.end as u64,
                    step: 1,
                })
                .collect(),
        };
        let array = self
            .dataset
            .read_slice::<T>(&selection)
            .map_err(|error| self.broken(told(&error)))?;
        let numbers: Vec<T> = array.into_iter().collect();
        if numbers.len() == expected {
            Ok(numbers)
        } else {
            let got = numbers.len();
            Err(self.broken(format!("{got} numbers where {expected} should be")))
        }
    }

    fn other_kind(&self, expected: &str) -> Hdf5Error {
        let kind = kind_name(self.dataset.dtype());
        self.broken(format!("its elements are {kind}, expected {expected}"))
    }

    fn broken(&self, reason: String) -> Hdf5Error {
        Hdf5Error::Data {
            path: self.path.clone(),
            name: self.name.clone(),
            reason,
        }
    }
}

/// What elements are, for people: `16-bit floats`.
fn kind_name(datatype: &Datatype) -> String {
    match datatype {
        Datatype::FloatingPoint { size, .. } => format!("{}-bit floats", 8 * u64::from(*size)),
        Datatype::FixedPoint { size, .. } => format!("{}-bit integers", 8 * u64::from(*size)),
        Datatype::String { .. } => "text".to_owned(),
        Datatype::Compound { .. } => "records".to_owned(),
        _ => "no numbers".to_owned(),
    }
}

impl std::fmt::Debug for Array {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Array")
            .field("path", &self.path)
            .field("name", &self.name)
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}
