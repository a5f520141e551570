//! The subspace of the offsets that dynaskin predicts in: principal components of one block of the
//! body each.
//!
//! Tissue of the left calf says nothing about the right arm, but components of the whole body hold
//! numbers for both. Blocks need a fifth of the weights for the same error
//! (docs/design/decoder.md), and weights are the download and the time of a frame.

use dynaskin_body::{BodyModel, REGION_COUNT, Region};
use nalgebra::DMatrix;

use super::symmetry::SignedPermutation;
use crate::TrainError;
use crate::mirror::Mirror;
use crate::pca::Basis;

/// Most components of one block.
const MOST_COMPONENTS: usize = 64;
/// Components of a block deviate by this share of the largest or are left out: below it lies what single
/// precision leaves of directions in which nothing moves.
const LEAST_SHARE: f32 = 1e-3;
/// Deviation of the one component of a block that never moves, in metres. Latents are divided by it.
const LEAST_DEVIATION_M: f32 = 1e-6;
/// A vertex this close to the plane x = 0 lies on it, in metres.
const MIDLINE_M: f32 = 1e-3;
/// Name of the block that lies on both sides.
const MIDDLE: &str = "middle";

/// A part of the body that is to have a basis of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Region and side, such as `left thighs`.
    pub name: String,
    /// The region; none where the body knows none.
    pub region: Option<Region>,
    /// Slots of the data set's vertex list, ascending.
    pub slots: Vec<usize>,
}

/// A part and its basis.
#[derive(Clone, Debug)]
pub struct Block {
    /// Region and side, such as `left thighs`.
    pub name: String,
    /// The region; none where the body knows none.
    pub region: Option<Region>,
    /// Slots of the data set's vertex list, ascending.
    pub slots: Vec<usize>,
    /// Directions of the offsets of these slots.
    pub basis: Basis,
}

/// Bases of blocks that share no vertex, so that all directions together are orthonormal: squared
/// distances between latents are squared distances between offset fields, in square metres.
#[derive(Clone, Debug)]
pub struct BlockBasis {
    /// The blocks; latents are those of the first block, then those of the second, and so on.
    pub blocks: Vec<Block>,
    /// Root mean square of each latent over the sample, in metres; above 0.
    pub deviation_m: Vec<f32>,
    coordinates: usize,
}

/// The parts of a body that become blocks: the regions, those that lie on both sides cut in two,
/// and what lies on the midline together with the belly. Left and right blocks are mirror images of
/// each other where there is a `mirror`. A body without regions is one block.
pub fn partition(model: &BodyModel, vertices: &[u32], mirror: Option<&Mirror>) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for slot in 0..vertices.len() {
        // Of two partners the first decides for both.
        let partner = mirror.map_or(slot, |mirror| mirror.partner(slot));
        let decides = vertices[slot.min(partner)] as usize;
        let x_m = model.template_m[vertices[slot] as usize].x;
        let region = region_of(model, decides, x_m);
        let name = match region {
            Some(region) if region != Region::Belly => {
                let side = if x_m > 0.0 { "left" } else { "right" };
                format!("{side} {}", region.name())
            }
            _ => MIDDLE.to_owned(),
        };
        match parts.iter_mut().find(|part| part.name == name) {
            Some(part) => part.slots.push(slot),
            None => parts.push(Part {
                name,
                region,
                slots: vec![slot],
            }),
        }
    }
    parts.sort_by(|a, b| a.name.cmp(&b.name));
    parts
}

/// The region that a vertex at `x_m` belongs to most; the belly on the midline.
fn region_of(model: &BodyModel, vertex: usize, x_m: f32) -> Option<Region> {
    if model.region_weights.len() != REGION_COUNT {
        return None;
    }
    if x_m.abs() < MIDLINE_M {
        return Some(Region::Belly);
    }
    let weight = |region: Region| model.region_weights[region as usize][vertex];
    let heaviest = |a: Region, b: Region| if weight(b) > weight(a) { b } else { a };
    Region::ALL.into_iter().reduce(heaviest)
}

impl BlockBasis {
    /// Bases of at most `components` directions together, from `sample` (one frame of offsets in
    /// metres a row) and the parts that [`partition`] gives. The directions go where they lower
    /// the mean vertex error most; left and right get as many. With a `mirror`, of a sample that holds each
    /// frame's mirror image, the right blocks' directions are the mirror images of the left blocks', and
    /// those of the block on the midline are even or odd.
    ///
    /// # Errors
    /// [`TrainError::Config`] where there are fewer components than blocks, or frames;
    /// [`TrainError::NotFinite`].
    pub fn fit(
        sample: &DMatrix<f32>,
        parts: Vec<Part>,
        components: usize,
        seed: u64,
        mirror: Option<&Mirror>,
    ) -> Result<Self, TrainError> {
        if components < parts.len() {
            return Err(TrainError::Config {
                setting: "components",
                got: components.to_string(),
                expected: format!("at least {}, one for each block", parts.len()),
            });
        }
        let mut blocks: Vec<Block> = Vec::new();
        let mut variances = Vec::new();
        for part in parts {
            let columns = part
                .slots
                .iter()
                .flat_map(|slot| (0..3).map(move |axis| 3 * slot + axis));
            let columns: Vec<usize> = columns.collect();
            let of_block = sample.select_columns(&columns);
            let frames = of_block.nrows().max(1) as f32;
            variances.push(of_block.norm_squared() / frames);
            let most = MOST_COMPONENTS.min(of_block.nrows()).min(of_block.ncols());
            let most = most.min(components);
            let across = |from: &[usize]| Across::between(from, &part.slots, mirror?);
            let other = blocks.iter().find_map(|block| {
                let across = across(&block.slots)?;
                Some(block.basis.mapped(|from, to| across.apply(from, to)))
            });
            let basis = match (other, across(&part.slots)) {
                (Some(other), _) => other,
                (None, Some(across)) => even_and_odd(&of_block, &across, most, seed)?,
                (None, None) => moving(&Basis::fit(&of_block, most, seed)?),
            };
            blocks.push(Block {
                name: part.name,
                region: part.region,
                slots: part.slots,
                basis,
            });
        }
        let counts = share_out(&blocks, &variances, components);
        for (block, count) in blocks.iter_mut().zip(counts) {
            block.basis = block.basis.truncated(count);
        }
        let deviations = blocks.iter().flat_map(|block| &block.basis.deviation_m);
        Ok(Self {
            deviation_m: deviations.map(|m| m.max(LEAST_DEVIATION_M)).collect(),
            blocks,
            coordinates: sample.ncols(),
        })
    }

    /// Number of components of all blocks.
    pub fn components(&self) -> usize {
        self.deviation_m.len()
    }

    /// Number of coordinates: three a vertex.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// Numbers in the bases: a component has as many as its block has coordinates.
    pub fn weight_count(&self) -> usize {
        let weights = |block: &Block| block.basis.components() * block.basis.coordinates();
        self.blocks.iter().map(weights).sum()
    }

    /// Latents of `offsets`, `[frame][coordinate]` flat in metres; gives `[frame][component]`, flat,
    /// in metres.
    ///
    /// # Panics
    /// If the length is not a multiple of the coordinates.
    pub fn project(&self, offsets: &[f32]) -> Vec<f32> {
        let frames = offsets.len() / self.coordinates;
        assert_eq!(offsets.len(), frames * self.coordinates);
        let mut latents = vec![0.0; frames * self.components()];
        let mut first = 0;
        for block in &self.blocks {
            let of_block: Vec<f32> = offsets
                .chunks_exact(self.coordinates)
                .flat_map(|field| {
                    block
                        .slots
                        .iter()
                        .map(|slot| &field[3 * slot..3 * slot + 3])
                })
                .flatten()
                .copied()
                .collect();
            let count = block.basis.components();
            let projected = block.basis.project(&of_block);
            for (latent, projected) in latents
                .chunks_exact_mut(self.components())
                .zip(projected.chunks_exact(count))
            {
                latent[first..first + count].copy_from_slice(projected);
            }
            first += count;
        }
        latents
    }

    /// What a mirror image does to blocks and latents, for a basis that was fitted with this `mirror`.
    pub fn mirrored(&self, mirror: &Mirror) -> (Vec<usize>, SignedPermutation) {
        let induced = self.induced(|from, to| mirror.apply(from, to));
        let rows = induced.chunks_exact(self.components().max(1));
        let (partner, sign) = rows
            .map(|row| {
                let largest = (0..row.len()).max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs()));
                let partner = largest.unwrap_or(0);
                debug_assert!((row[partner].abs() - 1.0).abs() < 1e-2, "{}", row[partner]);
                (partner, row[partner].signum())
            })
            .unzip();
        let of_blocks = self.blocks.iter().map(|block| {
            let images =
                |other: &Block| Across::between(&block.slots, &other.slots, mirror).is_some();
            // A basis fitted with the mirror has the image of every block.
            self.blocks.iter().position(images).unwrap_or(0)
        });
        (of_blocks.collect(), SignedPermutation { partner, sign })
    }

    /// What a linear map of offset fields does to latents, `[component][component]` row-major, as
    /// [`Basis::induced`]: exact where the map keeps the subspace.
    fn induced(&self, map: impl Fn(&[f32], &mut [f32])) -> Vec<f32> {
        let mut induced = Vec::with_capacity(self.components() * self.components());
        let mut mapped = vec![0.0; self.coordinates];
        for block in &self.blocks {
            for direction in block.basis.rows().chunks_exact(block.basis.coordinates()) {
                let mut field = vec![0.0; self.coordinates];
                for (slot, numbers) in block.slots.iter().zip(direction.chunks_exact(3)) {
                    field[3 * slot..3 * slot + 3].copy_from_slice(numbers);
                }
                map(&field, &mut mapped);
                induced.extend(self.project(&mapped));
            }
        }
        induced
    }

    /// Where each slot stands when the blocks' slots are laid end to end.
    pub fn places(&self) -> Vec<usize> {
        let mut places = vec![0; self.coordinates / 3];
        let slots = self.blocks.iter().flat_map(|block| &block.slots);
        for (place, slot) in slots.enumerate() {
            places[*slot] = place;
        }
        places
    }
}

/// From one block to its mirror image.
struct Across {
    /// For each slot of the image, the place of its partner among the slots of the block.
    places: Vec<usize>,
}

impl Across {
    /// From the block of the slots `from` to that of the slots `to`, both ascending; none where these are
    /// not mirror images of each other.
    fn between(from: &[usize], to: &[usize], mirror: &Mirror) -> Option<Self> {
        if from.len() != to.len() {
            return None;
        }
        let places = to
            .iter()
            .map(|slot| from.binary_search(&mirror.partner(*slot)).ok());
        Some(Self {
            places: places.collect::<Option<_>>()?,
        })
    }

    /// Mirrors one field of the block, `[slot][xyz]` flat.
    fn apply(&self, from: &[f32], to: &mut [f32]) {
        for (image, place) in to.chunks_exact_mut(3).zip(&self.places) {
            image.copy_from_slice(&from[3 * place..3 * place + 3]);
            image[0] = -image[0];
        }
    }
}

/// The basis of a block that is its own mirror image: components that are even, which the mirror keeps, and
/// components that are odd, which change sign.
fn even_and_odd(
    sample: &DMatrix<f32>,
    across: &Across,
    components: usize,
    seed: u64,
) -> Result<Basis, TrainError> {
    let fields = sample.transpose();
    let mut mirrored = fields.clone();
    for (from, mut to) in fields.column_iter().zip(mirrored.column_iter_mut()) {
        across.apply(from.as_slice(), to.as_mut_slice());
    }
    let even = Basis::fit(&(0.5 * (&fields + &mirrored)).transpose(), components, seed)?;
    let odd = Basis::fit(&(0.5 * (fields - mirrored)).transpose(), components, seed)?;
    let both = even.merged(&odd);
    Ok(moving(&both.truncated(components)))
}

/// The directions in which something moves, the largest first; one where nothing does.
fn moving(basis: &Basis) -> Basis {
    let largest_m = basis.deviation_m[0];
    let moves = |deviation_m: &&f32| **deviation_m > LEAST_SHARE * largest_m;
    let count = basis.deviation_m.iter().take_while(moves).count();
    basis.truncated(count.max(1))
}

/// How many components each block gets. Left and right blocks count as one, whose directions come in
/// pairs. One by one they go where the sum over the blocks of vertices times root-mean-square error
/// falls most, which is close to the mean vertex error.
fn share_out(blocks: &[Block], variances: &[f32], components: usize) -> Vec<usize> {
    let group_of = |name: &str| {
        let sides = ["left ", "right "];
        let stripped = sides.iter().find_map(|side| name.strip_prefix(side));
        stripped.unwrap_or(name).to_owned()
    };
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, block) in blocks.iter().enumerate() {
        let name = group_of(&block.name);
        match groups.iter_mut().find(|group| group.0 == name) {
            Some((_, members)) => members.push(index),
            None => groups.push((name, vec![index])),
        }
    }
    let mut counts = vec![1; blocks.len()];
    loop {
        let left = components - counts.iter().sum::<usize>();
        let gain = |members: &[usize]| -> f32 {
            let gains = members.iter().map(|&index| {
                let spectrum = &blocks[index].basis.deviation_m;
                let Some(next) = spectrum.get(counts[index]) else {
                    return 0.0;
                };
                let taken: f32 = spectrum[..counts[index]].iter().map(|d| d * d).sum();
                let rest = (variances[index] - taken).max(next * next);
                next * next * (blocks[index].slots.len() as f32 / rest).sqrt()
            });
            gains.sum::<f32>() / members.len() as f32
        };
        let affordable = groups.iter().filter(|(_, members)| members.len() <= left);
        let best = affordable
            .map(|(_, members)| (gain(members), members))
            .filter(|(gain, _)| *gain > 0.0)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, members)) = best else {
            return counts;
        };
        for &index in members {
            counts[index] = (counts[index] + 1).min(blocks[index].basis.components());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Twelve slots: four in the middle that swing with amplitude 3, four on each side with
    /// amplitude 1. Each part moves in `rank` ways.
    fn sample(frames: usize, rank: usize) -> DMatrix<f32> {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut sample = DMatrix::zeros(frames, 36);
        let side = DMatrix::from_fn(rank, 12, |_, _| rng.random_range(-1.0f32..1.0));
        let middle = DMatrix::from_fn(rank, 12, |_, _| rng.random_range(-3.0f32..3.0));
        for (start, ways) in [(0, &middle), (12, &side), (24, &side)] {
            let mix = DMatrix::from_fn(frames, rank, |_, _| rng.random_range(-1.0f32..1.0));
            sample.columns_mut(start, 12).copy_from(&(mix * ways));
        }
        sample
    }

    fn parts() -> Vec<Part> {
        let part = |name: &str, region, slots: std::ops::Range<usize>| Part {
            name: name.into(),
            region: Some(region),
            slots: slots.collect(),
        };
        vec![
            part("left thighs", Region::Thighs, 4..8),
            part("middle", Region::Belly, 0..4),
            part("right thighs", Region::Thighs, 8..12),
        ]
    }

    fn decoded(basis: &BlockBasis, latent: &[f32]) -> Vec<f32> {
        let mut field = vec![0.0; basis.coordinates()];
        let mut latents = latent.iter();
        for block in &basis.blocks {
            for (direction, latent) in block
                .basis
                .rows()
                .chunks_exact(block.basis.coordinates())
                .zip(&mut latents)
            {
                for (slot, numbers) in block.slots.iter().zip(direction.chunks_exact(3)) {
                    for axis in 0..3 {
                        field[3 * slot + axis] += latent * numbers[axis];
                    }
                }
            }
        }
        field
    }

    #[test]
    fn fields_of_the_subspace_come_back_block_by_block() {
        let sample = sample(80, 3);
        let basis = BlockBasis::fit(&sample, parts(), 9, 1, None).expect("a basis");
        assert_eq!(basis.components(), 9);
        let field: Vec<f32> = sample.row(7).iter().copied().collect();
        let back = decoded(&basis, &basis.project(&field));
        for (got, expected) in back.iter().zip(&field) {
            assert!((got - expected).abs() < 1e-4, "{got} {expected}");
        }
    }

    #[test]
    fn components_go_where_the_error_is_and_sides_get_as_many() {
        let basis = BlockBasis::fit(&sample(80, 4), parts(), 7, 1, None).expect("a basis");
        let counts: Vec<usize> = basis.blocks.iter().map(|b| b.basis.components()).collect();
        assert_eq!(counts[0], counts[2]);
        assert!(counts[1] > counts[0], "{counts:?}");
        let error = BlockBasis::fit(&sample(80, 4), parts(), 2, 1, None).expect_err("too few");
        assert!(error.to_string().contains("at least 3"), "{error}");
    }

    #[test]
    fn directions_in_which_nothing_moves_are_left_out() {
        // The left side moves in one way, the right side not at all.
        let mut sample = sample(80, 3);
        let one_way = sample.columns(12, 1) * sample.view((0, 12), (1, 12));
        sample.columns_mut(12, 12).copy_from(&one_way);
        sample.columns_mut(24, 12).fill(0.0);
        let basis = BlockBasis::fit(&sample, parts(), 30, 1, None).expect("a basis");
        let counts: Vec<usize> = basis.blocks.iter().map(|b| b.basis.components()).collect();
        assert_eq!(counts, [1, 3, 1]);
        assert!(
            basis
                .deviation_m
                .iter()
                .all(|deviation_m| *deviation_m > 0.0)
        );
        let still = basis.project(&[1e-3; 36])[4] / basis.deviation_m[4];
        assert!(still.is_finite(), "{still}");
    }

    #[test]
    fn with_a_mirror_the_right_side_is_the_left_ones_image_and_the_middle_even_or_odd() {
        let pairs = 8;
        let model = fixture::symmetric_body(pairs);
        let vertices: Vec<u32> = (0..2 * pairs as u32).collect();
        let mirror = Mirror::of_body(&model, &vertices).expect("symmetric");
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let fields = 60;
        let mut numbers = Vec::new();
        for _ in 0..fields {
            let field: Vec<f32> = (0..6 * pairs)
                .map(|_| rng.random_range(-1.0..1.0))
                .collect();
            let mut image = vec![0.0; 6 * pairs];
            mirror.apply(&field, &mut image);
            numbers.extend([field, image].concat());
        }
        let sample = DMatrix::from_row_slice(2 * fields, 6 * pairs, &numbers);
        // Even slots lie left, odd ones right; four pairs are thighs, the others the belly.
        let part = |name: &str, region, slots: Vec<usize>| Part {
            name: name.into(),
            region: Some(region),
            slots,
        };
        let parts = vec![
            part("left thighs", Region::Thighs, vec![0, 2, 4, 6]),
            part("middle", Region::Belly, (8..16).collect()),
            part("right thighs", Region::Thighs, vec![1, 3, 5, 7]),
        ];
        let basis = BlockBasis::fit(&sample, parts, 24, 1, Some(&mirror)).expect("a basis");
        let (blocks, latents) = basis.mirrored(&mirror);
        assert_eq!(blocks, [2, 1, 0]);
        let odd = latents.sign.iter().filter(|sign| **sign < 0.0).count();
        assert!(odd > 0 && latents.count() == 24, "{latents:?}");
        let latent = basis.project(&numbers[..6 * pairs]);
        for (i, got) in basis
            .project(&numbers[6 * pairs..12 * pairs])
            .iter()
            .enumerate()
        {
            let expected = latents.sign[i] * latent[latents.partner[i]];
            assert!((got - expected).abs() < 1e-4, "{i}: {got} {expected}");
        }
    }
}
