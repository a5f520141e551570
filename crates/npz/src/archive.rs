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
    pub fn open(mut reader: R, max_array_bytes: u64) -> Result<Self, NpzError> {
        let first = first_bytes(&mut reader);
        let zip = zip::ZipArchive::new(reader).map_err(|_| {
            let (what, what_to_do) = other_kind(&first);
            NpzError::Archive { what, what_to_do }
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

    /// The error for an array that is not there, where `expected` is: it tells what is there.
    pub fn missing(&self, key: &str, expected: &str) -> NpzError {
        let mut keys = self.keys();
        let more = keys.len().saturating_sub(MAX_KEYS);
        keys.truncate(MAX_KEYS);
        let got = match (keys.is_empty(), more) {
            (true, _) => "none in the file, which has no arrays".to_owned(),
            (false, 0) => format!("none in the file, which has {}", keys.join(", ")),
            (false, _) => format!(
                "none in the file, which has {} and {more} more",
                keys.join(", ")
            ),
        };
        NpzError::array(key, expected, got)
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
        let mut odd = None;
        let array = self.numbers(key, (shape, FLOATS), most, |file, part, sink| {
            floats(file, part, &mut |index, value| {
                odd = odd.or((!value.is_finite()).then_some(value));
                sink(index, value);
            })
        })?;
        finite(key, odd)?;
        Ok(array)
    }

    /// Like [`Self::floats_within`], but hands each number to `visit` with its index, for callers that
    /// put them elsewhere: nothing of the array is held. Numbers come in the file's order.
    ///
    /// # Errors
    /// As [`Self::floats`]; `visit` may have been called before.
    pub fn visit_floats(
        &mut self,
        key: &str,
        shape: &[Option<usize>],
        most: &[usize],
        mut visit: impl FnMut(&[usize], f64),
    ) -> Result<(), NpzError> {
        let mut odd = None;
        self.with_array(key, shape, |header, data| {
            let part = part_of(header, most);
            decode((key, FLOATS), header, data, |file| {
                floats(file, &part, &mut |index, value| {
                    odd = odd.or((!value.is_finite()).then_some(value));
                    visit(index, value);
                })
            })
        })?;
        finite(key, odd)
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
        self.numbers(key, (shape, FLOATS), &[], |file, part, sink| {
            let file = cast::<f32, _>(file, part, |x| x, sink)?;
            cast::<f64, _>(file, part, |x| x as f32, sink)
        })
    }

    /// Reads an array of integers of 8 to 64 bits.
    ///
    /// # Errors
    /// [`NpzError::Array`] where it is missing or of another type or shape.
    pub fn integers(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array<f64>, NpzError> {
        self.numbers(key, (shape, INTEGERS), &[], integers)
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
        let array = self.numbers(key, (&one, NUMBERS), &[], |file, part, sink| {
            integers(floats(file, part, sink)?, part, sink)
        })?;
        array
            .values
            .first()
            .copied()
            .ok_or_else(|| NpzError::array(key, "one number", "none"))
    }

    /// The kept numbers of an array of that shape and type. Shape, size and type are checked before any of it
    /// is unpacked.
    fn numbers<T>(
        &mut self,
        key: &str,
        (expected, kind): (&[Option<usize>], &str),
        most: &[usize],
        read: impl for<'a> FnOnce(Source<'a>, &Part, Sink<'_, T>) -> Cast<'a>,
    ) -> Result<Array<T>, NpzError> {
        self.with_array(key, expected, |header, data| {
            let part = part_of(header, most);
            let mut values = Vec::with_capacity(part.count());
            decode((key, kind), header, data, |file| {
                read(file, &part, &mut |_, value| values.push(value))
            })?;
            let strides = match header.order() {
                Order::C => strides(part.kept.iter().rev(), true),
                Order::Fortran => strides(part.kept.iter(), false),
            };
            Ok(Array {
                shape: part.kept,
                strides,
                values,
            })
        })
    }

    /// Hands out the header of an array, whose shape and size are checked, and what follows it.
    fn with_array<T>(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        work: impl FnOnce(&NpyHeader, &mut dyn Read) -> Result<T, NpzError>,
    ) -> Result<T, NpzError> {
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
            work(header, data)
        })
    }

    /// Hands out the header of an array, whose size is checked, and what follows it.
    fn with_entry<T>(
        &mut self,
        key: &str,
        work: impl FnOnce(&NpyHeader, &mut dyn Read) -> Result<T, NpzError>,
    ) -> Result<T, NpzError> {
        let limit = self.max_array_bytes;
        if !self.has(key) {
            return Err(self.missing(key, "an array"));
        }
        let entry = self.zip.by_name(&format!("{key}.npy"));
        let entry = entry.map_err(|_| NpzError::array(key, "an array", DAMAGED))?;
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

/// What can be read, with what makes it of other types.
const FLOATS: &str = "floats of 32 or 64 bits, as `.astype(\"float32\")` makes them";
const INTEGERS: &str = "integers, as `.astype(\"int32\")` makes them";
const NUMBERS: &str = "numbers of 32 or 64 bits";
const DAMAGED: &str = "damaged data: copy or download the file again";
/// Keys that a message lists at most.
const MAX_KEYS: usize = 40;
/// Bytes by which other kinds of files are told.
const FIRST_BYTES: u64 = 16;

/// How files begin that are taken for archives, what they are and what to do.
const OTHER_KINDS: &[(&[u8], &str, &str)] = &[
    (b"", "an empty file", AGAIN),
    (b"PK", "an archive that is cut off or damaged", AGAIN),
    (
        b"\x93NUMPY",
        "a single array",
        "write it with its key by numpy.savez",
    ),
    (b"\x89HDF", "an HDF5 file", SAVEZ),
    (
        b"MATLAB",
        "a MATLAB file",
        "load it with scipy.io.loadmat and write its arrays with numpy.savez",
    ),
    (b"\x1f\x8b", "a gzip file", "unpack it first"),
];
const AGAIN: &str = "copy or download it again";
const SAVEZ: &str = "write its arrays with numpy.savez";

/// What a file is that is no archive, and what to do.
fn other_kind(first: &[u8]) -> (&'static str, &'static str) {
    if matches!(first, [0x80, 2..=5, ..] | [b'(' | b'c', ..]) {
        return (
            "a Python pickle",
            "load it in Python and write its arrays with numpy.savez",
        );
    }
    let begins = |start: &[u8]| first.starts_with(start) && start.is_empty() == first.is_empty();
    let found = OTHER_KINDS.iter().find(|(start, ..)| begins(start));
    match found {
        Some(&(_, what, what_to_do)) => (what, what_to_do),
        None => ("another kind of file", SAVEZ),
    }
}

/// As many of the first bytes as there are; the reader is then at its start again.
fn first_bytes<R: Read + Seek>(reader: &mut R) -> Vec<u8> {
    let mut first = Vec::new();
    // What cannot be read here cannot be read as an archive either.
    let _ = reader.by_ref().take(FIRST_BYTES).read_to_end(&mut first);
    let _ = reader.rewind();
    first
}

/// An array whose elements have not been read.
type Source<'a> = NpyFile<&'a mut dyn Read>;

/// Where numbers go, each with its index.
type Sink<'a, T> = &'a mut dyn FnMut(&[usize], T);

/// `Err` once a type fits and all elements went where they belong (or why they did not): that ends a
/// chain of `?`. `Ok` gives the file back, to try the next type.
type Cast<'a> = Result<Source<'a>, io::Result<()>>;

fn cast<'a, S: Deserialize, T>(
    file: Source<'a>,
    part: &Part,
    convert: impl Fn(S) -> T,
    sink: Sink<'_, T>,
) -> Cast<'a> {
    match file.try_data::<S>() {
        Ok(mut reader) => {
            Err(part.visit(|| reader.next(), |index, value| sink(index, convert(value))))
        }
        Err(file) => Ok(file),
    }
}

fn floats<'a>(file: Source<'a>, part: &Part, sink: Sink<'_, f64>) -> Cast<'a> {
    let file = cast::<f64, _>(file, part, |x| x, sink)?;
    cast::<f32, _>(file, part, f64::from, sink)
}

fn integers<'a>(file: Source<'a>, part: &Part, sink: Sink<'_, f64>) -> Cast<'a> {
    let file = cast::<u32, _>(file, part, f64::from, sink)?;
    let file = cast::<i32, _>(file, part, f64::from, sink)?;
    let file = cast::<u16, _>(file, part, f64::from, sink)?;
    let file = cast::<i16, _>(file, part, f64::from, sink)?;
    let file = cast::<u8, _>(file, part, f64::from, sink)?;
    let file = cast::<i8, _>(file, part, f64::from, sink)?;
    let file = cast::<i64, _>(file, part, |x| x as f64, sink)?;
    cast::<u64, _>(file, part, |x| x as f64, sink)
}

fn finite(key: &str, odd: Option<f64>) -> Result<(), NpzError> {
    match odd {
        None => Ok(()),
        Some(value) => Err(NpzError::array(key, "finite numbers", value.to_string())),
    }
}

fn part_of(header: &NpyHeader, most: &[usize]) -> Part {
    Part::new(&lengths(header), most, header.order() == Order::Fortran)
}

/// Reads all elements, and what the archive says of them at their end.
fn decode(
    (key, kind): (&str, &str),
    header: &NpyHeader,
    data: &mut dyn Read,
    read: impl for<'a> FnOnce(Source<'a>) -> Cast<'a>,
) -> Result<(), NpzError> {
    let broken = |got: String| NpzError::array(key, "intact data", got);
    match read(NpyFile::with_header(header.clone(), &mut *data)) {
        Ok(_) => {
            let got = format!("dtype {}", header.dtype().descr());
            return Err(NpzError::array(key, kind, got));
        }
        Err(outcome) => outcome.map_err(|_| broken(DAMAGED.to_owned()))?,
    }
    // At the end the archive's checksum is compared.
    match data.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(broken("more than the shape asks for".to_owned())),
        Err(_) => Err(broken(DAMAGED.to_owned())),
    }
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
        .map_err(|_| NpzError::array(key, "intact data", DAMAGED))?;
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
        .map_err(|_| NpzError::array(key, "an array of numpy's format", DAMAGED))?;
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
