//! A calculation as a list of steps over one stretch of memory a row: every number has its place, and
//! nothing is allocated or moved while it runs.

use std::ops::Range;

use super::functions::{Binary, Unary};
use super::kernels;

/// What runs one row, or several.
#[derive(Debug, Default)]
pub(super) struct Program {
    /// A row's memory before its first run: constants, and zeros.
    pub memory: Vec<f32>,
    /// Where each input goes; empty where nothing depends on it.
    pub inputs: Vec<Range<usize>>,
    /// Where each output stands after a run.
    pub outputs: Vec<Range<usize>>,
    pub steps: Vec<Step>,
    /// Places that steps name.
    pub places: Vec<u32>,
    /// Weights of all strips.
    pub weights: Vec<f32>,
}

/// Places are those of numbers in a row's memory. What is read lies before `to`.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// Products with a strip of a matrix.
    Multiply(Multiply),
    /// A function of each of `length` numbers.
    Unary {
        function: Unary,
        from: usize,
        to: usize,
        length: usize,
    },
    /// A function of two numbers each.
    Binary {
        function: Binary,
        from: [usize; 2],
        to: usize,
        length: usize,
    },
    /// Numbers from all over put side by side.
    Gather { places: Range<usize>, to: usize },
}

/// `first + Σ x[place] · weights` for `width` columns.
#[derive(Clone, Debug)]
pub(super) struct Multiply {
    /// Where the columns start from; 0 where there is none.
    pub first: Option<usize>,
    /// A multiple of four.
    pub width: usize,
    pub to: usize,
    /// In [`Program::places`].
    pub places: Range<usize>,
    /// In [`Program::weights`].
    pub weights: Range<usize>,
}

/// The memory of rows that run together.
#[derive(Debug)]
pub(super) struct Memory {
    numbers: Vec<f32>,
    /// Of one row.
    length: usize,
}

impl Memory {
    /// For one row of `program`.
    pub fn new(program: &Program) -> Self {
        Self {
            numbers: program.memory.clone(),
            length: program.memory.len(),
        }
    }

    /// Makes room for `rows` rows.
    pub fn reserve(&mut self, program: &Program, rows: usize) {
        while self.numbers.len() < rows * self.length {
            self.numbers.extend_from_slice(&program.memory);
        }
    }

    /// One row's.
    pub fn row(&self, row: usize) -> &[f32] {
        &self.numbers[row * self.length..(row + 1) * self.length]
    }

    /// One row's.
    pub fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.numbers[row * self.length..(row + 1) * self.length]
    }
}

impl Program {
    /// Calculates the outputs of the first `rows` rows of `memory` from their inputs. Every row gets
    /// the same bits as alone.
    pub fn run(&self, memory: &mut Memory, rows: usize) {
        let used = rows * memory.length;
        for step in &self.steps {
            // A strip's weights stay in the nearest cache for all rows.
            for row in memory.numbers[..used].chunks_exact_mut(memory.length.max(1)) {
                self.step(step, row);
            }
        }
    }

    fn step(&self, step: &Step, row: &mut [f32]) {
        match step {
            Step::Multiply(strip) => {
                let (before, after) = row.split_at_mut(strip.to);
                let first = strip.first.map_or(0..0, |first| first..first + strip.width);
                kernels::multiply(
                    before,
                    &before[first],
                    &self.places[strip.places.clone()],
                    &self.weights[strip.weights.clone()],
                    &mut after[..strip.width],
                );
            }
            Step::Unary {
                function,
                from,
                to,
                length,
            } => {
                let length = length.next_multiple_of(kernels::LANES);
                let (before, after) = row.split_at_mut(*to);
                kernels::unary(
                    *function,
                    &before[*from..from + length],
                    &mut after[..length],
                );
            }
            Step::Binary {
                function,
                from: [a, b],
                to,
                length,
            } => {
                let length = length.next_multiple_of(kernels::LANES);
                let (before, after) = row.split_at_mut(*to);
                let (a, b) = (&before[*a..a + length], &before[*b..b + length]);
                kernels::binary(*function, a, b, &mut after[..length]);
            }
            Step::Gather { places, to } => {
                let (before, after) = row.split_at_mut(*to);
                for (target, place) in after.iter_mut().zip(&self.places[places.clone()]) {
                    *target = before[*place as usize];
                }
            }
        }
    }
}
