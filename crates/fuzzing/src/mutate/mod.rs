//! Mutations that keep a file's structure.

mod json;
mod onnx;
mod text;

use rand::RngExt;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::{check, container};

/// Of so many mutations one changes the file as a whole, and so breaks its structure.
const BROKEN: u32 = 8;

/// Most entries of an archive that grows.
const MAX_ENTRIES: usize = 12;

/// Numbers at the edges of what readers take.
const FLOATS: [f64; 18] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MIN_POSITIVE,
    1e-45,
    1e-7,
    1e4,
    -1e6,
    1e10,
    3.4e38,
    3.5e38,
    -1e300,
    f64::MAX,
];
const INTEGERS: [i64; 16] = [
    0,
    1,
    -1,
    2,
    3,
    7,
    24,
    127,
    255,
    65_535,
    1 << 20,
    i32::MAX as i64,
    u32::MAX as i64,
    1 << 53,
    i64::MAX,
    i64::MIN,
];

/// Changes files; the same for the same seed.
pub struct Mutator<'a> {
    random: Pcg64Mcg,
    raw: &'a mut dyn FnMut(&mut Vec<u8>),
}

impl<'a> Mutator<'a> {
    pub fn new(seed: u64, raw: &'a mut dyn FnMut(&mut Vec<u8>)) -> Self {
        Self {
            random: Pcg64Mcg::seed_from_u64(seed),
            raw,
        }
    }

    /// A number below `count`, which is above 0.
    fn below(&mut self, count: usize) -> usize {
        self.random.random_range(0..count.max(1))
    }

    fn one_in(&mut self, count: u32) -> bool {
        self.random.random_range(0..count) == 0
    }

    fn float(&mut self) -> f64 {
        FLOATS[self.below(FLOATS.len())]
    }

    fn integer(&mut self) -> i64 {
        INTEGERS[self.below(INTEGERS.len())]
    }

    fn broken(&mut self, file: &[u8]) -> Vec<u8> {
        let mut file = file.to_vec();
        (self.raw)(&mut file);
        file
    }

    /// Changes numbers of a buffer: some bytes, or a whole number at a multiple of its size.
    fn data(&mut self, data: &mut Vec<u8>) {
        let sizes = [1, 2, 4, 8];
        let size = sizes[self.below(sizes.len())];
        if data.len() < size || self.one_in(3) {
            return (self.raw)(data);
        }
        let at = self.below(data.len() / size) * size;
        let bits = match size {
            4 if !self.one_in(4) => u64::from((self.float() as f32).to_bits()),
            8 if !self.one_in(4) => self.float().to_bits(),
            2 if self.one_in(2) => [0x7e00, 0x7c00, 0xfc00, 0x7bff][self.below(4)],
            _ => self.integer() as u64,
        };
        data[at..at + size].copy_from_slice(&bits.to_le_bytes()[..size]);
    }

    /// `bundle.json`.
    pub fn json_file(&mut self, file: &[u8]) -> Vec<u8> {
        match serde_json::from_slice(file) {
            Ok(mut value) if !self.one_in(BROKEN) => {
                self.json(&mut value);
                value.to_string().into_bytes()
            }
            _ => self.broken(file),
        }
    }

    /// A binary glTF file: its document, or its buffer; lengths are made right.
    pub fn glb(&mut self, file: &[u8]) -> Vec<u8> {
        let parts = container::glb_parts(file);
        let Some((json, mut binary)) = parts.filter(|_| !self.one_in(BROKEN)) else {
            return self.broken(file);
        };
        let mut json = json;
        match self.below(8) {
            0 => (self.raw)(&mut json),
            1..=3 => self.data(&mut binary),
            _ => match serde_json::from_slice(&json) {
                Ok(mut document) => {
                    self.json(&mut document);
                    json = document.to_string().into_bytes();
                }
                Err(_) => (self.raw)(&mut json),
            },
        }
        container::glb(&json, &binary)
    }

    /// A NumPy archive: header or numbers of an array, or which arrays there are; sizes and checksums are
    /// made right.
    pub fn npz(&mut self, file: &[u8]) -> Vec<u8> {
        let entries = container::zip_entries(file).filter(|entries| !entries.is_empty());
        let Some(mut entries) = entries.filter(|_| !self.one_in(BROKEN)) else {
            return self.broken(file);
        };
        let at = self.below(entries.len());
        match self.below(16) {
            0 => {
                entries.remove(at);
            }
            1 if entries.len() < MAX_ENTRIES => {
                let again = entries[at].clone();
                entries.push(again);
            }
            2 => {
                let other = self.below(entries.len());
                let name = entries[other].0.clone();
                entries[at].0 = name;
            }
            3 => (self.raw)(&mut entries[at].1),
            _ => entries[at].1 = self.npy(&entries[at].1),
        }
        // Two entries of one name cannot be written.
        container::zip(&entries, self.one_in(2)).unwrap_or_else(|| self.broken(file))
    }

    fn npy(&mut self, array: &[u8]) -> Vec<u8> {
        let Some((mut header, mut data)) = container::npy_parts(array) else {
            return self.broken(array);
        };
        match self.below(8) {
            0 => header = self.text(&header),
            1 => {
                let types = ["<f8", "<f4", ">f8", "<i8", "<u4", "<i4", "|O", "|b1", "<f2"];
                let (old, new) = (self.below(types.len()), self.below(types.len()));
                header = header.replace(types[old], types[new]);
            }
            // One more or one less along the first axis, with its numbers.
            2 => {
                if let Some(shorter) = resized(&header, &mut data, self.one_in(2)) {
                    header = shorter;
                }
            }
            3 => header = header.replace("False", "True"),
            _ => self.data(&mut data),
        }
        container::npy_with_header(&header, &data)
    }

    /// A saved state or a lowered network: what stands between `header` bytes and its checksum, which is made right.
    pub fn sealed(&mut self, file: &[u8], header: usize) -> Vec<u8> {
        let parts = container::sealed_parts(file, header).filter(|_| !self.one_in(BROKEN));
        let Some((header, payload)) = parts else {
            return self.broken(file);
        };
        let mut payload = payload.to_vec();
        // Numbers stand anywhere: lists are behind lengths of one or two bytes.
        let shift = self.below(8).min(payload.len());
        let mut rest = payload.split_off(shift);
        self.data(&mut rest);
        container::seal([header, &payload, &rest].concat())
    }

    /// A network, ONNX or lowered.
    pub fn network(&mut self, file: &[u8]) -> Vec<u8> {
        if check::is_lowered(file) {
            self.sealed(file, container::LOWERED_HEADER)
        } else {
            self.onnx(file)
        }
    }

    /// A clip: its header or its numbers; the header's length is made right.
    pub fn safetensors(&mut self, file: &[u8]) -> Vec<u8> {
        let parts = container::safetensors_parts(file).filter(|_| !self.one_in(BROKEN));
        let Some((mut header, mut data)) = parts else {
            return self.broken(file);
        };
        if self.one_in(2) {
            self.json(&mut header);
        } else {
            self.data(&mut data);
        }
        container::safetensors(header.to_string().as_bytes(), &data)
    }

    /// A file whose fields are numbers, none of which is a checksum of others: one of them, anywhere.
    pub fn numbers(&mut self, file: &[u8]) -> Vec<u8> {
        let mut file = file.to_vec();
        self.data(&mut file);
        file
    }

    /// A text file.
    pub fn text_file(&mut self, file: &[u8]) -> Vec<u8> {
        match std::str::from_utf8(file) {
            Ok(text) if !self.one_in(3) => self.text(text).into_bytes(),
            _ => self.broken(file),
        }
    }

    /// A PLY file: its header as text, or what follows.
    pub fn ply(&mut self, file: &[u8]) -> Vec<u8> {
        const END: &[u8] = b"end_header\n";
        let header = file.windows(END.len()).position(|window| window == END);
        let Some(header) = header.filter(|_| !self.one_in(BROKEN)) else {
            return self.broken(file);
        };
        let (header, rest) = file.split_at(header + END.len());
        if self.one_in(2) {
            let header = self.text(&String::from_utf8_lossy(header));
            [header.as_bytes(), rest].concat()
        } else {
            let mut rest = rest.to_vec();
            self.data(&mut rest);
            [header, &rest].concat()
        }
    }
}

/// The header of an array that is one longer or shorter along its first axis, as `data` then is.
fn resized(header: &str, data: &mut Vec<u8>, grows: bool) -> Option<String> {
    let (before, shape) = header.split_once("'shape': (")?;
    let end = shape.find([',', ')'])?;
    let length: usize = shape[..end].trim().parse().ok()?;
    let row = data.len().checked_div(length)?;
    let length = if grows { length + 1 } else { length - 1 };
    data.resize(row * length, 0);
    Some(format!("{before}'shape': ({length}{}", &shape[end..]))
}
