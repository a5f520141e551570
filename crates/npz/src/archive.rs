//! Reading an archive, array by array.

use std::io::{self, BufReader, Read, Seek};

use npyz::{Deserialize, NpyFile, NpyHeader, Order};

use crate::NpzError;
use crate::array::{Array, strides};
use crate::part::Part;

/// A header describes type, order and shape in about 100 bytes.
const MAX_HEADER_BYTES: usize = 1_024;

/// Bytes that an array may have however small it is packed; beyond that, bytes that a packed byte may
/// unpack to. Measured numbers hardly pack; deflate's limit is 1,032.
const FREE_BYTES: u64 = 64 << 20;
const MAX_RATIO: u64 = 100;

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

    /// The shape of an array, as its header says it; nothing else of it is unpacked.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing, or its header says no such thing.
    pub fn shape(&mut self, key: &str) -> Result<Vec<usize>, NpzError> {
        self.with_entry(key, |header, _| Ok(lengths(header)))
    }

    /// Reads an array of 32 or 64-bit floats; `shape` gives the fixed lengths.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing, of another type or shape, or not finite.
    pub fn floats(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array<f64>, NpzError> {
        self.floats_within(key, shape, &[])
    }

    /// Like [`Self::floats`], but only the first `most` elements along each axis are kept, in an array
    /// of that shape: the columns that are needed of many. Axes for which `most` has no number are
    /// kept whole. What is not kept is unpacked and passed over, and not checked.
    ///
    /// # Errors
    /// As [`Self::floats`].
    pub fn floats_within(
        &mut self,
        key: &str,
        shape: &[Option<usize>],
        most: &[usize],
    ) -> Result<Array<f64>, NpzError> {
        let array = self.numbers(key, shape, most, floats)?;
        match array.values.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(NpzError::array(key, "finite numbers", value.to_string())),
            None => Ok(array),
        }
    }

    /// Like [`Self::floats`] in single precision, half the memory for long sequences. NaN and infinity
    /// pass, for callers that can name the frame.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn floats_single(
        &mut self,
        key: &str,
        shape: &[Option<usize>],
    ) -> Result<Array<f32>, NpzError> {
        self.numbers(key, shape, &[], |file, part| {
            let file = cast::<f32, _>(file, part, |x| x)?;
            cast::<f64, _>(file, part, |x| x as f32)
        })
    }

    /// Reads an array of 32 or 64-bit integers.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn integers(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array<f64>, NpzError> {
        self.numbers(key, shape, &[], integers)
    }

    /// Reads one number, a float or an integer, with or without axes of length 1 around it.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or something else.
    pub fn scalar(&mut self, key: &str) -> Result<f64, NpzError> {
        let shape = self.shape(key)?;
        let one: Vec<Option<usize>> = shape.iter().map(|_| Some(1)).collect();
        if shape.iter().any(|length| *length != 1) {
            return Err(NpzError::array(
                key,
                "one number",
                format!("shape {shape:?}"),
            ));
        }
        let array = self.numbers(key, &one, &[], |file, part| {
            integers(floats(file, part)?, part)
        })?;
        array
            .values
            .first()
            .copied()
            .ok_or_else(|| NpzError::array(key, "one number", "none"))
    }

    /// The kept numbers of an array. Shape, size and type are checked before any of it is unpacked.
    fn numbers<T>(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        most: &[usize],
        read: impl for<'a> FnOnce(Source<'a>, &Part) -> Cast<'a, T>,
    ) -> Result<Array<T>, NpzError> {
        self.with_entry(key, |header, data| {
            let shape = lengths(header);
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
            decode(key, header, data, most, read)
        })
    }

    /// Hands out the header of an array, whose size is checked, and what follows it.
    fn with_entry<T>(
        &mut self,
        key: &str,
        work: impl FnOnce(&NpyHeader, &mut dyn Read) -> Result<T, NpzError>,
    ) -> Result<T, NpzError> {
        let limit = self.max_array_bytes;
        let entry = self.zip.by_name(&format!("{key}.npy")).map_err(|error| {
            NpzError::array(key, "an array", format!("none in the file ({error})"))
        })?;
        let packed_bytes = entry.compressed_size();
        let mut reader = BufReader::new(entry);
        let header = header(key, &mut reader, limit)?;
        let element_bytes = header.dtype().num_bytes().unwrap_or(1) as u64;
        let bytes = header.len().saturating_mul(element_bytes);
        if bytes > limit {
            let got = format!("{bytes}");
            return Err(NpzError::array(
                key,
                format!("at most {limit} bytes unpacked"),
                got,
            ));
        }
        if bytes > FREE_BYTES.max(packed_bytes.saturating_mul(MAX_RATIO)) {
            let expected =
                format!("at most {MAX_RATIO} times its packed size of {packed_bytes} bytes");
            let got = format!("{bytes} bytes, as no measured numbers pack");
            return Err(NpzError::array(key, expected, got));
        }
        work(&header, &mut reader)
    }
}

/// An array whose elements have not been read.
type Source<'a> = NpyFile<&'a mut dyn Read>;

/// `Err` with the elements (or why they cannot be read) once a type fits: that ends a chain of `?`.
/// `Ok` gives the file back, to try the next type.
type Cast<'a, T> = Result<Source<'a>, io::Result<Vec<T>>>;

fn cast<'a, S: Deserialize, T>(
    file: Source<'a>,
    part: &Part,
    convert: impl Fn(S) -> T,
) -> Cast<'a, T> {
    match file.try_data::<S>() {
        Ok(mut reader) => Err(part.take(|| reader.next(), convert)),
        Err(file) => Ok(file),
    }
}

fn floats<'a>(file: Source<'a>, part: &Part) -> Cast<'a, f64> {
    let file = cast::<f64, _>(file, part, |x| x)?;
    cast::<f32, _>(file, part, f64::from)
}

fn integers<'a>(file: Source<'a>, part: &Part) -> Cast<'a, f64> {
    let file = cast::<u32, _>(file, part, f64::from)?;
    let file = cast::<i32, _>(file, part, f64::from)?;
    let file = cast::<i64, _>(file, part, |x| x as f64)?;
    cast::<u64, _>(file, part, |x| x as f64)
}

fn decode<T>(
    key: &str,
    header: &NpyHeader,
    data: &mut dyn Read,
    most: &[usize],
    read: impl for<'a> FnOnce(Source<'a>, &Part) -> Cast<'a, T>,
) -> Result<Array<T>, NpzError> {
    let broken = |got: String| NpzError::array(key, "intact data", got);
    let is_fortran = header.order() == Order::Fortran;
    let part = Part::new(&lengths(header), most, is_fortran);
    let values = match read(NpyFile::with_header(header.clone(), &mut *data), &part) {
        Ok(_) => {
            let dtype = header.dtype().descr();
            let got = format!("dtype {dtype}");
            return Err(NpzError::array(key, "32 or 64-bit numbers", got));
        }
        Err(values) => values.map_err(|error| broken(error.to_string()))?,
    };
    // At the end the archive's checksum is compared.
    match data.read(&mut [0]) {
        Ok(0) => {}
        Ok(_) => return Err(broken("more than the shape asks for".to_owned())),
        Err(error) => return Err(broken(error.to_string())),
    }
    let strides = match is_fortran {
        false => strides(part.kept.iter().rev(), true),
        true => strides(part.kept.iter(), false),
    };
    Ok(Array {
        shape: part.kept,
        strides,
        values,
    })
}

fn lengths(header: &NpyHeader) -> Vec<usize> {
    header
        .shape()
        .iter()
        .map(|&length| length as usize)
        .collect()
}

fn describe(shape: &[Option<usize>]) -> String {
    let lengths: Vec<String> = shape
        .iter()
        .map(|length| length.map_or("any".to_owned(), |length| length.to_string()))
        .collect();
    format!("shape [{}]", lengths.join(", "))
}

/// Reads and checks a header. npyz takes on trust that it is of version 1, short and flat, and that its
/// numbers multiply to a sensible number of elements.
fn header(key: &str, reader: &mut impl Read, max_elements: u64) -> Result<NpyHeader, NpzError> {
    let bad = |got: &str| NpzError::array(key, "a plain array header", got);
    let mut bytes = vec![0; 10];
    reader
        .read_exact(&mut bytes)
        .map_err(|error| NpzError::array(key, "intact data", error.to_string()))?;
    let length = match bytes.get(6..10) {
        Some(&[1, 0, low, high]) => usize::from(u16::from_le_bytes([low, high])),
        _ => return Err(bad("another version")),
    };
    if length > MAX_HEADER_BYTES {
        return Err(bad("a truncated or overlong header"));
    }
    let mut text = vec![0; length];
    if reader.read_exact(&mut text).is_err() || !text.is_ascii() {
        return Err(bad("a truncated or overlong header"));
    }
    check_text(&String::from_utf8_lossy(&text), max_elements).map_err(bad)?;
    bytes.extend(text);
    let header = NpyHeader::from_reader(&bytes[..])
        .map_err(|error| NpzError::array(key, "an array of numpy's format", error.to_string()))?;
    if header.uses_pickled_array() {
        return Err(NpzError::array(
            key,
            "a dense array (convert a sparse one with `.toarray()`)",
            "pickled Python objects",
        ));
    }
    Ok(header)
}

fn check_text(text: &str, max_elements: u64) -> Result<(), &'static str> {
    if text.matches(['(', '[', '{']).count() > 3 {
        return Err("a nested type");
    }
    let shape = text.split("'shape'").nth(1).unwrap_or_default();
    // An axis of length 0 hides no overflow of the others.
    let elements = shape
        .split(|c: char| !c.is_ascii_digit())
        .filter(|digits| !digits.is_empty())
        .try_fold(1u64, |product, digits| {
            product.checked_mul(digits.parse::<u64>().ok()?.max(1))
        });
    match elements {
        Some(elements) if elements <= max_elements => Ok(()),
        _ => Err("more elements than an array may have"),
    }
}
