//! A matrix that is mostly zeros, as strips of columns: each has a list of the rows in which it is not
//! zero, and the weights of these alone.
//!
//! Columns of one block of the body share their rows, and blocks lie side by side, so the strips are
//! chosen to end where blocks do. A strip is a multiple of four columns wide: what it has too many
//! reaches into the next strip's columns, which is written after it.

use std::ops::Range;

use super::calculation::Sum;
use super::kernels::{LANES, MOST_COLUMNS};

/// What a row costs beside its multiplications, in multiplications of four numbers.
const ROW_COST: f32 = 0.75;
/// What a strip costs by itself.
const STRIP_COST: f32 = 8.0;

/// Columns that are calculated together.
#[derive(Debug, PartialEq)]
pub(super) struct Strip {
    /// Those of the sum that are this strip's.
    pub columns: Range<usize>,
    /// Rows of all terms, counted through.
    pub rows: Vec<usize>,
    /// For each row, its weights in the columns, and zeros up to a multiple of four.
    pub weights: Vec<f32>,
}

impl Strip {
    /// Columns that it writes, with those that it has too many.
    pub fn width(&self) -> usize {
        self.columns.len().next_multiple_of(LANES)
    }
}

/// The strips of the columns `range` of `sum`, in order.
pub(super) fn strips(sum: &Sum, range: Range<usize>) -> Vec<Strip> {
    let rows: Vec<(usize, usize)> = sum
        .terms
        .iter()
        .enumerate()
        .flat_map(|(term, of)| (0..of.of.len()).map(move |row| (term, row)))
        .collect();
    let patterns = patterns(sum, rows.len(), range.clone());
    let mut strips = Vec::new();
    let mut start = range.start;
    for length in best_lengths(&patterns) {
        let columns = start..start + length;
        start = columns.end;
        let own = &patterns[columns.start - range.start..columns.end - range.start];
        let used = |row: &usize| own.iter().any(|bits| bits[row / 64] >> (row % 64) & 1 == 1);
        let own: Vec<usize> = (0..rows.len()).filter(used).collect();
        let width = length.next_multiple_of(LANES);
        let mut weights = vec![0.0; own.len() * width];
        for (line, &row) in weights.chunks_exact_mut(width).zip(&own) {
            let (term, row) = rows[row];
            for (weight, column) in line.iter_mut().zip(columns.clone()) {
                *weight = sum.terms[term].weight(row, column);
            }
        }
        strips.push(Strip {
            columns,
            rows: own,
            weights,
        });
    }
    strips
}

/// For each column, a bit for every row in which it is not zero.
fn patterns(sum: &Sum, rows: usize, range: Range<usize>) -> Vec<Vec<u64>> {
    let mut patterns = vec![vec![0; rows.div_ceil(64)]; range.len()];
    let mut first = 0;
    for term in &sum.terms {
        for (pattern, column) in patterns.iter_mut().zip(range.clone()) {
            if term.columns[column].is_none() {
                continue;
            }
            for row in 0..term.of.len() {
                if term.weight(row, column) != 0.0 {
                    let bit = first + row;
                    pattern[bit / 64] |= 1 << (bit % 64);
                }
            }
        }
        first += term.of.len();
    }
    patterns
}

/// How many columns each strip has, so that all together cost least.
fn best_lengths(patterns: &[Vec<u64>]) -> Vec<usize> {
    let columns = patterns.len();
    // Of the columns from each on: the least cost, and the length of the first strip.
    let mut best = vec![(0.0, 0); columns + 1];
    for start in (0..columns).rev() {
        let mut union = patterns[start].clone();
        let mut least = (f32::INFINITY, 0);
        for length in 1..=MOST_COLUMNS.min(columns - start) {
            for (union, word) in union.iter_mut().zip(&patterns[start + length - 1]) {
                *union |= word;
            }
            let rows: u32 = union.iter().map(|word| word.count_ones()).sum();
            let quads = length.div_ceil(LANES) as f32;
            let cost = STRIP_COST + rows as f32 * (quads + ROW_COST) + best[start + length].0;
            if cost < least.0 {
                least = (cost, length);
            }
        }
        best[start] = least;
    }
    let mut lengths = Vec::new();
    let mut start = 0;
    while start < columns {
        lengths.push(best[start].1);
        start += best[start].1;
    }
    lengths
}
