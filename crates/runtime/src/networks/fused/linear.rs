//! A fused network that is nothing but products with constant matrices, as one matrix: what others need
//! to run it.

use std::ops::Range;

use super::Fused;
use super::program::{Multiply, Program, Step};

/// What [`LinearDecoder`] is made of, column by column: rows and weights that are not zero.
type Columns = Vec<Vec<(u32, f32)>>;

/// A decoder that is a product with a matrix, and perhaps a constant: whatever the constant is, the offsets
/// of two latents differ by the matrix times the latents' difference.
///
/// Most of the matrix is zero, so it has a list of weights for each vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearDecoder {
    latent_count: usize,
    starts: Vec<u32>,
    latents: Vec<u32>,
    weights: Vec<[f32; 3]>,
}

impl LinearDecoder {
    /// L: how many latents there are.
    pub fn latent_count(&self) -> usize {
        self.latent_count
    }

    /// V: how many vertices it moves.
    pub fn vertex_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// `[V + 1]`: vertex `i` has the weights from number `starts[i]` up to `starts[i + 1]`.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Of each weight, the latent that it is multiplied with.
    pub fn latents(&self) -> &[u32] {
        &self.latents
    }

    /// The weights along x, y and z, in metres per unit of the latent.
    pub fn weights(&self) -> &[[f32; 3]] {
        &self.weights
    }

    /// Writes the matrix times `latents` (L numbers) to `offsets_m`, three numbers a vertex, in metres.
    pub(crate) fn multiply(&self, latents: &[f32], offsets_m: &mut [f32]) {
        let ranges = self.starts.windows(2);
        for (range, offset) in ranges.zip(offsets_m.as_chunks_mut::<3>().0) {
            let own = range[0] as usize..range[1] as usize;
            *offset = [0.0; 3];
            for (&latent, weights) in self.latents[own.clone()].iter().zip(&self.weights[own]) {
                for (sum, weight) in offset.iter_mut().zip(weights) {
                    *sum += latents[latent as usize] * weight;
                }
            }
        }
    }
}

impl Fused {
    /// The network, of one input of numbers and one output of three numbers a vertex, as one matrix; none
    /// where it is anything else.
    pub fn linear(&self) -> Option<LinearDecoder> {
        let program = &self.tick;
        let ([input], [output], None) = (&program.inputs[..], &program.outputs[..], &self.once)
        else {
            return None;
        };
        let columns = columns(program, input, output)?;
        let (axes, []) = columns.as_chunks::<3>() else {
            return None;
        };
        let mut linear = LinearDecoder {
            latent_count: input.len(),
            starts: vec![0],
            latents: Vec::new(),
            weights: Vec::new(),
        };
        for axes in axes {
            let numbers = axes.iter().enumerate();
            let mut numbers: Vec<(u32, usize, f32)> = numbers
                .flat_map(|(axis, column)| column.iter().map(move |&(row, w)| (row, axis, w)))
                .collect();
            numbers.sort_unstable_by_key(|&(row, axis, _)| (row, axis));
            let first = linear.latents.len();
            for (row, axis, weight) in numbers {
                if linear.latents[first..].last() != Some(&row) {
                    linear.latents.push(row);
                    linear.weights.push([0.0; 3]);
                }
                if let Some(weights) = linear.weights.last_mut() {
                    weights[axis] += weight;
                }
            }
            linear.starts.push(linear.latents.len() as u32);
        }
        Some(linear)
    }
}

/// For each number of `output`, the numbers of `input` and their weights; none where a step is no product
/// of the input with weights, added to constants.
fn columns(program: &Program, input: &Range<usize>, output: &Range<usize>) -> Option<Columns> {
    let strips = program.steps.iter().map(|step| match step {
        Step::Multiply(strip) => Some(strip),
        _ => None,
    });
    let strips: Vec<&Multiply> = strips.collect::<Option<_>>()?;
    let apart = |a: &Range<usize>, b: &Range<usize>| a.end <= b.start || b.end <= a.start;
    let is_constant = |place: &Range<usize>| {
        let written = |strip: &&Multiply| !apart(place, &(strip.to..strip.to + strip.width));
        apart(place, input) && !strips.iter().any(written)
    };
    let mut columns = vec![None; output.len()];
    for strip in &strips {
        if let Some(first) = strip.first
            && !is_constant(&(first..first + strip.width))
        {
            return None;
        }
        let places = &program.places[strip.places.clone()];
        if !places
            .iter()
            .all(|&place| input.contains(&(place as usize)))
        {
            return None;
        }
        let weights = program.weights[strip.weights.clone()].chunks_exact(strip.width);
        for column in 0..strip.width {
            // What a strip has too many is the next strip's, which comes later.
            let place = strip.to + column;
            if output.contains(&place) {
                let rows = places.iter().zip(weights.clone());
                let rows = rows.map(|(place, line)| (place - input.start as u32, line[column]));
                let own = rows.filter(|(_, weight)| *weight != 0.0).collect();
                columns[place - output.start] = Some(own);
            }
        }
    }
    columns.into_iter().collect()
}
