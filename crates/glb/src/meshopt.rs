//! Decompresses buffers that meshoptimizer compressed.

use crate::values::{Compression, MAX_ELEMENTS};

/// The decompressed bytes; none for what cannot be decompressed.
pub fn decode(encoded: &[u8], compression: &Compression) -> Option<Vec<u8>> {
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
