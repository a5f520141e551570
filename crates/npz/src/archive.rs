//! Reading an archive, array by array.

use std::io::{Read, Seek};

use npyz::{Deserialize, NpyFile, Order};

use crate::NpzError;
use crate::array::{Array, strides};

/// A header describes type, order and shape in about 100 bytes.
const MAX_HEADER_BYTES: usize = 1_024;

/// An open archive.
#[derive(Debug)]
pub struct Archive<R> {
    zip: zip::ZipArchive<R>,
    max_array_bytes: u64,
}

impl<R: Read + Seek> Archive<R> {
    /// Opens an archive of which no array may unpack to more than `max_array_bytes`.
    ///
    /// # Errors
    /// [`NpzError::Archive`] where it is no zip archive.
    pub fn open(reader: R, max_array_bytes: u64) -> Result<Self, NpzError> {
        let zip = zip::ZipArchive::new(reader).map_err(|error| NpzError::Archive {
            reason: format!(
                "not an archive that numpy.savez writes ({error}); convert .pkl files to .npz first"
            ),
        })?;
        Ok(Self {
            zip,
            max_array_bytes,
        })
    }

    /// Whether there is an array of that key.
    pub fn has(&self, key: &str) -> bool {
        self.zip.index_for_name(&format!("{key}.npy")).is_some()
    }

    /// The keys of all arrays, in the file's order.
    pub fn keys(&self) -> Vec<String> {
        self.zip
            .file_names()
            .filter_map(|name| name.ok()?.strip_suffix(".npy").map(str::to_owned))
            .collect()
    }

    /// Reads an array of 32 or 64-bit floats; `shape` gives the fixed lengths.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing, of another type or shape, or not finite.
    pub fn floats(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array<f64>, NpzError> {
        let array = self.floats_unchecked(key, shape)?;
        match array.values.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(NpzError::array(key, "finite numbers", value.to_string())),
            None => Ok(array),
        }
    }

    /// Like [`Self::floats`], but NaN and infinity pass: for callers that can name the frame.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn floats_unchecked(
        &mut self,
        key: &str,
        shape: &[Option<usize>],
    ) -> Result<Array<f64>, NpzError> {
        self.numbers(key, shape, |file| {
            let file = cast::<f64, _>(file, |x| x)?;
            cast::<f32, _>(file, f64::from)
        })
    }

    /// Like [`Self::floats_unchecked`] in single precision: half the memory for long sequences.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn floats_single(
        &mut self,
        key: &str,
        shape: &[Option<usize>],
    ) -> Result<Array<f32>, NpzError> {
        self.numbers(key, shape, |file| {
            let file = cast::<f32, _>(file, |x| x)?;
            cast::<f64, _>(file, |x| x as f32)
        })
    }

    /// Reads an array of 32 or 64-bit integers.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn integers(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array<f64>, NpzError> {
        self.numbers(key, shape, integers)
    }

    /// Reads one number, a float or an integer, with or without axes of length 1 around it.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or something else.
    pub fn scalar(&mut self, key: &str) -> Result<f64, NpzError> {
        let array = self.any_shape(key, |file| {
            let file = cast::<f64, _>(file, |x| x)?;
            let file = cast::<f32, _>(file, f64::from)?;
            integers(file)
        })?;
        match array.values[..] {
            [value] => Ok(value),
            _ => Err(NpzError::array(
                key,
                "one number",
                format!("shape {:?}", array.shape),
            )),
        }
    }

    fn numbers<T>(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        read: impl FnOnce(NpyFile<&[u8]>) -> Cast<'_, T>,
    ) -> Result<Array<T>, NpzError> {
        let bytes = self.bytes(key)?;
        let file = plain(key, &bytes)?;
        let shape = lengths(&file);
        let fits = shape.len() == expected.len()
            && shape
                .iter()
                .zip(expected)
                .all(|(length, expected)| expected.is_none_or(|expected| expected == *length));
        if !fits {
            return Err(NpzError::array(
                key,
                describe(expected),
                format!("shape {shape:?}"),
            ));
        }
        decode(key, file, read)
    }

    fn any_shape<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(NpyFile<&[u8]>) -> Cast<'_, T>,
    ) -> Result<Array<T>, NpzError> {
        let bytes = self.bytes(key)?;
        let file = plain(key, &bytes)?;
        decode(key, file, read)
    }

    /// The unpacked `.npy` file of a key.
    fn bytes(&mut self, key: &str) -> Result<Vec<u8>, NpzError> {
        let limit = self.max_array_bytes;
        let entry = self.zip.by_name(&format!("{key}.npy")).map_err(|error| {
            NpzError::array(key, "an array", format!("none in the file ({error})"))
        })?;
        let mut bytes = Vec::new();
        let read = entry.take(limit + 1).read_to_end(&mut bytes);
        match read {
            Ok(count) if count as u64 <= limit => Ok(bytes),
            Ok(_) => Err(NpzError::array(
                key,
                format!("at most {limit} bytes"),
                "more",
            )),
            Err(error) => Err(NpzError::array(key, "intact data", error.to_string())),
        }
    }
}

/// `Err` with the elements (or why they cannot be read) once a type fits: that ends a chain of `?`.
/// `Ok` gives the file back, to try the next type.
type Cast<'a, T> = Result<NpyFile<&'a [u8]>, std::io::Result<Vec<T>>>;

fn cast<S: Deserialize, T>(file: NpyFile<&[u8]>, convert: impl Fn(S) -> T) -> Cast<'_, T> {
    match file.try_data::<S>() {
        Ok(reader) => Err(reader.map(|value| value.map(&convert)).collect()),
        Err(file) => Ok(file),
    }
}

fn integers(file: NpyFile<&[u8]>) -> Cast<'_, f64> {
    let file = cast::<u32, _>(file, f64::from)?;
    let file = cast::<i32, _>(file, f64::from)?;
    let file = cast::<i64, _>(file, |x| x as f64)?;
    cast::<u64, _>(file, |x| x as f64)
}

fn decode<T>(
    key: &str,
    file: NpyFile<&[u8]>,
    read: impl FnOnce(NpyFile<&[u8]>) -> Cast<'_, T>,
) -> Result<Array<T>, NpzError> {
    let shape = lengths(&file);
    let strides = match file.order() {
        Order::C => strides(shape.iter().rev(), true),
        Order::Fortran => strides(shape.iter(), false),
    };
    let dtype = file.dtype().descr();
    match read(file) {
        Ok(_) => Err(NpzError::array(
            key,
            "32 or 64-bit numbers",
            format!("dtype {dtype}"),
        )),
        Err(Err(error)) => Err(NpzError::array(key, "intact data", error.to_string())),
        Err(Ok(values)) => Ok(Array {
            shape,
            strides,
            values,
        }),
    }
}

fn plain<'a>(key: &str, bytes: &'a [u8]) -> Result<NpyFile<&'a [u8]>, NpzError> {
    check_header(key, bytes)?;
    let file = NpyFile::new(bytes)
        .map_err(|error| NpzError::array(key, "an array of numpy's format", error.to_string()))?;
    if file.uses_pickled_array() {
        return Err(NpzError::array(
            key,
            "a dense array (convert a sparse one with `.toarray()`)",
            "pickled Python objects",
        ));
    }
    Ok(file)
}

fn lengths(file: &NpyFile<&[u8]>) -> Vec<usize> {
    file.shape().iter().map(|&length| length as usize).collect()
}

fn describe(shape: &[Option<usize>]) -> String {
    let lengths: Vec<String> = shape
        .iter()
        .map(|length| length.map_or("any".to_owned(), |length| length.to_string()))
        .collect();
    format!("shape [{}]", lengths.join(", "))
}

/// What npyz takes on trust: version 1 with a short, flat header, whose numbers multiply to no more
/// elements than the file has bytes.
fn check_header(key: &str, bytes: &[u8]) -> Result<(), NpzError> {
    let bad = |got: &str| NpzError::array(key, "a plain array header", got);
    let length = match bytes.get(6..10) {
        Some(&[1, 0, low, high]) => usize::from(u16::from_le_bytes([low, high])),
        _ => return Err(bad("another version")),
    };
    let text = match bytes.get(10..10 + length) {
        Some(text) if length <= MAX_HEADER_BYTES && text.is_ascii() => {
            String::from_utf8_lossy(text)
        }
        _ => return Err(bad("a truncated or overlong header")),
    };
    if text.matches(['(', '[', '{']).count() > 3 {
        return Err(bad("a nested type"));
    }
    let shape = text.split("'shape'").nth(1).unwrap_or_default();
    let elements = shape
        .split(|c: char| !c.is_ascii_digit())
        .filter(|digits| !digits.is_empty())
        .try_fold(1u64, |product, digits| {
            product.checked_mul(digits.parse().ok()?)
        });
    match elements {
        Some(elements) if elements <= bytes.len() as u64 => Ok(()),
        _ => Err(bad("more elements than the file holds")),
    }
}
