//! Reading a clip file. The file is untrusted: every tensor's type, shape and values are checked.

use std::collections::HashMap;
use std::fs;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::Path;

use dynaskin_body::{JOINT_COUNT, Pose, REGION_COUNT, SHAPE_COUNT};
use glam::{DQuat, DVec3};
use half::f16;
use safetensors::tensor::{Dtype, Metadata, SafeTensors};

use crate::materials::can_be_simulated;
use dynaskin_body::Materials;

use super::{ClipData, ClipHeader, DatasetError, FORMAT, VERSION};

/// Largest file read into memory: an hour at 60 Hz of 6,890 vertices is 9 GB, no clip is near it.
const MAX_FILE_BYTES: u64 = 4 << 30;
/// Largest header: ours are under 8 KiB.
const MAX_HEADER_BYTES: u64 = 1 << 20;

impl ClipData {
    /// Reads a clip file.
    ///
    /// # Errors
    /// See [`DatasetError`]: the file cannot be read, is damaged, is no clip of this version, or
    /// holds numbers that are not finite, poses that are none or vertices out of order.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        let file = File { path };
        let length = fs::metadata(path).map_err(|e| file.io("opening", e))?.len();
        if length > MAX_FILE_BYTES {
            return Err(file.malformed(format!("{length} bytes, more than {MAX_FILE_BYTES}")));
        }
        let bytes = fs::read(path).map_err(|e| file.io("reading", e))?;
        Self::from_bytes(path, &bytes)
    }

    /// The clip of a file that is in memory; `path` only names it in messages.
    ///
    /// # Errors
    /// As [`ClipData::read`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, DatasetError> {
        let file = File { path };
        let (header_bytes, metadata) =
            SafeTensors::read_metadata(bytes).map_err(|e| file.malformed(e.to_string()))?;
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| file.malformed(e.to_string()))?;
        file.check_format(&metadata)?;
        // The lengths were checked when the tensors were made out.
        let header = file.header(&metadata, |place| {
            Ok(bytes[8 + header_bytes..][place].to_vec())
        })?;
        let (frames, vertices) = (header.frame_count, header.vertices.len());

        let offsets = file.tensor(&tensors, "offsets_m", Dtype::F16, &[frames, vertices, 3])?;
        let shape = file.tensor(&tensors, "shape", Dtype::F32, &[SHAPE_COUNT])?;
        let roots = file.tensor(&tensors, "root_translation_m", Dtype::F64, &[frames, 3])?;
        let rotations = file.tensor(
            &tensors,
            "parent_from_joint",
            Dtype::F64,
            &[frames, JOINT_COUNT, 4],
        )?;

        let clip = Self {
            name: header.name,
            body_sha256: header.body_sha256,
            rate_hz: header.rate_hz,
            seed: header.seed,
            sim_json: header.sim_json,
            shape: array(numbers(shape, f32::from_le_bytes)),
            materials: header.materials,
            vertices: header.vertices,
            poses: poses(roots, rotations),
            offsets_rest_m: numbers(offsets, f16::from_le_bytes).collect(),
        };
        file.check_values(&clip)?;
        Ok(clip)
    }
}

impl ClipHeader {
    /// Reads only the header of a clip file and its list of vertices: a few kilobytes.
    ///
    /// # Errors
    /// As [`ClipData::read`], except that the numbers themselves are not looked at.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        let file = File { path };
        let mut reader = fs::File::open(path).map_err(|e| file.io("opening", e))?;
        let length = reader.metadata().map_err(|e| file.io("opening", e))?.len();
        let mut size = [0; 8];
        reader
            .read_exact(&mut size)
            .map_err(|e| file.malformed(e.to_string()))?;
        let size = u64::from_le_bytes(size);
        if size > MAX_HEADER_BYTES || size + 8 > length {
            return Err(file.malformed(format!("a header of {size} bytes in {length}")));
        }
        let mut text = vec![0; size as usize];
        reader
            .read_exact(&mut text)
            .map_err(|e| file.malformed(e.to_string()))?;
        let metadata: Metadata =
            serde_json::from_slice(&text).map_err(|e| file.malformed(e.to_string()))?;
        if metadata.data_len() as u64 + 8 + size != length {
            return Err(file.malformed("it is cut off or has bytes to spare".to_owned()));
        }
        file.check_format(&metadata)?;
        file.header(&metadata, |place| {
            let mut bytes = vec![0; place.len()];
            reader
                .seek(SeekFrom::Start(8 + size + place.start as u64))
                .and_then(|_| reader.read_exact(&mut bytes))
                .map_err(|e| file.io("reading", e))?;
            Ok(bytes)
        })
    }
}

/// The file being read, for its errors.
struct File<'a> {
    path: &'a Path,
}

impl File<'_> {
    fn io(&self, action: &'static str, source: std::io::Error) -> DatasetError {
        DatasetError::Io {
            path: self.path.to_owned(),
            action,
            source,
        }
    }

    fn malformed(&self, reason: String) -> DatasetError {
        DatasetError::Malformed {
            path: self.path.to_owned(),
            reason,
        }
    }

    /// Checked first: a file of another version may lack anything else.
    fn check_format(&self, metadata: &Metadata) -> Result<(), DatasetError> {
        let empty = HashMap::new();
        let entries = metadata.metadata().as_ref().unwrap_or(&empty);
        for (key, expected) in [("format", FORMAT), ("version", VERSION)] {
            let got = entries.get(key).map_or("nothing", String::as_str);
            if got != expected {
                return Err(self.metadata(key, expected, got));
            }
        }
        Ok(())
    }

    /// `bytes_at` reads bytes that lie there after the header, within the file.
    fn header(
        &self,
        metadata: &Metadata,
        mut bytes_at: impl FnMut(Range<usize>) -> Result<Vec<u8>, DatasetError>,
    ) -> Result<ClipHeader, DatasetError> {
        let empty = HashMap::new();
        let entries = metadata.metadata().as_ref().unwrap_or(&empty);
        let text = |key: &'static str, expected: &str| {
            entries
                .get(key)
                .cloned()
                .ok_or_else(|| self.metadata(key, expected, "nothing"))
        };
        let rate = text("rate_hz", "a number above 0")?;
        let rate_hz = rate
            .parse()
            .ok()
            .filter(|rate: &f64| rate.is_finite() && *rate > 0.0)
            .ok_or_else(|| self.metadata("rate_hz", "a number above 0", &rate))?;
        let seed = text("seed", "a whole number")?;
        let seed = seed
            .parse()
            .map_err(|_| self.metadata("seed", "a whole number", &seed))?;
        let shape = metadata.info("offsets_m").map(|info| info.shape.as_slice());
        let (frame_count, vertex_count) = match shape {
            Some(&[frames, vertices, 3]) => (frames, vertices),
            _ => (0, 0),
        };
        if frame_count == 0 || vertex_count == 0 {
            return Err(DatasetError::Tensor {
                path: self.path.to_owned(),
                tensor: "offsets_m",
                expected: "F16 [frames, vertices, 3], none of them 0".to_owned(),
                got: shape.map_or("nothing".to_owned(), |shape| format!("{shape:?}")),
            });
        };
        let mut small = |tensor, dtype, shape: &[usize]| {
            let place = self.place(metadata, tensor, dtype, shape)?;
            bytes_at(place)
        };
        let materials = small("materials", Dtype::F32, &[2, REGION_COUNT])?;
        let vertices = small("vertices", Dtype::U32, &[vertex_count])?;
        let (stiffness, damping) = materials.split_at(materials.len() / 2);
        let materials = Materials {
            stiffness: array(numbers(stiffness, f32::from_le_bytes)),
            damping: array(numbers(damping, f32::from_le_bytes)),
        };
        if !can_be_simulated(&materials) {
            return Err(DatasetError::Value {
                path: self.path.to_owned(),
                tensor: "materials",
                frame: 0,
                reason: "a multiplier is not between 0.25 and 4",
            });
        }
        Ok(ClipHeader {
            materials,
            name: text("name", "the clip's name")?,
            body_sha256: text("body_sha256", "a hash")?,
            rate_hz,
            seed,
            sim_json: text("sim", "settings as JSON")?,
            frame_count,
            vertices: numbers(&vertices, u32::from_le_bytes).collect(),
        })
    }

    /// Where a tensor's bytes lie after the header.
    fn place(
        &self,
        metadata: &Metadata,
        tensor: &'static str,
        dtype: Dtype,
        shape: &[usize],
    ) -> Result<Range<usize>, DatasetError> {
        let info = metadata.info(tensor);
        let fits = info.filter(|info| info.dtype == dtype && info.shape == shape);
        let (start, end) = fits.map(|info| info.data_offsets).ok_or_else(|| {
            let got = info.map(|info| format!("{:?} {:?}", info.dtype, info.shape));
            DatasetError::Tensor {
                path: self.path.to_owned(),
                tensor,
                expected: format!("{dtype:?} {shape:?}"),
                got: got.unwrap_or_else(|| "nothing".to_owned()),
            }
        })?;
        Ok(start..end)
    }

    fn metadata(&self, key: &'static str, expected: &str, got: &str) -> DatasetError {
        DatasetError::Metadata {
            path: self.path.to_owned(),
            key,
            expected: expected.to_owned(),
            // Untrusted text goes into a message: keep it short.
            got: got.chars().take(80).collect(),
        }
    }

    fn tensor<'d>(
        &self,
        tensors: &SafeTensors<'d>,
        name: &'static str,
        dtype: Dtype,
        shape: &[usize],
    ) -> Result<&'d [u8], DatasetError> {
        let wrong = |got: String| DatasetError::Tensor {
            path: self.path.to_owned(),
            tensor: name,
            expected: format!("{dtype:?} {shape:?}"),
            got,
        };
        let view = tensors
            .tensor(name)
            .map_err(|_| wrong("nothing".to_owned()))?;
        if view.dtype() != dtype || view.shape() != shape {
            return Err(wrong(format!("{:?} {:?}", view.dtype(), view.shape())));
        }
        Ok(view.data())
    }

    fn check_values(&self, clip: &ClipData) -> Result<(), DatasetError> {
        let bad = |tensor, frame, reason| {
            Err(DatasetError::Value {
                path: self.path.to_owned(),
                tensor,
                frame,
                reason,
            })
        };
        if !clip.shape.iter().all(|x| x.is_finite()) {
            return bad("shape", 0, "a number is not finite");
        }
        if !clip.vertices.is_sorted_by(|a, b| a < b) {
            return bad("vertices", 0, "the indices are not ascending");
        }
        if let Some(frame) = clip.poses.iter().position(|pose| !pose.is_valid()) {
            return bad(
                "parent_from_joint",
                frame,
                "the pose is not finite or a quaternion has not length 1",
            );
        }
        let stride = clip.vertices.len() * 3;
        if let Some(at) = clip.offsets_rest_m.iter().position(|x| !x.is_finite()) {
            return bad("offsets_m", at / stride, "a number is not finite");
        }
        Ok(())
    }
}

fn numbers<const N: usize, T>(bytes: &[u8], parse: fn([u8; N]) -> T) -> impl Iterator<Item = T> {
    bytes
        .as_chunks::<N>()
        .0
        .iter()
        .map(move |chunk| parse(*chunk))
}

fn array<T: Copy + Default, const N: usize>(numbers: impl Iterator<Item = T>) -> [T; N] {
    let mut out = [T::default(); N];
    for (slot, number) in out.iter_mut().zip(numbers) {
        *slot = number;
    }
    out
}

fn poses(roots: &[u8], rotations: &[u8]) -> Vec<Pose> {
    let roots: Vec<f64> = numbers(roots, f64::from_le_bytes).collect();
    let rotations: Vec<f64> = numbers(rotations, f64::from_le_bytes).collect();
    let (roots, _) = roots.as_chunks::<3>();
    let (quaternions, _) = rotations.as_chunks::<4>();
    roots
        .iter()
        .zip(quaternions.chunks_exact(JOINT_COUNT))
        .map(|(root, joints)| Pose {
            root_translation_m: DVec3::from_array(*root),
            parent_from_joint: std::array::from_fn(|joint| DQuat::from_array(joints[joint])),
        })
        .collect()
}
