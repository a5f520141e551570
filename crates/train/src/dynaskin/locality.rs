//! Which part of the predictor works for which part of the body.
//!
//! Tissue feels the motion of the bone that carries it, so the springs of a block are driven by the
//! features of its own joints only, and only they are read out for it. A predictor whose springs
//! may listen to every joint learns chance correlations of its training motions (the hands of a
//! boxer and her calves) that do not hold for others. The cells of the LSTM belong to blocks as well.
//! What acts across blocks (a thigh that pulls at the buttock, an arm against the chest) is heard by
//! them: cells hear the springs of their own block and of its neighbours.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint};
use dynaskin_runtime::features::{INERTIAL_JOINTS, ROTATION_JOINTS};

use super::blocks::BlockBasis;
use super::build::Build;
use super::prepare::Hearing;
use super::spin::SPINS;

/// A joint carries a block if it has this share of its skin weights.
const CARRIER_SHARE: f32 = 0.015;

/// The blocks of a predictor.
#[derive(Clone, Debug, PartialEq)]
pub struct Locality {
    /// For each block, which of the motion features it feels.
    pub felt: Vec<Vec<bool>>,
    /// For each block, which of the numbers about the body it hears.
    pub heard: Vec<Vec<bool>>,
    /// For each block, which blocks its cells hear: itself and its neighbours.
    pub near: Vec<Vec<bool>>,
    /// For each block, its number of latents.
    pub latents: Vec<usize>,
}

impl Locality {
    /// One block that feels and hears everything.
    pub fn everywhere(motion: usize, conditions: usize, latents: usize) -> Self {
        Self {
            felt: vec![vec![true; motion]],
            heard: vec![vec![true; conditions]],
            near: vec![vec![true]],
            latents: vec![latents],
        }
    }

    /// The blocks of `basis` on the body `model`, whose slots are `vertices`. A block feels the
    /// joints that carry its skin and the parents of these, and hears the shape, and materials and
    /// thickness of its own region. Neighbours are blocks that share a triangle or a region: left and
    /// right breast or thigh touch.
    pub fn of_body(model: &BodyModel, vertices: &[u32], basis: &BlockBasis, build: &Build) -> Self {
        let felt = basis.blocks.iter().map(|block| {
            let mut weights = [0.0; JOINT_COUNT];
            for slot in &block.slots {
                let skin = &model.skin[vertices[*slot] as usize];
                for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                    weights[usize::from(*joint)] += weight;
                }
            }
            let all: f32 = weights.iter().sum();
            let mut felt = [false; JOINT_COUNT];
            for joint in Joint::ALL {
                if weights[joint as usize] > CARRIER_SHARE * all {
                    felt[joint as usize] = true;
                    if let Some(parent) = joint.parent() {
                        felt[parent as usize] = true;
                    }
                }
            }
            features_of_joints(&felt)
        });
        let heard = basis.blocks.iter().map(|block| {
            let region = block.region.map(|region| region as usize);
            (0..build.count())
                .map(|i| build.is_heard(i, region))
                .collect()
        });
        Self {
            felt: felt.collect(),
            heard: heard.collect(),
            near: neighbours(model, vertices, basis),
            latents: basis.blocks.iter().map(|b| b.basis.components()).collect(),
        }
    }

    /// The block of each latent.
    pub fn latent_blocks(&self) -> Vec<usize> {
        let blocks = self.latents.iter().enumerate();
        blocks
            .flat_map(|(block, latents)| std::iter::repeat_n(block, *latents))
            .collect()
    }

    /// The block of each of `units` units, shared out in proportion to the latents.
    pub fn unit_blocks(&self, units: usize) -> Vec<usize> {
        let blocks = self.latent_blocks();
        (0..units)
            .map(|unit| blocks[unit * blocks.len() / units])
            .collect()
    }
}

/// For each block of `basis`, which blocks share a triangle or a region with it; itself is one.
fn neighbours(model: &BodyModel, vertices: &[u32], basis: &BlockBasis) -> Vec<Vec<bool>> {
    let mut block_of_vertex = vec![None; model.vertex_count()];
    for (index, block) in basis.blocks.iter().enumerate() {
        for slot in &block.slots {
            block_of_vertex[vertices[*slot] as usize] = Some(index);
        }
    }
    let same_region = |a: usize, b: usize| {
        let (a, b) = (basis.blocks[a].region, basis.blocks[b].region);
        a.is_some() && a == b
    };
    let count = basis.blocks.len();
    let mut near: Vec<Vec<bool>> = (0..count)
        .map(|a| (0..count).map(|b| a == b || same_region(a, b)).collect())
        .collect();
    for face in &model.faces {
        let blocks = face.map(|vertex| block_of_vertex[vertex as usize]);
        for a in blocks.into_iter().flatten() {
            for b in blocks.into_iter().flatten() {
                near[a][b] = true;
            }
        }
    }
    near
}

/// Which numbers about the motion ([`Hearing::motion`]) are about the given joints.
fn features_of_joints(joints: &[bool; JOINT_COUNT]) -> Vec<bool> {
    let inertial = INERTIAL_JOINTS.into_iter().map(|joint| (joint, 9));
    let rotations = ROTATION_JOINTS.into_iter().map(|joint| (joint, 6));
    let spins = INERTIAL_JOINTS.into_iter().map(|joint| (joint, SPINS));
    let felt: Vec<bool> = inertial
        .chain(rotations)
        .chain(spins)
        .flat_map(|(joint, count)| std::iter::repeat_n(joints[joint as usize], count))
        .collect();
    debug_assert_eq!(felt.len(), Hearing::MOTION_COUNT);
    felt
}

/// A matrix `[rows][columns]` of 1 where the units of row and column belong to one block, flat.
pub fn same_block(rows: &[usize], columns: &[usize]) -> Vec<f32> {
    let matches = |row: &usize| {
        let row = *row;
        columns
            .iter()
            .map(move |column| f32::from(u8::from(row == *column)))
    };
    rows.iter().flat_map(matches).collect()
}

/// `[input][units]` of 1 where `of_blocks[block of the unit][input]`, flat.
fn transposed(of_blocks: &[Vec<bool>], units: &[usize]) -> Vec<f32> {
    let inputs = of_blocks.first().map_or(0, Vec::len);
    let row = |input: usize| {
        let of_unit = move |block: &usize| f32::from(u8::from(of_blocks[*block][input]));
        units.iter().map(of_unit)
    };
    (0..inputs).flat_map(row).collect()
}

impl Locality {
    /// A matrix `[motion][units]` of 1 where the unit's block feels the feature, flat.
    pub fn feeling(&self, units: &[usize]) -> Vec<f32> {
        transposed(&self.felt, units)
    }

    /// A matrix `[rows][columns]` of 1 where the block of the column hears the block of the row, flat.
    pub fn nearby(&self, rows: &[usize], columns: &[usize]) -> Vec<f32> {
        let heard = |row: &usize| {
            let row = *row;
            columns
                .iter()
                .map(move |column| f32::from(u8::from(self.near[*column][row])))
        };
        rows.iter().flat_map(heard).collect()
    }

    /// A matrix `[conditions][units]` of 1 where the unit's block hears the number, flat.
    pub fn hearing(&self, units: &[usize]) -> Vec<f32> {
        transposed(&self.heard, units)
    }
}

#[cfg(test)]
mod tests {
    use dynaskin_body::Region;
    use nalgebra::DMatrix;

    use super::*;
    use crate::dynaskin::blocks::Part;
    use crate::fixture;

    #[test]
    fn units_are_shared_out_in_proportion() {
        let locality = Locality {
            felt: vec![vec![true, false], vec![false, true]],
            heard: vec![vec![true], vec![false]],
            near: vec![vec![true, false], vec![true, true]],
            latents: vec![1, 3],
        };
        assert_eq!(locality.unit_blocks(8), [0, 0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(locality.feeling(&[0, 1, 1]), [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(
            same_block(&[0, 1], &[1, 1, 0]),
            [0.0, 0.0, 1.0, 1.0, 1.0, 0.0]
        );
        // The second block hears the first, not the other way round.
        assert_eq!(locality.nearby(&[0, 1], &[0, 1]), [1.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn neighbours_share_a_triangle_or_a_region() {
        let mut model = fixture::symmetric_body(8);
        let vertices: Vec<u32> = (0..8).collect();
        model.faces = vec![[0, 1, 2]];
        let one = |name: &str, region, slots: &[usize]| Part {
            name: name.to_owned(),
            region: Some(region),
            slots: slots.to_vec(),
        };
        let parts = vec![
            one("left calves", Region::Calves, &[0]),
            one("left thighs", Region::Thighs, &[1, 2]),
            one("right calves", Region::Calves, &[3]),
            one("belly", Region::Belly, &[4, 5, 6, 7]),
        ];
        let sample = DMatrix::from_fn(30, 3 * vertices.len(), |r, c| ((r * 7 + c * 3) % 11) as f32);
        let basis = BlockBasis::fit(&sample, parts, 8, 1).expect("a basis");
        let (yes, no) = (true, false);
        assert_eq!(
            neighbours(&model, &vertices, &basis),
            [
                [yes, yes, yes, no],
                [yes, yes, no, no],
                [yes, no, yes, no],
                [no, no, no, yes]
            ]
        );
    }
}
