//! What a network calculates for one row, number by number: the form between a graph of tract and a
//! [`super::program::Program`].
//!
//! Moving numbers about (splitting, joining, picking, reshaping) is no calculation: it only changes
//! which [`Element`] stands where.

use std::sync::Arc;

use super::functions::{Binary, Unary};

/// One number of a row's calculation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Element {
    /// The same in every run.
    Constant(f32),
    /// A number of a vector.
    Of {
        /// Which of [`Calculation::vectors`].
        vector: u32,
        /// Which of its numbers.
        index: u32,
    },
}

/// All that one row's run calculates.
#[derive(Clone, Debug, Default)]
pub(super) struct Calculation {
    /// Each depends on those before it alone.
    pub vectors: Vec<Vector>,
    /// The vectors that are inputs, by port.
    pub inputs: Vec<u32>,
    /// What is put out, by port.
    pub outputs: Vec<Vec<Element>>,
}

/// Numbers that are calculated in one go.
#[derive(Clone, Debug)]
pub(super) enum Vector {
    /// An input of so many numbers.
    Input(usize),
    /// Products with matrices, added.
    Sum(Sum),
    /// A function of each number.
    Unary(Unary, Vec<Element>),
    /// A function of two numbers each.
    Binary(Binary, [Vec<Element>; 2]),
}

/// `first + Σ term.of · term.weights`, one number a column.
#[derive(Clone, Debug)]
pub(super) struct Sum {
    /// What each column starts from.
    pub first: Vec<Element>,
    pub terms: Vec<Term>,
}

/// A vector times the columns of a matrix.
#[derive(Clone, Debug)]
pub(super) struct Term {
    /// One a row of the matrix.
    pub of: Vec<Element>,
    pub weights: Arc<Weights>,
    /// The matrix's column that each column of the sum takes; none where it takes none.
    pub columns: Vec<Option<u32>>,
}

/// A matrix.
#[derive(Debug)]
pub(super) struct Weights {
    pub columns: usize,
    /// Row by row.
    pub numbers: Vec<f32>,
}

impl Calculation {
    /// Adds a vector and gives its elements.
    pub fn push(&mut self, vector: Vector) -> Vec<Element> {
        let id = self.vectors.len() as u32;
        let elements = all(id, vector.len());
        self.vectors.push(vector);
        elements
    }

    /// For each vector, whether an output depends on it.
    pub fn needed(&self) -> Vec<bool> {
        let mut needed = vec![false; self.vectors.len()];
        let mark = |needed: &mut Vec<bool>, elements: &[Element]| {
            for element in elements {
                if let Element::Of { vector, .. } = element {
                    needed[*vector as usize] = true;
                }
            }
        };
        for output in &self.outputs {
            mark(&mut needed, output);
        }
        for (id, vector) in self.vectors.iter().enumerate().rev() {
            if needed[id] {
                vector.operands(&mut |elements| mark(&mut needed, elements));
            }
        }
        needed
    }

    /// The sum whose numbers, in their order, `elements` are.
    pub fn whole_sum(&self, elements: &[Element]) -> Option<&Sum> {
        let Some(Element::Of { vector, .. }) = elements.first() else {
            return None;
        };
        match &self.vectors[*vector as usize] {
            Vector::Sum(sum) if all(*vector, sum.first.len()) == elements => Some(sum),
            _ => None,
        }
    }
}

impl Vector {
    /// How many numbers it has.
    pub fn len(&self) -> usize {
        match self {
            Self::Input(length) => *length,
            Self::Sum(sum) => sum.first.len(),
            Self::Unary(_, of) | Self::Binary(_, [of, _]) => of.len(),
        }
    }

    /// Calls `each` for every list of numbers that it is calculated from.
    pub fn operands(&self, each: &mut dyn FnMut(&[Element])) {
        match self {
            Self::Input(_) => {}
            Self::Sum(sum) => {
                each(&sum.first);
                sum.terms.iter().for_each(|term| each(&term.of));
            }
            Self::Unary(_, of) => each(of),
            Self::Binary(_, [a, b]) => {
                each(a);
                each(b);
            }
        }
    }
}

impl Sum {
    /// The columns `order` of this sum, in that order.
    pub fn of_columns(&self, order: &[u32]) -> Self {
        let first = order.iter().map(|&column| self.first[column as usize]);
        let terms = self.terms.iter().map(|term| Term {
            of: term.of.clone(),
            weights: Arc::clone(&term.weights),
            columns: order
                .iter()
                .map(|&column| term.columns[column as usize])
                .collect(),
        });
        Self {
            first: first.collect(),
            terms: terms.collect(),
        }
    }
}

impl Term {
    /// The weight of row `row` in column `column` of the sum.
    pub fn weight(&self, row: usize, column: usize) -> f32 {
        match self.columns[column] {
            Some(column) => self.weights.numbers[row * self.weights.columns + column as usize],
            None => 0.0,
        }
    }
}

/// All numbers of vector `vector`.
pub(super) fn all(vector: u32, length: usize) -> Vec<Element> {
    (0..length as u32)
        .map(|index| Element::Of { vector, index })
        .collect()
}
