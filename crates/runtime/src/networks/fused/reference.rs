//! What a [`Calculation`] gives, written to be read: what tests hold programs to.

use super::calculation::{Calculation, Element, Sum, Vector};
use super::functions::{Binary, Unary};

/// The outputs from the inputs, both by port.
pub(super) fn run(calculation: &Calculation, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut inputs = inputs.iter();
    let mut vectors: Vec<Vec<f32>> = Vec::new();
    for vector in &calculation.vectors {
        let number = |element: &Element| match *element {
            Element::Constant(number) => number,
            Element::Of { vector, index } => vectors[vector as usize][index as usize],
        };
        let numbers = match vector {
            Vector::Input(_) => inputs.next().expect("an input for each port").clone(),
            Vector::Sum(sum) => product(sum, number),
            Vector::Unary(function, of) => of.iter().map(|x| unary(*function, number(x))).collect(),
            Vector::Binary(function, [a, b]) => {
                let pairs = a.iter().zip(b);
                pairs
                    .map(|(a, b)| binary(*function, number(a), number(b)))
                    .collect()
            }
        };
        vectors.push(numbers);
    }
    let number = |element: &Element| match *element {
        Element::Constant(number) => number,
        Element::Of { vector, index } => vectors[vector as usize][index as usize],
    };
    let outputs = calculation.outputs.iter();
    outputs
        .map(|output| output.iter().map(number).collect())
        .collect()
}

fn product(sum: &Sum, number: impl Fn(&Element) -> f32) -> Vec<f32> {
    let columns = 0..sum.first.len();
    let column = |column: usize| {
        let terms = sum.terms.iter().flat_map(|term| {
            let rows = term.of.iter().enumerate();
            rows.map(|(row, x)| number(x) * term.weight(row, column))
        });
        number(&sum.first[column]) + terms.sum::<f32>()
    };
    columns.map(column).collect()
}

pub(super) fn unary(function: Unary, x: f32) -> f32 {
    match function {
        Unary::Exp => x.exp(),
        Unary::Log => x.ln(),
        Unary::Sigmoid => 1.0 / (1.0 + (-x).exp()),
        Unary::Tanh => x.tanh(),
    }
}

pub(super) fn binary(function: Binary, a: f32, b: f32) -> f32 {
    match function {
        Binary::Add => a + b,
        Binary::Max => a.max(b),
        Binary::Mul => a * b,
        Binary::Sub => a - b,
    }
}
