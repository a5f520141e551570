//! Decompresses buffers that meshoptimizer compressed.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::GlbError;
use crate::values::MAX_ELEMENTS;

/// Where a compressed buffer view really lies.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Compression {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    pub byte_stride: usize,
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Views {
    buffer_views: Vec<View>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct View {
    extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Extensions {
    #[serde(rename = "EXT_meshopt_compression")]
    meshopt: Option<Compression>,
    #[serde(rename = "KHR_meshopt_compression")]
    meshopt_khr: Option<Compression>,
}

/// The compressed buffer views of a document; none where it names none in a way that can be read.
pub fn compressions(json: &[u8]) -> BTreeMap<usize, Compression> {
    let views: Views = serde_json::from_slice(json).unwrap_or_default();
    let views = views.buffer_views.into_iter().enumerate();
    views
        .filter_map(|(idx, view)| {
            let extensions = view.extensions;
            Some((idx, extensions.meshopt.or(extensions.meshopt_khr)?))
        })
        .collect()
}

impl Compression {
    /// The bytes of buffer view `index`, from the file's own buffer.
    pub fn decompressed(&self, index: usize, binary: &[u8]) -> Result<Vec<u8>, GlbError> {
        let bad = |expected: &str| GlbError::new(format!("buffer view {index}"), expected);
        let range = || {
            let end = self.byte_offset.checked_add(self.byte_length)?;
            binary.get(self.byte_offset..end)
        };
        let encoded = (self.buffer == 0).then(range).flatten();
        let encoded = encoded.ok_or_else(|| bad("compressed data inside the BIN chunk"))?;
        decode(encoded, self).ok_or_else(|| bad("data that meshoptimizer can decompress"))
    }
}

/// The decompressed bytes; none for what cannot be decompressed.
fn decode(encoded: &[u8], compression: &Compression) -> Option<Vec<u8>> {
    if compression.count > MAX_ELEMENTS {
        return None;
    }
    match (compression.mode.as_str(), compression.byte_stride) {
        ("ATTRIBUTES", stride) => attributes(encoded, compression, stride),
        ("TRIANGLES", 2) => bytes(meshopt::decode_index_buffer::<u16>(
            encoded,
            compression.count,
        )),
        ("TRIANGLES", 4) => bytes(meshopt::decode_index_buffer::<u32>(
            encoded,
            compression.count,
        )),
        ("INDICES", 2) => bytes(meshopt::decode_index_sequence::<u16>(
            encoded,
            compression.count,
        )),
        ("INDICES", 4) => bytes(meshopt::decode_index_sequence::<u32>(
            encoded,
            compression.count,
        )),
        _ => None,
    }
}

fn bytes<T: bytemuck::NoUninit>(decoded: meshopt::Result<Vec<T>>) -> Option<Vec<u8>> {
    Some(bytemuck::cast_slice(&decoded.ok()?).to_vec())
}

/// Elements of `stride` bytes; those that vertex data and matrices have.
fn attributes(encoded: &[u8], compression: &Compression, stride: usize) -> Option<Vec<u8>> {
    macro_rules! words {
        ($($count:literal)*) => {
            match stride {
                $(stride if stride == 4 * $count =>
                    vertices::<$count>(encoded, compression),)*
                _ => None,
            }
        };
    }
    words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 20 24 28 32)
}

fn vertices<const N: usize>(encoded: &[u8], compression: &Compression) -> Option<Vec<u8>>
where
    [u32; N]: Default + bytemuck::NoUninit,
{
    let count = compression.count;
    let mut decoded = meshopt::decode_vertex_buffer::<[u32; N]>(encoded, count).ok()?;
    match (compression.filter.as_deref(), N) {
        (None | Some("NONE"), _) => {}
        (Some("EXPONENTIAL"), _) => meshopt::decode_filter_exp(&mut decoded),
        (Some("OCTAHEDRAL"), 1) => {
            let mut units: Vec<[i8; 4]> = bytemuck::cast_slice(&decoded).to_vec();
            meshopt::decode_filter_oct(&mut units);
            return Some(bytemuck::cast_slice(&units).to_vec());
        }
        (Some(filter @ ("OCTAHEDRAL" | "QUATERNION")), 2) => {
            let mut units: Vec<[i16; 4]> = bytemuck::cast_slice(&decoded).to_vec();
            if filter == "OCTAHEDRAL" {
                meshopt::decode_filter_oct(&mut units);
            } else {
                meshopt::decode_filter_quat(&mut units);
            }
            return Some(bytemuck::cast_slice(&units).to_vec());
        }
        _ => return None,
    }
    Some(bytemuck::cast_slice(&decoded).to_vec())
}
