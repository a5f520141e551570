//! The mirror image of offsets: the offsets of the mirrored motion.

use dynaskin_body::BodyModel;
use glam::Vec3;

use crate::TrainError;

/// A vertex and its partner may differ by this much in the template and still be partners. The
/// bodies' source is symmetric to 0.15 mm.
const TOLERANCE_M: f32 = 1e-3;

/// Which slot of a vertex list lies at the mirror image (x to -x) of which.
#[derive(Clone, Debug)]
pub struct Mirror {
    partner: Vec<usize>,
}

impl Mirror {
    /// Pairs the vertices of the list `vertices` by their rest positions at β = 0.
    ///
    /// # Errors
    /// [`TrainError::Config`] where a vertex has no partner within a millimetre.
    pub fn of_body(model: &BodyModel, vertices: &[u32]) -> Result<Self, TrainError> {
        let mut by_height: Vec<(f32, usize)> = vertices
            .iter()
            .enumerate()
            .map(|(slot, vertex)| (model.template_m[*vertex as usize].y, slot))
            .collect();
        by_height.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut partner = Vec::with_capacity(vertices.len());
        for vertex in vertices {
            let position = model.template_m[*vertex as usize];
            let image = Vec3::new(-position.x, position.y, position.z);
            let first = by_height.partition_point(|(y, _)| *y < image.y - TOLERANCE_M);
            let nearest = by_height[first..]
                .iter()
                .take_while(|(y, _)| *y <= image.y + TOLERANCE_M)
                .map(|(_, slot)| {
                    let other = model.template_m[vertices[*slot] as usize];
                    (other.distance(image), *slot)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match nearest {
                Some((distance, slot)) if distance <= TOLERANCE_M => partner.push(slot),
                _ => {
                    return Err(TrainError::Config {
                        setting: "mirror",
                        got: format!("true, and vertex {vertex} has no mirror partner"),
                        expected: "false for a body that is not symmetric (--no-mirror)".into(),
                    });
                }
            }
        }
        Ok(Self { partner })
    }

    /// The slot at the mirror image of `slot`; itself on the midline.
    pub fn partner(&self, slot: usize) -> usize {
        self.partner[slot]
    }

    /// The mirror image of one frame of offsets, `[slot][xyz]` flat.
    ///
    /// # Panics
    /// If `offsets` or `mirrored` does not hold three numbers a slot.
    pub fn apply(&self, offsets: &[f32], mirrored: &mut [f32]) {
        assert_eq!(offsets.len(), 3 * self.partner.len());
        assert_eq!(offsets.len(), mirrored.len());
        for (slot, partner) in self.partner.iter().enumerate() {
            mirrored[3 * slot] = -offsets[3 * partner];
            mirrored[3 * slot + 1] = offsets[3 * partner + 1];
            mirrored[3 * slot + 2] = offsets[3 * partner + 2];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn the_image_of_the_image_is_the_original() {
        let model = fixture::symmetric_body(4);
        let vertices: Vec<u32> = (0..model.vertex_count() as u32).collect();
        let mirror = Mirror::of_body(&model, &vertices).expect("a symmetric body");
        let offsets: Vec<f32> = (0..3 * vertices.len()).map(|i| i as f32).collect();
        let (mut once, mut twice) = (offsets.clone(), offsets.clone());
        mirror.apply(&offsets, &mut once);
        mirror.apply(&once, &mut twice);
        assert_ne!(offsets, once);
        assert_eq!(offsets, twice);
    }

    #[test]
    fn a_lopsided_body_is_refused() {
        let mut model = fixture::symmetric_body(4);
        model.template_m[0].y += 0.02;
        let vertices: Vec<u32> = (0..model.vertex_count() as u32).collect();
        let error = Mirror::of_body(&model, &vertices).expect_err("no partner");
        assert!(error.to_string().contains("mirror"), "{error}");
    }
}
