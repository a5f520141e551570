//! The heat map's colours: dark blue over violet and orange to pale yellow.
//!
//! The ramp is a path in OKLCh (the polar form of Oklab, Ottosson 2020, "A perceptual color space
//! for image processing") whose lightness rises evenly, so it reads without colour: in print, and
//! with any colour vision deficiency. A test simulates the three deficiencies.

use crate::gpu_data::HEAT_STOPS;

/// Path of the ramp: lightness, chroma, hue in degrees. Hue 264 is blue, 330 magenta-violet,
/// 40 orange, 105 yellow. The dark end stays light enough to show the body's shape.
const PATH: [[f32; 3]; 6] = [
    [0.36, 0.085, 268.0],
    [0.46, 0.150, 300.0],
    [0.56, 0.180, 345.0],
    [0.67, 0.175, 393.0],
    [0.79, 0.150, 432.0],
    [0.94, 0.115, 465.0],
];

/// The ramp's colour at `along` (0 at no offset, 1 at the end of the range and beyond), in linear
/// sRGB, 0..=1 each.
fn heat_color_linear(along: f32) -> [f32; 3] {
    let last = PATH.len() - 1;
    let at = along.clamp(0.0, 1.0) * last as f32;
    let low = (at as usize).min(last - 1);
    let share = at - low as f32;
    let [lightness, chroma, hue] =
        std::array::from_fn(|idx| PATH[low][idx] * (1.0 - share) + PATH[low + 1][idx] * share);
    let (sin, cos) = hue.to_radians().sin_cos();
    linear_srgb_from_oklab([lightness, chroma * cos, chroma * sin]).map(|c| c.clamp(0.0, 1.0))
}

/// The stops that the shader interpolates linearly, evenly spaced, linear sRGB.
pub(crate) fn heat_stops_linear() -> [[f32; 4]; HEAT_STOPS] {
    std::array::from_fn(|idx| {
        let [r, g, b] = heat_color_linear(idx as f32 / (HEAT_STOPS - 1) as f32);
        [r, g, b, 1.0]
    })
}

/// The same stops for a legend: sRGB-encoded, 0..=1 each, evenly spaced from no offset to the end
/// of the range.
pub fn heat_ramp_srgb() -> [[f32; 3]; HEAT_STOPS] {
    heat_stops_linear().map(|[r, g, b, _]| [r, g, b].map(srgb_from_linear))
}

/// Oklab to linear sRGB (Ottosson 2020): lightness and opponent axes to cone responses' cube
/// roots, cubed, then to primaries.
fn linear_srgb_from_oklab([lightness, a, b]: [f32; 3]) -> [f32; 3] {
    let long = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let medium = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let short = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        4.076_741_7 * long - 3.307_711_6 * medium + 0.230_969_94 * short,
        -1.268_438 * long + 2.609_757_4 * medium - 0.341_319_4 * short,
        -0.004_196_086_3 * long - 0.703_418_6 * medium + 1.707_614_7 * short,
    ]
}

/// IEC 61966-2-1 encoding of one linear component.
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear value of one encoded component.
pub(crate) fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Matrix = [[f32; 3]; 3];

    /// Full protanopia, deuteranopia and tritanopia on linear sRGB (Machado, Oliveira, Fernandes
    /// 2009, "A physiologically-based model for simulation of color vision deficiency", severity 1).
    const DEFICIENCIES: [Matrix; 3] = [
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ],
    ];
    const NORMAL: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn luminance_seen(seen: &Matrix, [r, g, b, _]: [f32; 4]) -> f32 {
        let [r, g, b] = seen.map(|row| row[0] * r + row[1] * g + row[2] * b);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    #[test]
    fn brightness_rises_evenly_whoever_looks() {
        for seen in DEFICIENCIES.iter().chain([&NORMAL]) {
            let lightness = heat_stops_linear().map(|stop| luminance_seen(seen, stop).cbrt());
            let total = lightness[HEAT_STOPS - 1] - lightness[0];
            assert!(total > 0.4, "{total}");
            for pair in lightness.windows(2) {
                let rise = (pair[1] - pair[0]) / total * (HEAT_STOPS - 1) as f32;
                assert!((0.35..2.0).contains(&rise), "{rise} of {lightness:?}");
            }
        }
    }

    #[test]
    fn the_path_stays_inside_srgb() {
        for idx in 0..=100 {
            let along = idx as f32 / 100.0 * (PATH.len() - 1) as f32;
            let low = (along as usize).min(PATH.len() - 2);
            let share = along - low as f32;
            let [lightness, chroma, hue]: [f32; 3] =
                std::array::from_fn(|c| PATH[low][c] * (1.0 - share) + PATH[low + 1][c] * share);
            let (sin, cos) = hue.to_radians().sin_cos();
            let color = linear_srgb_from_oklab([lightness, chroma * cos, chroma * sin]);
            assert!(
                color.iter().all(|c| (-0.01..=1.01).contains(c)),
                "{idx}: {color:?}"
            );
        }
    }

    #[test]
    fn encoding_and_decoding_are_inverse() {
        for value in [0.0, 0.002, 0.0031308, 0.02, 0.5, 1.0] {
            assert!((linear_from_srgb(srgb_from_linear(value)) - value).abs() < 1e-6);
        }
        let ramp = heat_ramp_srgb();
        assert!(ramp.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
    }
}
