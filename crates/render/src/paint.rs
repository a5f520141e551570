//! Painted colours, and what a painter meant by them.
//!
//! A body painted in two colours, skin and clothes, has vertices on the border whose colours are
//! mixtures. Drawn as they are, the clothes' edge is a smear as wide as a triangle. Such bodies
//! are told by their colours, all of which lie between two; the shader then draws a sharp edge
//! where the mixture is even, along a line that [`hem`] lays through the triangles.

use dynaskin_clothes::{Tones, hem};

use crate::{BodyMesh, gpu_data::MaterialUniform, heat::linear_from_srgb};

/// Colour of a body that brings none: the light grey of a shop mannequin.
const PLAIN_SRGB: [u8; 3] = [178, 180, 184];

/// A body's colours as the GPU takes them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Paint {
    /// Red, green, blue (sRGB), and a fourth number that [`Hem::cut`] sets; `[V][4]` flattened.
    pub colors: Vec<u8>,
    pub material: MaterialUniform,
    /// Of bodies in two tones: what their hem is cut from.
    pub hem: Option<Hem>,
}

/// The border between a body's two colours, which takes a surface to be laid through.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hem {
    colors: Vec<u8>,
    /// How much of the second colour each vertex has, 0..=1.
    shares: Vec<f32>,
    faces: Vec<u32>,
}

impl Hem {
    /// The colours, and as their fourth number how far into the second colour each vertex of the
    /// surface `positions_m` (`[V][3]` flattened, metres) lies: 0 is `hem::REACH_M` away from it,
    /// 255 as far inside.
    pub fn cut(mut self, positions_m: &[f32]) -> Vec<u8> {
        let distances_m = hem::distances_m(&self.shares, &self.faces, positions_m);
        let vertices = self.colors.as_chunks_mut::<4>().0;
        for ([_, _, _, coded], distance_m) in vertices.iter_mut().zip(distances_m) {
            let share = 0.5 + 0.5 * distance_m / hem::REACH_M;
            *coded = (share * 255.0).round() as u8;
        }
        self.colors
    }
}

impl Paint {
    /// How much of each vertex is cloth; None where skin and cloth cannot be told apart, or once the hem
    /// has been cut.
    pub fn cloth_shares(&self) -> Option<Vec<f32>> {
        let hem = self.hem.as_ref()?;
        let of_cloth = |second: &f32| {
            if self.material.first_is_skin() {
                *second
            } else {
                1.0 - second
            }
        };
        Some(hem.shares.iter().map(of_cloth).collect())
    }

    /// The colours of `mesh`, plain where it has none.
    pub fn new(mesh: &BodyMesh<'_>) -> Self {
        let plain = |colors| Self {
            colors,
            material: MaterialUniform::PLAIN,
            hem: None,
        };
        if mesh.colors_srgba.is_empty() {
            let [r, g, b] = PLAIN_SRGB;
            return plain([r, g, b, 0].repeat(mesh.vertex_count()));
        }
        let colors = mesh.colors_srgba.to_vec();
        let painted = mesh.colors_srgba.as_chunks::<4>().0;
        let Some(Tones { srgb, shares }) = Tones::of(painted) else {
            return plain(colors);
        };
        let [first, second] = srgb.map(|tone| tone.map(f32::from));
        let linear = |tone: [f32; 3]| tone.map(|encoded| linear_from_srgb(encoded / 255.0));
        Self {
            material: MaterialUniform {
                first_linear: linear(first),
                two_tone: 1,
                second_linear: linear(second),
                hem_reach_m: hem::REACH_M,
            },
            hem: Some(Hem {
                colors: colors.clone(),
                shares,
                faces: mesh.faces.to_vec(),
            }),
            colors,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: [u8; 4] = [206, 176, 155, 255];
    const CLOTH: [u8; 4] = [38, 66, 85, 255];

    fn paint(colors: &[[u8; 4]], faces: &[u32]) -> Paint {
        Paint::new(&BodyMesh {
            faces,
            skin_joints: &vec![0; colors.len() * 4],
            skin_weights: &[],
            colors_srgba: colors.as_flattened(),
        })
    }

    #[test]
    fn other_paintings_stay_as_they_are() {
        let red = [200, 10, 10, 255];
        let off_line = [210, 178, 155, 255];
        for painted in [
            vec![SKIN, CLOTH, red],
            vec![SKIN, SKIN],
            vec![SKIN, off_line],
        ] {
            let colors = painted.as_flattened().to_vec();
            let expected = Paint {
                colors,
                material: MaterialUniform::PLAIN,
                hem: None,
            };
            assert_eq!(paint(&painted, &[]), expected);
        }
    }

    #[test]
    fn a_hem_is_cut_with_its_distance_in_the_fourth_number() {
        // A strip of 40 rows of two vertices, 10 mm apart, cloth from row 22 on.
        let colors: Vec<[u8; 4]> = (0..80)
            .map(|idx| if idx < 44 { SKIN } else { CLOTH })
            .collect();
        let rows = (0..39).flat_map(|row| {
            let at = 2 * row;
            [at, at + 1, at + 2, at + 1, at + 3, at + 2]
        });
        let positions_m: Vec<f32> = (0..80)
            .flat_map(|idx| [0.01 * (idx % 2) as f32, 0.01 * (idx / 2) as f32, 0.0])
            .collect();
        let paint = paint(&colors, &rows.collect::<Vec<u32>>());
        let cut = paint.hem.unwrap().cut(&positions_m);
        for (idx, [r, g, b, coded]) in cut.as_chunks::<4>().0.iter().enumerate() {
            assert_eq!([*r, *g, *b], colors[idx][..3]);
            let distance_m = 0.01 * ((idx / 2) as f32 - 21.5);
            let expected = 127.5 + 127.5 * (distance_m / hem::REACH_M).clamp(-1.0, 1.0);
            // 12 of 255 are 5 mm; the ends, where nothing is drawn, may be farther off.
            let tolerance = if distance_m.abs() < 0.025 { 12.0 } else { 50.0 };
            assert!(
                (f32::from(*coded) - expected).abs() < tolerance,
                "{idx}: {coded} {expected}"
            );
        }
    }
}
