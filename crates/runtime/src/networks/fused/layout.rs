//! From a [`Calculation`] to a [`Program`]: every number gets its place, matrices become strips.

use std::collections::HashMap;
use std::ops::Range;

use super::calculation::{Calculation, Element, Sum, Term, Vector};
use super::kernels::LANES;
use super::program::{Multiply, Program, Step};
use super::strips::{Strip, strips};

/// Numbers of room behind what a step writes: it works in steps of four.
const SPARE: usize = LANES;

/// A list in more stretches than one for so many numbers is put together before it is used.
const NUMBERS_PER_STRETCH: usize = 8;

/// What picking a number from its place costs, in multiplications of four numbers.
const PICK_COST: usize = 2;

/// The program of `calculation`.
pub(super) fn program(mut calculation: Calculation) -> Program {
    for port in 0..calculation.outputs.len() {
        if let Some(sum) = in_order(&calculation, &calculation.outputs[port]) {
            calculation.outputs[port] = calculation.push(Vector::Sum(sum));
        }
    }
    let needed = calculation.needed();
    let mut layout = Layout::default();
    for (id, vector) in calculation.vectors.iter().enumerate() {
        let start = if needed[id] { layout.vector(vector) } else { 0 };
        layout.starts.push(start);
    }
    let inputs = calculation.inputs.iter().map(|&input| {
        let (id, start) = (input as usize, layout.starts[input as usize]);
        let length = calculation.vectors[id].len();
        start..start + if needed[id] { length } else { 0 }
    });
    layout.program.inputs = inputs.collect();
    for output in &calculation.outputs {
        let start = layout.gathered(output);
        layout.program.outputs.push(start..start + output.len());
    }
    layout.program
}

/// The numbers `elements`, columns of several sums or of one in another order, as one sum in their
/// order; none where picking them from the sums is cheaper.
fn in_order(calculation: &Calculation, elements: &[Element]) -> Option<Sum> {
    let mut sources: Vec<u32> = Vec::new();
    for element in elements {
        let Element::Of { vector, .. } = element else {
            return None;
        };
        if !matches!(calculation.vectors[*vector as usize], Vector::Sum(_)) {
            return None;
        }
        if !sources.contains(vector) {
            sources.push(*vector);
        }
    }
    if sources.is_empty() || calculation.whole_sum(elements).is_some() {
        return None;
    }
    let mut ordered = Sum {
        first: Vec::with_capacity(elements.len()),
        terms: Vec::new(),
    };
    let mut apart = elements.len() * PICK_COST;
    for &source in &sources {
        let Vector::Sum(sum) = &calculation.vectors[source as usize] else {
            return None;
        };
        apart += cost(sum);
        let own = |element: &Element| match element {
            Element::Of { vector, index } if *vector == source => Some(*index as usize),
            _ => None,
        };
        for term in &sum.terms {
            let columns = elements.iter().map(|e| term.columns[own(e)?]);
            ordered.terms.push(Term {
                of: term.of.clone(),
                weights: term.weights.clone(),
                columns: columns.collect(),
            });
        }
    }
    for element in elements {
        if let Element::Of { vector, index } = element
            && let Vector::Sum(sum) = &calculation.vectors[*vector as usize]
        {
            ordered.first.push(sum.first[*index as usize]);
        }
    }
    (cost(&ordered) <= apart).then_some(ordered)
}

/// Multiplications of four numbers that a sum takes.
fn cost(sum: &Sum) -> usize {
    let strips = strips(sum, 0..sum.first.len());
    strips.iter().map(|strip| strip.weights.len() / 4).sum()
}

#[derive(Default)]
struct Layout {
    program: Program,
    /// By vector.
    starts: Vec<usize>,
    /// Where lists of constants stand, by their bits.
    constants: HashMap<Vec<u32>, usize>,
}

/// Numbers side by side in the memory, and which of a list they are.
struct Stretch {
    place: usize,
    range: Range<usize>,
}

impl Layout {
    /// Room for `length` numbers.
    fn room(&mut self, length: usize) -> usize {
        let start = self.program.memory.len();
        let end = (start + length).next_multiple_of(4) + SPARE;
        self.program.memory.resize(end, 0.0);
        start
    }

    /// Adds the steps of a vector and gives its place.
    fn vector(&mut self, vector: &Vector) -> usize {
        match vector {
            Vector::Input(length) => self.room(*length),
            Vector::Sum(sum) => self.sum(sum),
            Vector::Unary(function, of) => {
                let [of] = self.operands([of]);
                let to = self.room(vector.len());
                for (range, [from]) in common([&of]) {
                    self.program.steps.push(Step::Unary {
                        function: *function,
                        from,
                        to: to + range.start,
                        length: range.len(),
                    });
                }
                to
            }
            Vector::Binary(function, [a, b]) => {
                let [a, b] = self.operands([a, b]);
                let to = self.room(vector.len());
                for (range, from) in common([&a, &b]) {
                    self.program.steps.push(Step::Binary {
                        function: *function,
                        from,
                        to: to + range.start,
                        length: range.len(),
                    });
                }
                to
            }
        }
    }

    fn sum(&mut self, sum: &Sum) -> usize {
        let zero = Element::Constant(0.0);
        let starts: Vec<Option<usize>> = if sum.first.iter().all(|first| *first == zero) {
            vec![None; sum.first.len()]
        } else {
            let [first] = self.operands([&sum.first]);
            let places = first.iter().flat_map(|stretch| {
                (0..stretch.range.len()).map(move |index| Some(stretch.place + index))
            });
            places.collect()
        };
        let rows: Vec<u32> = sum
            .terms
            .iter()
            .flat_map(|term| &term.of)
            .map(|element| self.place(*element) as u32)
            .collect();
        let to = self.room(sum.first.len());
        let mut start = 0;
        while start < starts.len() {
            let next = |column: &usize| starts[*column] != starts[*column - 1].map(|p| p + 1);
            let end = (start + 1..starts.len()).find(next).unwrap_or(starts.len());
            for strip in strips(sum, start..end) {
                self.strip(&strip, &rows, starts[strip.columns.start], to);
            }
            start = end;
        }
        to
    }

    fn strip(&mut self, strip: &Strip, rows: &[u32], first: Option<usize>, to: usize) {
        let program = &mut self.program;
        let (places, weights) = (program.places.len(), program.weights.len());
        program
            .places
            .extend(strip.rows.iter().map(|&row| rows[row]));
        program.weights.extend_from_slice(&strip.weights);
        program.steps.push(Step::Multiply(Multiply {
            first,
            width: strip.width(),
            to: to + strip.columns.start,
            places: places..program.places.len(),
            weights: weights..program.weights.len(),
        }));
    }

    /// Where lists stand; those all over the memory are put together first.
    fn operands<const N: usize>(&mut self, lists: [&Vec<Element>; N]) -> [Vec<Stretch>; N] {
        lists.map(|list| {
            let stretches = self.stretches(list);
            if stretches.len() > 1 && stretches.len() * NUMBERS_PER_STRETCH > list.len() {
                let place = self.picked(&stretches);
                let range = 0..list.len();
                return vec![Stretch { place, range }];
            }
            stretches
        })
    }

    /// The place of a list that stands side by side.
    fn gathered(&mut self, list: &[Element]) -> usize {
        let stretches = self.stretches(list);
        match &stretches[..] {
            [stretch] => stretch.place,
            _ => self.picked(&stretches),
        }
    }

    fn picked(&mut self, stretches: &[Stretch]) -> usize {
        let start = self.program.places.len();
        for Stretch { place, range } in stretches {
            let places = (*place..place + range.len()).map(|place| place as u32);
            self.program.places.extend(places);
        }
        let places = start..self.program.places.len();
        let to = self.room(places.len());
        self.program.steps.push(Step::Gather { places, to });
        to
    }

    fn place(&mut self, element: Element) -> usize {
        match element {
            Element::Of { vector, index } => self.starts[vector as usize] + index as usize,
            Element::Constant(number) => self.constants(&[number]),
        }
    }

    fn constants(&mut self, numbers: &[f32]) -> usize {
        let bits = numbers.iter().map(|number| number.to_bits()).collect();
        if let Some(&place) = self.constants.get(&bits) {
            return place;
        }
        let place = self.room(numbers.len());
        self.program.memory[place..place + numbers.len()].copy_from_slice(numbers);
        self.constants.insert(bits, place);
        place
    }

    /// The stretches of `list`, in order.
    fn stretches(&mut self, list: &[Element]) -> Vec<Stretch> {
        let mut stretches: Vec<Stretch> = Vec::new();
        let mut index = 0;
        while index < list.len() {
            let constants: Vec<f32> = list[index..]
                .iter()
                .map_while(|element| match element {
                    Element::Constant(number) => Some(*number),
                    Element::Of { .. } => None,
                })
                .collect();
            let (place, length) = if constants.is_empty() {
                (self.place(list[index]), 1)
            } else {
                (self.constants(&constants), constants.len())
            };
            match stretches.last_mut() {
                Some(last) if last.place + last.range.len() == place => {
                    last.range.end += length;
                }
                _ => stretches.push(Stretch {
                    place,
                    range: index..index + length,
                }),
            }
            index += length;
        }
        stretches
    }
}

/// The ranges over which none of the lists has a break, and where each list's numbers stand there.
fn common<const N: usize>(lists: [&Vec<Stretch>; N]) -> Vec<(Range<usize>, [usize; N])> {
    let mut ends: Vec<usize> = lists
        .iter()
        .flat_map(|list| list.iter().map(|stretch| stretch.range.end))
        .collect();
    ends.sort_unstable();
    ends.dedup();
    let mut start = 0;
    let mut common = Vec::new();
    for end in ends {
        let places = lists.map(|list| {
            let own = list.iter().find(|stretch| stretch.range.contains(&start));
            own.map_or(0, |stretch| stretch.place + start - stretch.range.start)
        });
        common.push((start..end, places));
        start = end;
    }
    common
}
