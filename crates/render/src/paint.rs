//! Painted colours, and what a painter meant by them.
//!
//! A body painted in two colours, skin and clothes, has vertices on the border whose colours are
//! mixtures. Drawn as they are, the clothes' edge is a smear as wide as a triangle. Such bodies
//! are told by their colours, all of which lie between two; the shader then draws a sharp edge
//! where the mixture is even. Colours of whole vertices make that edge a staircase, so the mixture
//! is smoothed over the mesh first.

use std::collections::HashMap;

use crate::{BodyMesh, gpu_data::MaterialUniform, heat::linear_from_srgb};

/// Colour of a body that brings none: the light grey of a shop mannequin.
const PLAIN_SRGB: [u8; 3] = [178, 180, 184];

/// Two colours closer than this (of 255) are shades of one.
const LEAST_DISTANCE: f32 = 40.0;

/// How far (of 255) a colour may be off the line between the two: files round their colours.
const LINE_TOLERANCE: f32 = 6.0;

/// Straightens a staircase one triangle high, and keeps straps three triangles wide.
const SMOOTHING_ROUNDS: usize = 8;

/// A body's colours as the GPU takes them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Paint {
    /// Red, green, blue (sRGB) and, for two-tone bodies, the share of the second colour; `[V][4]`
    /// flattened.
    pub colors: Vec<u8>,
    pub material: MaterialUniform,
}

impl Paint {
    /// The colours of `mesh`, plain where it has none.
    pub fn new(mesh: &BodyMesh<'_>) -> Self {
        let colors_srgba = mesh.colors_srgba;
        let n_vertices = mesh.vertex_count();
        if colors_srgba.is_empty() {
            let [r, g, b] = PLAIN_SRGB;
            return Self {
                colors: [r, g, b, 0].repeat(n_vertices),
                material: MaterialUniform::PLAIN,
            };
        }
        let painted = colors_srgba.as_chunks::<4>().0;
        let two_tone = two_tones(painted).and_then(|tones| {
            let shares = painted.iter().map(|color| share_of_second(&tones, *color));
            Some((tones, shares.collect::<Option<Vec<f32>>>()?))
        });
        let Some(([first, second], mut shares)) = two_tone else {
            return Self {
                colors: colors_srgba.to_vec(),
                material: MaterialUniform::PLAIN,
            };
        };
        smooth(&mut shares, mesh.faces);
        let bytes = shares.iter().map(|share| (share * 255.0).round() as u8);
        let colors = painted.iter().zip(bytes);
        let linear = |tone: [f32; 3]| tone.map(|encoded| linear_from_srgb(encoded / 255.0));
        Self {
            colors: colors
                .flat_map(|(&[r, g, b, _], share)| [r, g, b, share])
                .collect(),
            material: MaterialUniform {
                first_linear: linear(first),
                two_tone: 1,
                second_linear: linear(second),
                padding: 0.0,
            },
        }
    }
}

/// The most frequent colour, and the most frequent one that differs clearly from it.
fn two_tones(painted: &[[u8; 4]]) -> Option<[[f32; 3]; 2]> {
    let mut counts: HashMap<[u8; 3], usize> = HashMap::new();
    for &[r, g, b, _] in painted {
        *counts.entry([r, g, b]).or_default() += 1;
    }
    // Ties go to the lower colour, so that the order of the map does not show.
    let most_frequent = |accept: &dyn Fn([f32; 3]) -> bool| {
        let accepted = counts
            .iter()
            .filter(|(color, _)| accept(color.map(f32::from)));
        let best = accepted.max_by_key(|&(color, count)| (count, std::cmp::Reverse(color)));
        best.map(|(color, _)| color.map(f32::from))
    };
    let first = most_frequent(&|_| true)?;
    let second = most_frequent(&|color| distance(color, first) >= LEAST_DISTANCE)?;
    Some([first, second])
}

/// How much of the second tone, 0..=1, is in a colour; none if it is no mixture of the two.
fn share_of_second([first, second]: &[[f32; 3]; 2], [r, g, b, _]: [u8; 4]) -> Option<f32> {
    let color = [r, g, b].map(f32::from);
    let axis: [f32; 3] = std::array::from_fn(|idx| second[idx] - first[idx]);
    let length_squared: f32 = axis.iter().map(|part| part * part).sum();
    let along: f32 = (0..3)
        .map(|idx| (color[idx] - first[idx]) * axis[idx])
        .sum();
    let share = (along / length_squared).clamp(0.0, 1.0);
    let mixture = std::array::from_fn(|idx| first[idx] + share * axis[idx]);
    (distance(color, mixture) <= LINE_TOLERANCE).then_some(share)
}

/// Moves every share halfway to the mean over its triangles' corners, a few times.
fn smooth(shares: &mut [f32], faces: &[u32]) {
    let mut sums = vec![(0.0, 0.0); shares.len()];
    for _ in 0..SMOOTHING_ROUNDS {
        sums.fill((0.0, 0.0));
        for face in faces.as_chunks::<3>().0 {
            let corners = face.map(|idx| idx as usize);
            let total: f32 = corners.iter().map(|&idx| shares[idx]).sum();
            for idx in corners {
                sums[idx].0 += total;
                sums[idx].1 += 3.0;
            }
        }
        for (share, &(sum, count)) in shares.iter_mut().zip(&sums) {
            if count > 0.0 {
                *share = 0.5 * *share + 0.5 * sum / count;
            }
        }
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f32>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: [u8; 4] = [206, 176, 155, 255];
    const CLOTH: [u8; 4] = [38, 66, 85, 255];
    const HALF: [u8; 4] = [122, 121, 120, 255];

    fn paint(colors: &[[u8; 4]], faces: &[u32]) -> Paint {
        Paint::new(&BodyMesh {
            faces,
            skin_joints: &vec![0; colors.len() * 4],
            skin_weights: &[],
            colors_srgba: colors.as_flattened(),
        })
    }

    fn shares(paint: &Paint) -> Vec<u8> {
        paint
            .colors
            .as_chunks::<4>()
            .0
            .iter()
            .map(|color| color[3])
            .collect()
    }

    #[test]
    fn mixtures_of_skin_and_cloth_are_told_apart() {
        let paint = paint(&[SKIN, SKIN, SKIN, HALF, CLOTH, CLOTH], &[]);
        assert_eq!(paint.material.two_tone, 1);
        assert_eq!(shares(&paint), [0, 0, 0, 128, 255, 255]);
        assert!(paint.material.first_linear[0] > paint.material.second_linear[0]);
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
            };
            assert_eq!(paint(&painted, &[]), expected);
        }
    }

    #[test]
    fn smoothing_keeps_large_areas_and_evens_the_border() {
        // A strip of 40 rows of two vertices, cloth from row 20 on, on one side from row 21 on.
        let colors: Vec<[u8; 4]> = (0..80)
            .map(|idx| if idx / 2 >= 20 + idx % 2 { CLOTH } else { SKIN })
            .collect();
        let rows = (0..39).flat_map(|row| {
            let at = 2 * row;
            [at, at + 1, at + 2, at + 1, at + 3, at + 2]
        });
        let smoothed = shares(&paint(&colors, &rows.collect::<Vec<u32>>()));
        assert!(
            smoothed[..16].iter().all(|&share| share == 0),
            "{smoothed:?}"
        );
        assert!(
            smoothed[64..].iter().all(|&share| share == 255),
            "{smoothed:?}"
        );
        for row in smoothed.as_chunks::<2>().0 {
            assert!(row[0].abs_diff(row[1]) < 40, "{smoothed:?}");
        }
    }
}
