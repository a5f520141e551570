//! A body in two colours as a texture, which shows a sharp line between them where colours of vertices would smear.

use bytemuck::cast_slice;
use dynaskin_clothes::{Tones, hem};

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
    pub fn of(model: &BodyModel) -> Result<Option<Self>, png::EncodingError> {
        let Some(Tones { srgb, shares }) = Tones::of(&model.colors_srgba) else {
            return Ok(None);
        };
        let positions_m: &[f32] = cast_slice(&model.template_m);
        let distances_m = hem::distances_m(&shares, model.faces.as_flattened(), positions_m);
        let texel = |distance_m: f32| {
            let share = (0.5 + 0.5 * distance_m / hem::REACH_M).clamp(0.0, 1.0);
            [(share * f32::from(u16::MAX)).round() as u16, u16::MAX / 2]
        };
        Ok(Some(Self {
            texels: distances_m.into_iter().map(texel).collect(),
            png: stepped_png(srgb)?,
        }))
    }
}

/// A row of texels, the first half in one colour and the rest in the other.
fn stepped_png(srgb: [[u8; 3]; 2]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, TEXELS as u32, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_palette(srgb.as_flattened());
    let mut row = [0_u8; TEXELS / 8];
    row[TEXELS / 16..].fill(u8::MAX);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&row)?;
    writer.finish()?;
    Ok(bytes)
}
