//! Which part of the predictor works for which part of the body.
//!
//! Tissue is driven by the motion of the bone that carries it. So the springs of a block are connected to
//! the features of its own joints only, and only they are read out for it. A predictor whose springs are
//! connected to every joint learns chance correlations of its training motions (the hands of a boxer and
//! her calves) that do not hold for others. The cells of the LSTM belong to blocks as well. They are
//! connected to the springs of their own block and of its neighbours, because some effects act across
//! blocks: a thigh that pulls at the buttock, an arm against the chest.

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint};
use dynaskin_runtime::features::INERTIAL_JOINTS;

use super::blocks::BlockBasis;
use super::build::Build;
use super::inputs::{KIND, PredictorInputs};
use super::spin::SPINS;
use super::symmetry::SignedPermutation;

/// A joint carries a block if it has this share of its skin weights.
const CARRIER_SHARE: f32 = 0.015;

/// The blocks of a predictor.
#[derive(Clone, Debug, PartialEq)]
pub struct Locality {
    /// For each block, which of the motion features it is connected to.
    pub motion_inputs: Vec<Vec<bool>>,
    /// For each block, which of the numbers about the body it is conditioned on.
    pub condition_inputs: Vec<Vec<bool>>,
    /// For each block, which blocks its cells are connected to: itself and its neighbours.
    pub near: Vec<Vec<bool>>,
    /// For each block, its number of latents.
    pub latents: Vec<usize>,
    /// What a mirror image does, where left and right are tied.
    pub mirror: Option<LocalityMirror>,
}

/// What a mirror image does to blocks, motion and latents.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalityMirror {
    /// The block on the other side of each; itself on the midline.
    pub blocks: Vec<usize>,
    /// To the numbers about the motion.
    pub motion: SignedPermutation,
    /// To the latents.
    pub latents: SignedPermutation,
}

/// The units of one layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// The block of each.
    pub blocks: Vec<usize>,
    /// What a mirror image does to them, where left and right are tied.
    pub mirror: Option<SignedPermutation>,
}

impl Locality {
    /// One block that is connected to everything.
    pub fn everywhere(motion: usize, conditions: usize, latents: usize) -> Self {
        Self {
            motion_inputs: vec![vec![true; motion]],
            condition_inputs: vec![vec![true; conditions]],
            near: vec![vec![true]],
            latents: vec![latents],
            mirror: None,
        }
    }

    /// The same with left and right tied. Where one side of a pair of blocks is connected to something, the
    /// other is to its mirror image.
    #[must_use]
    pub fn tied(mut self, mirror: LocalityMirror) -> Self {
        let count = self.latents.len();
        let (motion, near) = (self.motion_inputs.clone(), self.near.clone());
        for block in 0..count {
            let other = mirror.blocks[block];
            for (input, connected) in self.motion_inputs[block].iter_mut().enumerate() {
                *connected |= motion[other][mirror.motion.partner[input]];
            }
            for (neighbour, connected) in self.near[block].iter_mut().enumerate() {
                *connected |= near[other][mirror.blocks[neighbour]];
            }
        }
        self.mirror = Some(mirror);
        self
    }

    /// The blocks of `basis` on the body `model`, whose slots are `vertices`. A block is
    /// connected to the joints that carry its skin and the parents of these. It is conditioned on the shape,
    /// and on materials and thickness of its own region. Neighbours are blocks that share a triangle or a region: left and
    /// right breast or thigh touch.
    pub fn of_body(model: &BodyModel, vertices: &[u32], basis: &BlockBasis, build: &Build) -> Self {
        let motion_inputs = basis.blocks.iter().map(|block| {
            let mut weights = [0.0; JOINT_COUNT];
            for slot in &block.slots {
                let skin = &model.skin[vertices[*slot] as usize];
                for (joint, weight) in skin.joints.iter().zip(skin.weights) {
                    weights[usize::from(*joint)] += weight;
                }
            }
            let all: f32 = weights.iter().sum();
            let mut carriers = [false; JOINT_COUNT];
            for joint in Joint::ALL {
                if weights[joint as usize] > CARRIER_SHARE * all {
                    carriers[joint as usize] = true;
                    if let Some(parent) = joint.parent() {
                        carriers[parent as usize] = true;
                    }
                }
            }
            features_of_joints(&carriers)
        });
        let condition_inputs = basis.blocks.iter().map(|block| {
            let region = block.region.map(|region| region as usize);
            (0..build.count())
                .map(|i| build.is_connected(i, region))
                .collect()
        });
        Self {
            motion_inputs: motion_inputs.collect(),
            condition_inputs: condition_inputs.collect(),
            near: neighbours(model, vertices, basis),
            latents: basis.blocks.iter().map(|b| b.basis.components()).collect(),
            mirror: None,
        }
    }

    /// The block of each latent.
    pub fn latent_blocks(&self) -> Vec<usize> {
        let blocks = self.latents.iter().enumerate();
        blocks
            .flat_map(|(block, latents)| std::iter::repeat_n(block, *latents))
            .collect()
    }

    /// `units` units, shared out by the square roots of the numbers of latents: so many of one block, then of
    /// the next. In proportion to the latents a block of few, whose motion is no simpler, would get too few. With
    /// left and right tied both sides of the body get as many, whose mirror images they are. On the midline
    /// every second unit is odd: it changes its sign in a mirror image.
    pub fn units(&self, units: usize) -> Units {
        let counts = self.shared_out(units);
        let Some(mirror) = &self.mirror else {
            let blocks = counts.iter().enumerate();
            return Units {
                blocks: blocks
                    .flat_map(|(block, count)| std::iter::repeat_n(block, *count))
                    .collect(),
                mirror: None,
            };
        };
        let first = |block: usize| counts[..block].iter().sum::<usize>();
        let mut laid = Units {
            blocks: Vec::new(),
            mirror: None,
        };
        let mut permutation = SignedPermutation::identity(0);
        for (block, count) in counts.iter().enumerate() {
            let other = mirror.blocks[block];
            laid.blocks.extend(std::iter::repeat_n(block, *count));
            for unit in 0..*count {
                permutation.partner.push(first(other) + unit);
                let odd = other == block && unit % 2 == 1;
                permutation.sign.push(if odd { -1.0 } else { 1.0 });
            }
        }
        laid.mirror = Some(permutation);
        laid
    }

    /// How many of `units` units each block gets, both sides of a pair as many. Where no block lies on the
    /// midline and the number is odd, one is left over.
    fn shared_out(&self, units: usize) -> Vec<usize> {
        let other = |block: usize| self.mirror.as_ref().map_or(block, |m| m.blocks[block]);
        let roots: Vec<f64> = self.latents.iter().map(|n| (*n as f64).sqrt()).collect();
        let all: f64 = roots.iter().sum();
        let mut counts = vec![0; self.latents.len()];
        let mut left = units;
        loop {
            // The block that lacks most of its share, if there is enough left for it and its partner.
            let groups = (0..counts.len()).filter(|block| *block <= other(*block));
            let size = |block: usize| if other(block) == block { 1 } else { 2 };
            let lacks = |block: usize| {
                let share = units as f64 * roots[block] / all.max(f64::MIN_POSITIVE);
                share - counts[block] as f64
            };
            let affordable = groups.filter(|block| size(*block) <= left);
            let Some(block) = affordable.max_by(|a, b| lacks(*a).total_cmp(&lacks(*b))) else {
                return counts;
            };
            left -= size(block);
            counts[block] += 1;
            counts[other(block)] = counts[block];
        }
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

/// Which numbers about the motion ([`PredictorInputs::motion`]) are about the given joints.
fn features_of_joints(joints: &[bool; JOINT_COUNT]) -> Vec<bool> {
    let inertial = INERTIAL_JOINTS.into_iter().map(|joint| (joint, 9));
    let rotations = KIND.rotation_joints().iter().map(|joint| (*joint, 6));
    let spins = INERTIAL_JOINTS.into_iter().map(|joint| (joint, SPINS));
    let features: Vec<bool> = inertial
        .chain(rotations)
        .chain(spins)
        .flat_map(|(joint, count)| std::iter::repeat_n(joints[joint as usize], count))
        .collect();
    debug_assert_eq!(features.len(), PredictorInputs::MOTION_COUNT);
    features
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
    /// A matrix `[motion][units]` of 1 where the unit's block is connected to the feature, flat.
    pub fn motion_mask(&self, units: &[usize]) -> Vec<f32> {
        transposed(&self.motion_inputs, units)
    }

    /// A matrix `[rows][columns]` of 1 where the block of the column is connected to that of the row, flat.
    pub fn neighbour_mask(&self, rows: &[usize], columns: &[usize]) -> Vec<f32> {
        let connected = |row: &usize| {
            let row = *row;
            columns
                .iter()
                .map(move |column| f32::from(u8::from(self.near[*column][row])))
        };
        rows.iter().flat_map(connected).collect()
    }

    /// A matrix `[conditions][units]` of 1 where the unit's block is conditioned on the number, flat.
    pub fn condition_mask(&self, units: &[usize]) -> Vec<f32> {
        transposed(&self.condition_inputs, units)
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
    fn units_are_shared_out_by_the_roots_of_the_latents() {
        let locality = Locality {
            motion_inputs: vec![vec![true, false], vec![false, true]],
            condition_inputs: vec![vec![true], vec![false]],
            near: vec![vec![true, false], vec![true, true]],
            latents: vec![1, 9],
            mirror: None,
        };
        assert_eq!(locality.units(8).blocks, [0, 0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(
            locality.motion_mask(&[0, 1, 1]),
            [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]
        );
        assert_eq!(
            same_block(&[0, 1], &[1, 1, 0]),
            [0.0, 0.0, 1.0, 1.0, 1.0, 0.0]
        );
        // The second block is connected to the first, not the other way round.
        assert_eq!(
            locality.neighbour_mask(&[0, 1], &[0, 1]),
            [1.0, 1.0, 0.0, 1.0]
        );
    }

    #[test]
    fn both_sides_get_as_many_units_and_mirror_each_other() {
        let (yes, no) = (true, false);
        let locality = Locality {
            motion_inputs: vec![vec![yes, no], vec![yes, no], vec![no, no]],
            condition_inputs: vec![vec![yes]; 3],
            near: vec![vec![yes, yes, no], vec![no, yes, no], vec![no, no, yes]],
            // Left, middle, right.
            latents: vec![3, 2, 3],
            mirror: None,
        };
        let tied = locality.tied(LocalityMirror {
            blocks: vec![2, 1, 0],
            motion: SignedPermutation {
                partner: vec![1, 0],
                sign: vec![1.0, 1.0],
            },
            latents: SignedPermutation::identity(8),
        });
        assert_eq!(tied.motion_inputs, [[yes, no], [yes, yes], [no, yes]]);
        assert_eq!(tied.near, [[yes, yes, no], [no, yes, no], [no, yes, yes]]);
        let units = tied.units(9);
        assert_eq!(units.blocks, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
        let mirror = units.mirror.expect("tied");
        assert_eq!(mirror.partner, [6, 7, 8, 3, 4, 5, 0, 1, 2]);
        assert_eq!(mirror.sign, [1., 1., 1., 1., -1., 1., 1., 1., 1.]);
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
        let basis = BlockBasis::fit(&sample, parts, 8, 1, None).expect("a basis");
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
