//! A body in two colours as a texture, which shows a sharp line between them where colours of vertices would smear.

use bytemuck::cast_slice;
use dynaskin_clothes::{Tones, hem};
use flate2::Crc;

use crate::BodyModel;

/// Texels from one end of what [`hem::REACH_M`] allows to the other: 0.4 mm each.
const TEXELS: usize = 256;

/// Ends that do not meet, and smooth lines at any distance.
pub(super) const SAMPLER: Sampler = Sampler {
    mag_filter: 9729,
    min_filter: 9987,
    wrap_s: 33071,
    wrap_t: 33071,
};

#[derive(serde::Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Sampler {
    mag_filter: u32,
    min_filter: u32,
    wrap_s: u32,
    wrap_t: u32,
}

/// What replaces the colours of the vertices.
pub(super) struct Painting {
    /// Per vertex where in the texture its colour is, 65,535 is 1: left of the middle in the first colour.
    pub texels: Vec<[u16; 2]>,
    pub png: Vec<u8>,
}

impl Painting {
    /// None for a body that is not painted in two colours.
    pub fn of(model: &BodyModel) -> Option<Self> {
        let Tones { srgb, shares } = Tones::of(&model.colors_srgba)?;
        let positions_m: &[f32] = cast_slice(&model.template_m);
        let distances_m = hem::distances_m(&shares, model.faces.as_flattened(), positions_m);
        let texel = |distance_m: f32| {
            let share = (0.5 + 0.5 * distance_m / hem::REACH_M).clamp(0.0, 1.0);
            [(share * f32::from(u16::MAX)).round() as u16, u16::MAX / 2]
        };
        Some(Self {
            texels: distances_m.into_iter().map(texel).collect(),
            png: stepped_png(srgb),
        })
    }
}

/// A row of texels, the first half in one colour and the rest in the other.
fn stepped_png(srgb: [[u8; 3]; 2]) -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend((TEXELS as u32).to_be_bytes());
    header.extend(1_u32.to_be_bytes());
    // One bit a texel, out of a palette.
    header.extend([1, 3, 0, 0, 0]);
    chunk(&mut png, *b"IHDR", &header);
    chunk(&mut png, *b"PLTE", srgb.as_flattened());
    let mut row = [0_u8; 1 + TEXELS / 8];
    row[1 + TEXELS / 16..].fill(u8::MAX);
    chunk(&mut png, *b"IDAT", &stored(&row));
    chunk(&mut png, *b"IEND", &[]);
    png
}

/// A few bytes as a zlib stream, as they are: there is nothing to gain from packing them.
fn stored(bytes: &[u8]) -> Vec<u8> {
    let length = bytes.len() as u16;
    let mut stream = vec![0x78, 0x01, 0x01];
    stream.extend(length.to_le_bytes());
    stream.extend((!length).to_le_bytes());
    stream.extend(bytes);
    // Adler's checksum.
    let (low, high) = bytes.iter().fold((1_u32, 0_u32), |(low, high), &byte| {
        let low = (low + u32::from(byte)) % 65_521;
        (low, (high + low) % 65_521)
    });
    stream.extend(((high << 16) | low).to_be_bytes());
    stream
}

fn chunk(png: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    png.extend((data.len() as u32).to_be_bytes());
    let begin = png.len();
    png.extend(kind);
    png.extend(data);
    let mut crc = Crc::new();
    crc.update(&png[begin..]);
    png.extend(crc.sum().to_be_bytes());
}
